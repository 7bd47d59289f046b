"""`coverable path --passes` where it takes more than one motion, and its best direction."""

from __future__ import annotations

import json

import pytest
from small_cases import PANEL

from feasibility.cli.main import main

ROUND = """
[robot]
name = "ur5"
[robot.limits_deg]
shoulder_pan_joint = [-180, 180]
wrist_2_joint = [-100, 100]
[surface]
kind = "cylinder"
radius = 0.3
u_deg = [-170, 170]
v = [0.0, 0.1]
position = [0.0, 0.0, 0.25]
side = "outside"
cells = [2, 2]
[task]
standoff = 0.12
cone_deg = 20
footprint = 0.1
"""
PLATE = f"""
{PANEL.replace("u = [0.0, 0.2]", "u = [0.0, 0.3]")}
task.footprint = 0.05
task.coverage = 0.9
"""


@pytest.fixture
def case(tmp_path):
    def write(text: str) -> str:
        path = tmp_path / "panel.toml"
        path.write_text(text)
        return str(path)

    return write


def test_passes_are_cut_where_they_cannot_be_run(case, tmp_path, capsys) -> None:
    out = tmp_path / "run.csv"
    asked = ["path", case(ROUND), "--passes", "0", "--pitch", "0.1", "--out", str(out)]
    switch = ["--program", str(tmp_path / "run.script"), "--on", "ON", "--off", "OFF"]
    assert main([*asked, *switch, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    runs, cuts = found["runs"], found["cuts"]
    assert found["verdict"] == "infeasible"
    assert len(runs) == len(cuts) + 1 > 1
    assert found["left_out_m"] == 0.0
    assert found["refused"] == []
    assert all("limit" in cut["cause"] for cut in cuts)
    assert {stretch for run in runs for stretch in run["stretches"]} == {1}
    for cut, before, after in zip(cuts, runs, runs[1:], strict=False):
        assert before["poses"][1] == cut["poses"][0] <= cut["poses"][1] == after["poses"][0]
        assert len(cut["waypoints"][0]) == len(cut["joints"]) == 6
    assert sorted(tmp_path.glob("run_*.csv")) == [
        tmp_path / f"run_{k + 1}.csv" for k in range(len(runs))
    ]
    for k in range(len(runs)):
        lines = (tmp_path / f"run_{k + 1}.script").read_text().split()
        assert lines.count("ON") == lines.count("OFF") == 1
    assert found["treated"]["lower"] > 0.97
    assert main(asked[:-2]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert f"{len(runs)} runs with {len(cuts)} interruption" in said
    assert "comes to its limit" in said


def test_the_best_direction_has_the_fewest_passes(case, tmp_path, capsys) -> None:
    html = tmp_path / "view.html"
    asked = ["path", case(PLATE), "--pitch", "0.05", "--json"]
    assert main([*asked, "--passes", "best", "--html", str(html)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["passes"]["count"] == 4
    assert found["treated"]["lower"] >= 0.99
    page = html.read_text()
    assert all(name in page for name in ("4 passes in one motion", "numbers", "treated once"))
    assert main([*asked, "--passes", "0", "--cross"]) == 0
    assert json.loads(capsys.readouterr().out)["passes"]["count"] == 4 + 6


def test_a_pitch_wider_than_the_footprint_leaves_stripes(case, capsys) -> None:
    wide = [case(PLATE), "--passes", "0", "--pitch", "0.1"]
    assert main(["path", *wide]) == 3
    said = capsys.readouterr()
    assert "stripes up to 50 mm wide are left between" in " ".join(said.out.split())
    assert "undecided: the path treats" in said.err
    assert main(["path", *wide, "--set", "task.coverage="]) == 0
    treated = capsys.readouterr().out
    assert "untreated: " in " ".join(treated.split())


def test_no_stripes_are_said_to_be_left_beside_all_that_is_treated(case, capsys) -> None:
    crossed = ["--passes", "0", "--pitch", "0.05", "--cross", "--set", "task.footprint=0.0499"]
    assert main(["path", case(PLATE), *crossed]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "to 100.00 % of" in said
    assert "stripes" not in said


def test_crossing_needs_an_angle(case, capsys) -> None:
    assert main(["path", case(PLATE), "--passes", "1,0,0", "--pitch", "0.1", "--cross"]) == 2
    assert "--cross" in capsys.readouterr().err
