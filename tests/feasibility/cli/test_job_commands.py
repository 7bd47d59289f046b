"""`coverable path`, `divide` and `explain`: what they print, write and answer."""

from __future__ import annotations

import json

import numpy as np
import pytest

from feasibility.cases import Case, load_case
from feasibility.certification import replay
from feasibility.reports.path import at_least, at_most
from feasibility.results.trajectory_files import load_trajectory


def test_a_path_is_written_in_three_formats_that_replay(tmp_path, ask):
    """CSV and JSON, read back, are one motion over all cells that the replay accepts."""
    files = [tmp_path / f"run.{ending}" for ending in ("csv", "json", "yaml")]
    view = tmp_path / "run.html"
    outs = [part for file in files for part in ("--out", str(file))]
    few = "surface.cells=[4, 5]"
    asked = "path", "paper/4e", "--set", few, "--json", "--speed", "0.25", *outs
    status, out, err = ask(*asked, "--html", str(view))
    assert status == 0
    told = json.loads(out)
    assert told["verdict"] == "feasible"
    assert told["order"] == "rows"
    assert told["cells"] == 20
    assert told["revisited_share"] <= 0.15
    timing = told["trajectory"]
    assert timing["limits"]["tool_speed"] == 0.25
    for most in ("velocity", "acceleration"):
        found = timing[f"max_{most}"]
        assert found.keys() == timing["limits"][most].keys()
        assert all(found[j] <= timing["limits"][most][j] * (1 + 1e-9) for j in found)
    robot, cells, task, _ = load_case("paper/4e", [few]).build()
    assert files[2].read_text(encoding="utf-8").count("time_from_start") > 20
    for file in files[:2]:
        trajectory = load_trajectory(file)
        assert trajectory.tool_speed.max() <= 0.25 + 1e-9
        outcome = replay(robot, cells, task, trajectory.walk, np.ones(len(cells), dtype=bool))
        assert outcome.accepted, outcome.refusal
    assert all(file.name in err for file in files)
    assert "one path over" in view.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("settings", "status"), [([], 1), (["--set", "search.time_limit=1e-6"], 3)]
)
def test_a_path_of_what_is_not_feasible_is_refused_with_the_reason(settings, status, tmp_path, ask):
    """The verdict's own status, nothing on stdout, no files, and where to go from here."""
    files = [str(tmp_path / "run.csv"), str(tmp_path / "run.html")]
    outs = ["--out", files[0], "--html", files[1]]
    found, out, err = ask("path", "paper/4d", *settings, *outs)
    assert found == status
    assert out == ""
    assert "no path over this surface is known" in err
    assert "coverable explain" in err
    assert "--out: nothing written to" in err
    assert "--html: nothing written to" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["path", "divide", "explain"])
@pytest.mark.parametrize("case", ["infeasible", "undecided", "hopeless"])
def test_json_is_one_object_whatever_the_answer(command, case, ask):
    """Infeasible, out of time, and a surface that no cell of can be reached."""
    settings, status = {
        "infeasible": ([], 1),
        "undecided": (["--set", "search.time_limit=1e-6"], 3),
        "hopeless": (["--set", "surface.position=[9, 0, 0]"], 1),
    }[case]
    found, out, err = ask(command, "paper/4d", "--json", *settings)
    told = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert found == status
    assert "Traceback" not in err
    if command == "path":
        answer = "undecided" if case == "undecided" else "infeasible"
        assert told["verdict"] == answer
        assert (
            told["covered"] == {"infeasible": 60, "undecided": told["covered"], "hopeless": 0}[case]
        )
        assert told["trajectory"] is None
        assert told["message"] in err
        assert answer in told["message"]


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["path", "paper/4a", "--speed", "0"], "--speed: must be a finite number > 0"),
        (["path", "paper/4a", "--speed", "nan"], "--speed: must be a finite number > 0"),
        (["path", "paper/4a", "--order", "zigzag"], "zigzag"),
        (["path", "paper/4a", "--out", "run.txt"], "ends in .csv, .json or .yaml"),
        (["path", "paper/4a", "--out", "no/such/folder/run.csv"], "no/such/folder"),
        (["path", "paper/4a", "--set", "search.method=greedy"], "search.method"),
        (["divide", "paper/4a", "--set", "search.method=greedy"], "search.method"),
        (["explain", "paper/4a", "--set", "search.method=greedy"], "search.method"),
        (["divide", "paper/9z"], "neither a built-in case nor a file"),
        (["explain", "paper/4a", "--html", "no/such/folder/x.html"], "no/such/folder"),
    ],
)
def test_bad_input_is_one_message(argv, words, ask):
    """Status 2, nothing on stdout, no traceback."""
    status, out, err = ask(*argv)
    assert status == 2
    assert out == ""
    assert words in err
    assert "Traceback" not in err


