"""`coverable path --passes`: parallel passes, run in one certified motion, or in a few."""

import json
from dataclasses import replace

import numpy as np
import pytest

import coverable
from coverable import Collision, Task, check, cylinder, parallel_passes, pass_toolpath, verify
from coverable.errors import CoverableError
from feasibility.cli.main import main
from surfaces.passes.toolpath import pass_route
from surfaces.toolpaths.pose_cells import PoseCells

UR5 = coverable.load_robot("ur5")
PANEL = """
robot.name = "ur5"
surface = {{ kind = "plane", u = [0.0, {wide}], v = [0.0, 0.2], cells = [2, 2], \
position = [0.4, -0.1, 0.2], side = "outside" }}
task.standoff = 0.02
task.cone_deg = 20
"""
CASES = {
    "panel": PANEL.format(wide=0.2),
    "plate": PANEL.format(wide=0.3) + "task.footprint = 0.1\ntask.coverage = 0.9\n",
    "pipe": """
        robot.name = "ur5"
        surface = { kind = "cylinder", radius = 0.15, u_deg = [50, 130], v = [0.08, 0.22],
            position = [0.5, 0.15, 0.0], rpy_deg = [90, 0, 0], side = "outside", cells = [4, 4] }
        task = { standoff = 0.0, cone_deg = 30, tolerance = 0.0005, footprint = 0.01 }
    """.replace("\n            ", " "),
    "round": """
        robot.name = "ur5"
        robot.limits_deg = { shoulder_pan_joint = [-110, 110], wrist_2_joint = [-100, 100] }
        surface = { kind = "cylinder", radius = 0.3, u_deg = [-130, 0], v = [0.0, 0.1],
            position = [0.0, 0.0, 0.25], side = "outside", cells = [2, 2] }
        task = { standoff = 0.12, cone_deg = 20, footprint = 0.1 }
    """.replace("\n            ", " "),
}


