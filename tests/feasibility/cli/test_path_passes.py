"""`coverable path --passes`: parallel passes, run in one certified motion."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from small_cases import PANEL

from coverable_errors import CoverableError
from feasibility import Task, check, verify
from feasibility.cli.main import main
from feasibility.collisions import Collision
from robots import Kinematics, load_robot
from surfaces import cylinder, plane, poses
from surfaces.passes import parallel_passes, pass_route, pass_toolpath
from surfaces.toolpaths import PoseCells

UR5 = load_robot("ur5")
TASK = Task(standoff=0.02, cone_deg=20)
PLATE = plane((0.0, 0.2), (0.0, 0.2), "outside", (0.4, -0.1, 0.2))
ARCH = cylinder(0.3, (60, 120), (0.0, 0.2), "outside", (0.45, -0.1, 0.0), (-90, 0, 0))


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "panel.toml"
    path.write_text(PANEL)
    return str(path)


def test_the_command(case, tmp_path, capsys):
    out = tmp_path / "run.csv"
    assert (
        main(["path", case, "--passes", "0", "--pitch", "0.05", "--json", "--out", str(out)]) == 0
    )
    found = json.loads(capsys.readouterr().out)
    laid = found["passes"]
    assert (found["verdict"], found["order"], laid["count"]) == ("feasible", "given", 4)
    assert laid["spacing_m"] == pytest.approx(0.05)
    assert laid["length_m"] == pytest.approx(0.8, rel=1e-3)
    assert found["length_m"] == pytest.approx(0.8 + 3 * 0.05, rel=1e-2)
    assert len(out.read_text().splitlines()) > 100
    assert main(["path", case, "--passes", "0,1,0", "--pitch", "0.07", "--one-way"]) == 0
    assert "along 3 passes" in capsys.readouterr().out


@pytest.mark.parametrize(("surface", "direction"), [(PLATE, 0.0), (ARCH, 0.0), (ARCH, np.pi / 2)])
def test_the_motion_keeps_to_the_passes(surface, direction):
    """Looked at by Pinocchio at twenty places of each segment, against the surface itself."""
    laid = parallel_passes(surface, 0.04, direction, step=0.01)
    cells = pass_toolpath(laid)
    verdict = check(UR5, cells, TASK)
    assert verdict.feasible
    q = verdict.witness.q
    share = np.linspace(0.0, 1.0, 21)[:, None, None]
    dense = (q[None, :-1] + share * np.diff(q, axis=0)[None]).transpose(1, 0, 2).reshape(-1, UR5.n)
    points, axes = Kinematics(UR5).tools(dense)
    at = surface.closest(points)
    chord_sag = 0.01**2 / (8 * 0.3)
    assert np.abs(at.height - 0.02).max() <= 1e-3 + chord_sag  # beside one another, so never lifted
    assert (-(axes * at.normal).sum(axis=1)).min() >= np.cos(np.radians(20.0)) - 1e-3
    targets = cells.centres + 0.02 * cells.normals
    away = np.linalg.norm(targets[:, None] - points[None, ::7], axis=2).min(axis=1)
    assert away.max() <= 5e-3
    assert verify(UR5, cells, TASK, q).holds


def test_between_stretches_that_are_apart_the_tool_is_lifted():
    laid = parallel_passes(plane((0.0, 0.2), (0.0, 0.2), "outside"), 0.1, one_way=True)
    cells = pass_toolpath(laid, retract=0.03)
    assert np.ptp(cells.centres[:, 2]) == pytest.approx(0.03)
    assert (cells.centres[:, 2] > 0.02).sum() == 2
    hill = cylinder(0.3, (30, 150), (0.0, 0.2), "outside")
    with pytest.raises(CoverableError, match="run through the surface"):
        pass_toolpath(parallel_passes(hill, 0.1, 0.0, one_way=True), retract=0.01)


def test_the_surface_under_the_passes_is_no_less_a_wall():
    laid = parallel_passes(plane((0.0, 0.1), (0.0, 0.1), "outside", (0.45, 0.0, 0.2)), 0.05)
    cells = pass_toolpath(laid)
    assert cells.surface.wall is laid.surface
    moved = cells.surface.moved(np.eye(3), (0.0, 0.0, 0.1))
    assert moved.wall.position.tolist() == pytest.approx([0.45, 0.0, 0.3])
    clear = Task(standoff=0.03, cone_deg=5, collision=Collision(self_=False, clearance=0.005))
    verdict = check(UR5, cells, clear)
    assert verdict.feasible
    assert "surface" in verdict.certificate.nearest_pair
    assert 0.005 <= verdict.certificate.min_clearance <= 0.031


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--passes", "0"], "--pitch"),
        (["--pitch", "0.05"], "--passes"),
        (["--passes", "0", "--pitch", "0.05", "--order", "rows"], "--order"),
        (["--passes", "north", "--pitch", "0.05"], "degrees, or an axis"),
        (["--passes", "0,0,1", "--pitch", "0.05"], "along the surface's normal"),
        (["--passes", "0", "--pitch", "1e-6"], "triangles"),
    ],
)
def test_bad_arguments_are_named(case, arguments, said, capsys):
    assert main(["path", case, *arguments]) == 2
    err = capsys.readouterr().err
    assert said in " ".join(err.split())
    assert "Traceback" not in err


def test_passes_too_fast_for_the_joints_are_left_out_with_the_joint(case, capsys):
    asked = ["--passes", "0", "--pitch", "0.1", "--set", "task.speed=6"]
    assert main(["path", case, *asked]) == 3
    out = " ".join(capsys.readouterr().out.split())
    assert "none was found that does so at 6 m/s" in out
    assert "no part of them can be run" in out
    assert "along stretch 1: " in out
    assert "rad/s; it allows 3.15" in out


DUG_IN = """
[robot]
name = "ur5"
[surface]
kind = "cylinder"
radius = 0.15
u_deg = [50, 130]
v = [0.0, 0.3]
position = [0.5, 0.15, 0.0]
rpy_deg = [90, 0, 0]
side = "outside"
cells = [4, 4]
[task]
standoff = 0.0
cone_deg = 30
tolerance = 0.0005
"""


@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "pipe.toml"
    path.write_text(DUG_IN)
    return str(path)


@pytest.mark.parametrize(
    "more", [[], ["--overrun", "0.02"], ["--one-way"], ["--approach", "0.03"]], ids=str
)
def test_verify_accepts_what_path_has_certified(pipe, tmp_path, capsys, more):
    """Between the passes it once went 2.3 mm into the part."""
    out, laid = tmp_path / "run.csv", ["--passes", "90", "--pitch", "0.06"]
    assert main(["path", pipe, *laid, *more, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert ("the tool is lifted 3 times" in said) == ("--one-way" in more)
    assert ("beyond the border by up to 20 mm" in " ".join(said.split())) == ("--overrun" in more)
    assert main(["verify", pipe, str(out), *laid]) == 0
    assert "places along them reached" in capsys.readouterr().out
    assert main(["verify", pipe, str(out), "--passes", "0", "--pitch", "0.06"]) == 1
    if more:
        text = out.read_text().splitlines()
        assert text[1].endswith(",working")
        out.write_text("\n".join([text[1], *(f"{row[:-1]}1" for row in text[2:])]))
        assert main(["verify", pipe, str(out), *laid]) == 1
        assert "off its surface" in capsys.readouterr().out


def test_a_way_through_the_part_is_refused():
    """Straight from pass to pass, as poses alone would have it, and lifted through the part."""
    part = cylinder(0.15, (50, 130), (0.0, 0.3), "outside", (0.5, 0.15, 0.0), (90, 0, 0))
    task = Task(0.0, 30, 5e-4)
    route = pass_route(parallel_passes(part, 0.06, np.pi / 2))
    kept = route.places.stretch >= 0
    cut = poses(route.places.points[kept], route.places.normals[kept])
    verdict = check(UR5, cut, task)
    assert verdict.feasible  # there is no surface that anybody knows of
    q, on = verdict.witness.q, np.ones(kept.sum(), dtype=bool)
    over = PoseCells.of(replace(cut.surface, under=part, working=on))
    assert "off its surface" in verify(UR5, over, task, q).refusal
    lifted = on.copy()
    ends = np.flatnonzero(np.diff(route.places.stretch[kept]))
    lifted[[*ends, *(ends + 1)]] = False
    through = PoseCells.of(replace(cut.surface, under=part, working=lifted))
    assert "goes through the surface where it is lifted" in verify(UR5, through, task, q).refusal
    assert not check(UR5, over, task).feasible