MESH = """\
robot.name = "ur5"
task = { standoff = 0.02, cone_deg = 30 }
surface = { kind = "mesh", file = "part.stl", side = "outside", cells = 9 }
"""
PIECES = """\
robot.name = "ur5"
task = { standoff = 0.02, cone_deg = 30 }
[surface]
kind = "piecewise"
pieces = [{ kind = "plane", u = [0, 1], v = [0, 1], cells = [2, 3] }]
"""


@pytest.mark.parametrize("order", ["rows", "columns", "spiral"])
@pytest.mark.parametrize(("kind", "text"), [("mesh", MESH), ("piecewise", PIECES)])
def test_an_order_that_there_is_not_is_refused_before_any_work(
    kind, text, order, tmp_path, ask, monkeypatch
):
    """Nothing is built for it: neither the mesh's file nor the arm is looked at."""

    def build(self):
        raise AssertionError("the case was built")

    monkeypatch.setattr(Case, "build", build)
    (tmp_path / "case.toml").write_text(text)
    status, out, err = ask("path", str(tmp_path / "case.toml"), "--order", order)
    assert (status, out) == (2, "")
    assert f"'{order}'" in err
    assert kind in err
    assert "use order 'shortest'" in err


def test_a_division_is_drawn(tmp_path, ask):
    """Status 1 where cells are left out; the page names the patch and what is left."""
    view = tmp_path / "parts.html"
    status, out, _ = ask("divide", "paper/4d", "--html", str(view))
    assert status == 1
    assert "60 of 90 cells" in out
    page = view.read_text(encoding="utf-8")
    assert "patch 1 (60 cells)" in page
    assert "joint limits (30)" in page


def test_an_explanation_says_what_helps(tmp_path, ask):
    """4d: joint 1, in sentences, as JSON, and beside the picture."""
    view = tmp_path / "why.html"
    status, out, _ = ask("explain", "paper/4d", "--html", str(view))
    assert status == 1
    assert "robot.limits_deg.joint1 (upper) 41.7 deg" in out
    assert "robot.limits_deg.joint1 (upper) 41.7 deg" in view.read_text(encoding="utf-8")
    status, out, _ = ask("explain", "paper/4d", "--json")
    assert status == 1
    told = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert any("joint1" in json.dumps(threshold) for threshold in told["thresholds"])


@pytest.mark.parametrize("digits", [1, 3, 4])
def test_bounds_are_rounded_to_where_they_hold(digits):
    """A number that is copied from a sentence keeps what the sentence says."""
    rng = np.random.default_rng(1)
    for value in [
        *rng.normal(size=200) * 10.0 ** rng.integers(-6, 6, 200),
        0.0,
        1.0,
        99.999,
        180.0,
    ]:
        above, below = float(at_most(value, digits)), float(at_least(value, digits))
        assert below <= value <= above
        assert above - below <= 10.0 ** (1 - digits) * abs(value) * (1 + 1e-9)
        for text in (at_most(value, digits), at_least(value, digits)):
            assert len(text.split("e")[0].strip("-0.").replace(".", "")) <= digits
