"""Arms of other kinds under the complete search: six and seven joints, free ones, a rail."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import networkx as nx
import numpy as np
import pytest
from arm_builds import bare, built, on_a_base
from dense_replay import assert_witness

from feasibility import Answer, CauseKind, Evidence, Task, check
from robots import Robot, load_robot
from surfaces import Surface, cylinder, hyperboloid, plane, sphere

ARMS = ("ur5", "panda", "kinova", "xarm7", "ur5 on a rail")
RAIL = (-1.0, 1.0)  # [m]


@cache
def arm(name: str) -> Robot:
    if name != "ur5 on a rail":
        return load_robot(name)
    ur5 = load_robot("ur5")
    with TemporaryDirectory() as folder:
        on_rail = on_a_base(bare(ur5.urdf), "prismatic", axis=(0, 1, 0), limits=RAIL)
        return built(on_rail, Path(folder), ur5)


def plate(low: float, high: float, half_length: float = 0.15) -> Surface:
    """A plate before the arm, to be worked on from above."""
    return plane(
        (low, high), (-half_length, half_length), side="outside", position=(0.0, 0.0, 0.25)
    )


PATCHES = {
    "plate": plate(0.3, 0.6),
    "wall": plane((-0.2, 0.2), (-0.2, 0.2), "outside", (0.55, 0.0, 0.45), (0.0, -90.0, 0.0)),
    "pipe": cylinder(0.2, (45, 135), (-0.1, 0.1), "outside", (0.45, 0.0, 0.1), (90.0, 0.0, 0.0)),
    "bowl": sphere(0.3, (100, 150), (-90, 90), "inside", (0.35, 0.0, 0.5)),
}


@pytest.mark.parametrize("patch", ["plate", "wall", "pipe", "bowl"])
@pytest.mark.parametrize("name", ARMS)
def test_a_patch_within_reach_is_feasible(name: str, patch: str) -> None:
    verdict = check(arm(name), PATCHES[patch].cells(4, 4), Task(standoff=0.02, cone_deg=40))
    assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert nx.is_connected(verdict.graph)
    assert_witness(verdict)


@pytest.mark.parametrize("name", ARMS)
def test_a_cell_out_of_reach_is_proved(name: str) -> None:
    """A plate that begins within reach; what lies beyond the arm's length is proved, cell by
    cell."""
    robot = arm(name)
    away = robot.reach + 0.2
    cells = plate(0.3, away).cells(6, 2)
    verdict = check(robot, cells, Task(standoff=0.02, cone_deg=40))
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    assert verdict.covered[:2].all()
    proved = {cause.cell for cause in verdict.causes if cause.proved}
    first = robot.model.jointPlacements[1].translation
    points = verdict.task.targets(cells).points
    beyond = np.flatnonzero(np.linalg.norm(points - first, axis=1) > robot.reach + 1e-3)
    assert len(beyond) > 0
    assert set(beyond.tolist()) <= proved
    kinds = {cause.cell: cause.kind for cause in verdict.causes}
    assert {kinds[int(k)] for k in beyond} == {CauseKind.OUT_OF_REACH}


def test_a_rail_reaches_where_the_arm_alone_does_not() -> None:
    """A plate of 2.4 m; the rail has to run, and the witness moves it."""
    cells = plate(0.3, 0.6, half_length=1.2).cells(2, 12)
    task = Task(standoff=0.02, cone_deg=30)
    verdict = check(arm("ur5 on a rail"), cells, task)
    assert verdict.feasible
    assert_witness(verdict)
    assert verdict.witness is not None
    assert np.ptp(verdict.witness.q[:, 0]) > 2.4 - 2 * arm("ur5").reach + 0.1
    alone = check(arm("ur5"), cells, task)
    assert (alone.answer, alone.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)


def test_a_rail_that_is_held_is_the_arm_alone() -> None:
    """Limits of no width at 0.25 m: what the arm alone does on a patch that is nearer by that."""
    held = arm("ur5 on a rail").with_limits({"test_joint": (0.25, 0.25)})
    task = Task(standoff=0.02, cone_deg=30)
    near = plane((0.3, 1.1), (-0.5, 0.5), "outside", (0.0, 0.0, 0.25))
    far = plane((0.3, 1.1), (-0.5, 0.5), "outside", (0.0, 0.25, 0.25))
    one, other = check(arm("ur5"), near.cells(5, 5), task), check(held, far.cells(5, 5), task)
    assert one.answer is other.answer is Answer.INFEASIBLE
    np.testing.assert_array_equal(one.covered, other.covered)


TURNS = {
    "plate": plane((0.3, 0.7), (-0.3, 0.3), "outside", (0.0, 0.0, 0.2)),
    "ring": cylinder(0.6, (-175, 175), (0.1, 0.3)),
    "behind": cylinder(0.55, (100, 260), (0.0, 0.4)),
    "dome": sphere(0.7, (30, 80), (-170, 170)),
    "flare": hyperboloid(0.45, 0.5, (-160, 120), (0.0, 0.4)),
    "tilted": plane((-0.4, 0.4), (-0.2, 0.2), "outside", (0.4, 0.3, 0.4), (50.0, -60.0, 20.0)),
    "too long": plane((0.3, 1.3), (-0.2, 0.2), "outside", (0.0, 0.0, 0.2)),
}


@pytest.mark.parametrize("cone_deg", [8, 30])
@pytest.mark.parametrize("name", TURNS)
def test_full_turns_cover_no_less_than_half_turns(name: str, cone_deg: float) -> None:
    """Limits of +-360 degrees: every component of +-180 is inside one, at a bounded cost."""
    ur5 = load_robot("ur5")
    half = ur5.with_limits(np.tile([-np.pi, np.pi], (6, 1)))
    cells, task = TURNS[name].cells(4, 8), Task(standoff=0.02, cone_deg=cone_deg)
    narrow, wide = check(half, cells, task), check(ur5, cells, task)
    assert narrow.feasible <= wide.feasible
    wider = [set(component.tolist()) for component in wide.components]
    assert any(set(narrow.components[0].tolist()) <= component for component in wider)
    assert wide.n_covered >= narrow.n_covered
    assert wide.statistics["fk"] <= 5 * narrow.statistics["fk"]
    if wide.feasible:
        assert_witness(wide)