@pytest.fixture
def path(tmp_path, capsys):
    """path(case, ...) -> status, stdout in one line or as JSON, stderr in one line."""

    def asked(name, *arguments, command="path"):
        file = tmp_path / f"{name}.toml"
        file.write_text(CASES[name])
        status = main([command, str(file), *map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        found = json.loads(out) if "--json" in arguments else " ".join(out.split())
        return status, found, " ".join(err.split())

    return asked


def test_between_stretches_that_are_apart_the_tool_is_lifted():
    laid = parallel_passes(coverable.plane((0.0, 0.2), (0.0, 0.2), "outside"), 0.1, one_way=True)
    cells = pass_toolpath(laid, retract=0.03)
    assert np.ptp(cells.centres[:, 2]) == pytest.approx(0.03)
    assert (cells.centres[:, 2] > 0.02).sum() == 2
    hollow = cylinder(0.3, (0, 60), (0.0, 0.2), "inside")
    cells = pass_toolpath(parallel_passes(hollow, 0.1, 0.0, one_way=True), retract=0.03)
    radius = np.hypot(*cells.centres[:, :2].T)
    assert (radius.min(), radius.max()) == pytest.approx((0.27, 0.3), abs=1e-6)
    hill = cylinder(0.3, (30, 150), (0.0, 0.2), "outside")
    with pytest.raises(CoverableError, match="run through the surface"):
        pass_toolpath(parallel_passes(hill, 0.1, 0.0, one_way=True), retract=0.01)


def test_the_surface_under_the_passes_is_no_less_a_wall():
    plate = coverable.plane((0.0, 0.1), (0.0, 0.1), "outside", (0.45, 0.0, 0.2))
    cells = pass_toolpath(parallel_passes(plate, 0.1))
    assert cells.surface.wall is plate
    moved = cells.surface.moved(np.eye(3), (0.0, 0.0, 0.1))
    assert moved.wall.position.tolist() == pytest.approx([0.45, 0.0, 0.3])
    clear = Task(standoff=0.03, cone_deg=5, collision=Collision(self_=False, clearance=0.005))
    verdict = check(UR5, cells, clear)
    assert verdict.feasible
    assert "surface" in verdict.certificate.nearest_pair
    assert 0.005 <= verdict.certificate.min_clearance <= 0.031


@pytest.mark.parametrize("more", [[], ["--overrun", "0.02"], ["--one-way"], ["--approach", "0.03"]])
def test_verify_accepts_what_path_has_certified(path, tmp_path, more):
    """Between the passes it once went 2.3 mm into the part."""
    out, laid = tmp_path / "run.csv", ["--passes", "90", "--pitch", "0.06"]
    status, said, _ = path("pipe", *laid, *more, "--out", out)
    assert (status, "treated 21.1" in said) == (0, more in ([], ["--approach", "0.03"]))
    assert ("the tool is lifted 3 times" in said) == ("--one-way" in more)
    assert ("beyond the border by up to 20 mm" in said) == ("--overrun" in more)
    status, said, _ = path("pipe", out, *laid, command="verify")
    assert (status, "places along them reached" in said) == (0, True)
    assert path("pipe", out, "--passes", "0", "--pitch", "0.06", command="verify")[0] == 1
    if more:
        text = out.read_text().splitlines()
        assert text[1].endswith(",working")
        out.write_text("\n".join([text[1], *(f"{row[:-1]}1" for row in text[2:])]))
        status, said, _ = path("pipe", out, *laid, command="verify")
        assert (status, "off its surface" in said) == (1, True)


def test_a_way_through_the_part_is_refused():
    """Straight from pass to pass, as poses alone would have it, and lifted through the part."""
    part = cylinder(0.15, (50, 130), (0.0, 0.3), "outside", (0.5, 0.15, 0.0), (90, 0, 0))
    task = Task(0.0, 30, 5e-4)
    route = pass_route(parallel_passes(part, 0.06, np.pi / 2))
    kept = route.places.stretch >= 0
    cut = coverable.poses(route.places.points[kept], route.places.normals[kept])
    verdict = check(UR5, cut, task)
    assert verdict.feasible  # there is no surface that anybody knows of
    q, on = verdict.witness.q, np.ones(kept.sum(), dtype=bool)
    over = PoseCells.of(replace(cut.surface, under=part, working=on))
    assert "off its surface" in verify(UR5, over, task, q).refusal
    ends = np.flatnonzero(np.diff(route.places.stretch[kept]))
    for some in ([*ends, *(ends + 1)], ends + 1):  # and where it is lifted on the way alone
        working = np.isin(np.arange(len(on)), some, invert=True)
        through = PoseCells.of(replace(cut.surface, under=part, working=working))
        said = verify(UR5, through, task, q).refusal
        assert "goes through the surface where it is lifted" in said
    assert not check(UR5, over, task).feasible


def test_passes_are_cut_where_they_cannot_be_run(path, tmp_path):
    switch = ("--program", tmp_path / "run.script", "--on", "ON", "--off", "OFF", "--json")
    asked = ("--passes", "0", "--pitch", "0.2", "--out", tmp_path / "run.csv")
    status, found, _ = path("round", *asked, *switch)
    runs, cuts = found["runs"], found["cuts"]
    assert (status, found["verdict"]) == (1, "infeasible")
    assert len(runs) == len(cuts) + 1 > 1
    assert (found["left_out_m"], found["refused"]) == (0.0, [])
    assert all("limit" in cut["cause"] for cut in cuts)
    assert {stretch for run in runs for stretch in run["stretches"]} == {1}
    for cut, before, after in zip(cuts, runs, runs[1:], strict=False):
        assert before["poses"][1] == cut["poses"][0] <= cut["poses"][1] == after["poses"][0]
        assert len(cut["waypoints"][0]) == len(cut["joints"]) == 6
    names = [f"run_{k + 1}" for k in range(len(runs))]
    assert sorted(file.stem for file in tmp_path.glob("run_*.csv")) == names
    for name in names:
        lines = (tmp_path / f"{name}.script").read_text().split()
        assert lines.count("ON") == lines.count("OFF") == 1
    assert found["treated"]["lower"] > 0.97


def test_the_best_direction_has_the_fewest_passes(path, tmp_path):
    html, asked = tmp_path / "view.html", ("--pitch", "0.1", "--json", "--passes")
    status, found, _ = path("plate", *asked, "best", "--html", html)
    assert (status, found["passes"]["count"]) == (0, 2)
    assert found["treated"]["lower"] >= 0.99
    page = html.read_text()
    assert all(name in page for name in ("2 passes in one motion", "numbers", "treated once"))
    status, found, _ = path("plate", *asked, "0", "--cross")
    assert (status, found["passes"]["count"]) == (0, 2 + 3)
