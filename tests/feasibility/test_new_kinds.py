"""Verdicts over cones, ellipsoids, tori, turned profiles, splines, and surfaces in pieces."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from dense_replay import dense, tools
from mesh_patches import of_patch
from paper_cases import PAPER_CASES
from spline_nets import hood

from feasibility import Answer, Evidence, Search, Task, Verdict, check
from robots import load_robot
from surfaces import (
    Cells,
    Patch,
    Surface,
    bspline,
    cone,
    cylinder,
    ellipsoid,
    piecewise,
    plane,
    revolution,
    rotation_from_rpy,
    sphere,
    torus,
)
from surfaces.meshes import TriangleMesh, mesh

HOOD = 0.5 * hood()
SPRAY = Task(standoff=0.01, cone_deg=30)


def held(verdict: Verdict, points: int = 20) -> None:
    """The witness between its waypoints too, by Pinocchio and the surface's nearest places.

    Every tool point is at the standoff from the surface within the tolerance, on its working side,
    the axis inside the cone about the normal there; marked waypoints are over their cells' centres;
    limits hold, and every cell is visited.
    """
    walk, cells, task, robot = verdict.witness, verdict.cells, verdict.task, verdict.robot
    assert walk is not None
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    q = dense(walk.q, points)
    assert (q >= robot.lower - 1e-12).all()
    assert (q <= robot.upper + 1e-12).all()
    tips, axes = tools(robot, q)
    surface = cells.surface
    sign = surface.side_sign
    closest_point = surface.closest(tips)
    assert closest_point.inside.all()
    assert np.abs(closest_point.height - sign * task.standoff).max() <= tolerance + 1e-9
    cosine = -sign * (axes * closest_point.normal).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() <= task.cone_deg + 1e-6
    marked = walk.cell >= 0
    assert set(walk.cell[marked].tolist()) == set(range(len(cells)))
    over = walk.cell[marked]
    aims = cells.centres[over] + sign * task.standoff * cells.normals[over]
    assert np.linalg.norm(tips[::points][marked] - aims, axis=1).max() <= tolerance + 1e-9


def said(verdict: Verdict) -> tuple[Answer, Evidence, int]:
    return verdict.answer, verdict.evidence, verdict.n_covered


@pytest.mark.parametrize("name", ["4a", "4b", "4c", "4d", "5a", "5c"])
def test_special_cases_of_new_kinds_answer_like_the_old_kinds(name: str) -> None:
    """A ball is an ellipsoid, a cylinder a cone without slope; the twelve cases know the truth."""
    case = PAPER_CASES[name]
    one = case.cells()
    new = (
        ellipsoid((1.0, 1.0, 1.0), (10, 90), (10, 180), position=case.position)
        if case.surface == "sphere"
        else cone(0.5, 0.0, (-60, 60), (0.0, 0.9), position=case.position)
    ).cells(9, 10)
    assert (one.pairs == new.pairs).all()
    assert one.centres == pytest.approx(new.centres, abs=1e-12)
    old, other = (check(case.robot(), cells, case.task()) for cells in (one, new))
    assert said(old) == said(other)
    assert (old.covered == other.covered).all()
    if other.feasible:
        held(other)


def place(*position: float) -> dict[str, object]:
    return {"side": "outside", "position": position}


FEASIBLE = {
    "torus": torus(0.25, 0.1, (20, 130), (-60, 60), **place(0.45, 0, 0.2)).cells(5, 6),
    "bowl": revolution(
        [(0.0, 0.15), (0.1, 0.13), (0.2, 0.05), (0.22, 0.0)], (0, 360), **place(0.5, 0, 0.2)
    ).cells(4, 8),
    "hood": bspline(HOOD, **place(0.45, 0, 0.1)).cells(8, 8),
    "egg": ellipsoid((0.2, 0.15, 0.25), (0, 80), (0, 360), **place(0.5, 0, 0.1)).cells(4, 8),
    "funnel": cone(0.1, 0.5, (100, 260), (0, 0.2), **place(0.6, 0, 0.2)).cells(5, 4),
    "dome of halves": piecewise(
        [sphere(0.2, (0, 80), ends) for ends in ((0, 180), (180, 360))], **place(0.5, 0, 0.2)
    ).cells((4, 5)),
    "bead": piecewise(
        [
            cylinder(0.15, (0, 180), (-0.3, 0.0), rpy_deg=(90, 0, 0)),
            plane((-0.2, 0.0), (0.0, 0.3), rpy_deg=(0, -90, 0), position=(-0.15, 0, 0.0)),
        ],
        **place(0.5, 0, 0.3),
    ).cells([(4, 3), (2, 3)]),
}


@pytest.mark.parametrize("name", FEASIBLE)
def test_a_feasible_patch_of_each_kind_has_a_motion_that_holds(name: str) -> None:
    assert FEASIBLE[name].surface.notes == ()
    verdict = check(load_robot("ur5"), FEASIBLE[name], Task(standoff=0.01, cone_deg=60))
    assert verdict.feasible
    held(verdict)


def meshed(patch: Patch, pieces: int = 100, **pose: object) -> Surface:
    return mesh(TriangleMesh(*of_patch(patch, pieces, pieces)), **pose)


@cache
def hoods(position: tuple[float, float, float]) -> tuple[Cells, ...]:
    """The hood as one spline, as two with a seam, and as a mesh; cells of one size."""
    pose = place(*position)
    halves = piecewise([bspline(HOOD, u=(0, 0.45)), bspline(HOOD, u=(0.45, 1))], **pose)
    assert halves.notes == ()
    return (
        bspline(HOOD, **pose).cells(9, 10),
        halves.cells([(4, 10), (5, 10)]),
        meshed(bspline(HOOD), **pose).cells(count=90),
    )


HOOD_CASES = [
    ("ur5", (0.45, 0.0, 0.1), True),
    ("panda", (0.6, 0.3, 0.2), False),
]


@pytest.mark.parametrize(("robot", "position", "feasible"), HOOD_CASES)
def test_a_hood_as_spline_pieces_and_mesh_gets_one_answer(
    robot: str, position: tuple[float, float, float], feasible: bool
) -> None:
    """Verdict, evidence, and the covered area within 2 % of the whole."""
    verdicts = [check(load_robot(robot), cells, SPRAY) for cells in hoods(position)]
    shares = []
    for verdict in verdicts:
        assert verdict.feasible == feasible
        assert verdict.evidence == verdicts[0].evidence
        areas = verdict.cells.areas
        assert areas.sum() == pytest.approx(verdicts[0].cells.areas.sum(), rel=1e-3)
        shares.append(areas[verdict.covered].sum() / areas.sum())
        if feasible:
            held(verdict, points=5)
    assert max(shares) - min(shares) <= 0.02
    assert (min(shares) == 1.0) == feasible


@pytest.mark.parametrize("limits", ["set-1", "set-2"])
def test_a_sphere_of_two_halves_answers_like_the_sphere(limits: str) -> None:
    """Cut along a meridian between columns: the same cells, verdict and coverage."""
    robot = load_robot("puma560", limits=limits)
    whole = sphere(1.0, (10, 90), (10, 180)).cells(9, 10)
    halves = piecewise([sphere(1.0, (10, 90), ends) for ends in ((10, 95), (95, 180))])
    cells = halves.cells((9, 5))
    task = Task(standoff=0.005, cone_deg=45)
    one, other = check(robot, whole, task), check(robot, cells, task)
    assert said(one) == said(other)
    assert one.n_edges == other.n_edges
    if other.feasible:
        held(other)


@pytest.mark.parametrize("angle", [-90.0, 30.0])
def test_a_sharp_crease_is_undecided_and_said(angle: float) -> None:
    """Each plate alone is covered; no motion goes from one to the other."""
    plates = [
        plane((0.0, 0.2), (0.0, 0.2)),
        plane((-0.2, 0.0), (0.0, 0.2), rpy_deg=(0, angle, 0)),
    ]
    cells = piecewise(plates, **place(0.45, -0.1, 0.3)).cells((2, 3))
    verdict = check(load_robot("ur5"), cells, SPRAY)
    assert verdict.answer is Answer.UNDECIDED
    assert "creased" in verdict.message
    assert verdict.n_covered == 6
    pieces = {cells.unravel(int(k))[0] for k in np.flatnonzero(verdict.covered)}
    assert len(pieces) == 1
    assert verdict.witness is None
    assert verdict.statistics["fk"] < 300_000  # finer cells and more rounds would be in vain


def test_a_faint_crease_is_crossed_within_tolerance_and_cone() -> None:
    plates = [plane((0.0, 0.2), (0.0, 0.2)), plane((-0.2, 0.0), (0.0, 0.2), rpy_deg=(0, 3, 0))]
    cells = piecewise(plates, **place(0.45, -0.1, 0.3)).cells((3, 4))
    verdict = check(load_robot("ur5"), cells, SPRAY)
    assert verdict.feasible
    held(verdict)


def test_pieces_that_touch_nowhere_cannot_be_covered_in_one_motion() -> None:
    plates = [plane((0, 0.1), (0, 0.2)), plane((0.15, 0.25), (0, 0.2))]
    surface = piecewise(plates, **place(0.45, -0.1, 0.3))
    verdict = check(load_robot("ur5"), surface.cells((1, 2)), SPRAY)
    assert not verdict.feasible
    assert verdict.n_covered == 2
    assert "touch nowhere" in surface.notes[0]
    assert verdict.statistics["fk"] < 300_000


@pytest.mark.parametrize("name", ["torus", "dome of halves"])
def test_a_rigid_motion_of_arm_and_patch_changes_nothing(name: str) -> None:
    """About the axis of the first joint, whose limits go along."""
    cells = FEASIBLE[name]
    robot = load_robot("ur5")
    turn = rotation_from_rpy(0.0, 0.0, math.radians(37.0))
    moved = cells.surface.moved(turn, np.zeros(3))
    there = moved.cells(*cells.shape) if name == "torus" else moved.cells(cells.counts)
    limits = np.column_stack([robot.lower, robot.upper])
    limits[0] += math.radians(37.0)
    task = Task(standoff=0.01, cone_deg=60)
    one, other = check(robot, cells, task), check(robot.with_limits(limits), there, task)
    assert said(one) == said(other)
    held(other)
    # The motion found here, turned, is one there.
    from feasibility.certification import replay

    walk = one.witness
    assert walk is not None
    along = walk.q.copy()
    along[:, 0] += math.radians(37.0)
    again = replay(
        robot.with_limits(limits),
        there,
        task,
        type(walk)(along, walk.cell),
        np.ones(len(there), bool),
    )
    assert again.accepted


def test_the_same_question_twice_has_one_motion() -> None:
    cells = FEASIBLE["dome of halves"]
    task = Task(standoff=0.01, cone_deg=60)
    one, other = (check(load_robot("ur5"), cells, task, Search(seed=3)) for _ in range(2))
    assert one.witness is not None
    assert other.witness is not None
    assert (one.witness.q == other.witness.q).all()
