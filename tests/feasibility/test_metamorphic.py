"""Questions with a known relation between their answers, drawn by Hypothesis."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from arm_builds import MIRROR, bare, built, mirrored, on_a_base, scaled
from dense_replay import assert_witness, tools
from hypothesis import given, settings
from hypothesis import strategies as st

from feasibility import CauseKind, Task, Verdict, check
from robots import Robot, load_robot
from surfaces import Surface, cylinder, hyperboloid, plane, rotation_from_rpy, sphere

FEW = settings(max_examples=6)
PUMA = load_robot("puma560", limits="set-1")


def between(low: float, high: float) -> st.SearchStrategy[float]:
    # Three decimals: a case can be read, and its limits do not fall on a rounding of the geometry.
    return st.floats(low, high).map(lambda value: round(value, 3))


class Question(NamedTuple):
    """One problem for the PUMA 560; lengths in m, angles in degrees."""

    kind: str
    size: tuple[float, ...]
    u: tuple[float, float]
    v: tuple[float, float]
    position: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]
    side: str
    cells: tuple[int, int]
    standoff: float
    cone_deg: float
    limits_deg: tuple[tuple[float, float], ...]

    def robot(self) -> Robot:
        return PUMA.with_limits(np.radians(self.limits_deg))

    def surface(self) -> Surface:
        make: Any = {
            "sphere": sphere, "cylinder": cylinder, "hyperboloid": hyperboloid, "plane": plane,
        }[self.kind]  # fmt: skip
        made: Surface = make(*self.size, self.u, self.v, self.side, self.position, self.rpy_deg)
        return made

    def task(self) -> Task:
        return Task(self.standoff, self.cone_deg)

    def verdict(self) -> Verdict:
        return check(self.robot(), self.surface().cells(*self.cells), self.task())


@st.composite
def questions(draw: st.DrawFn) -> Question:
    kind = draw(st.sampled_from(["sphere", "cylinder", "hyperboloid", "plane"]))
    start = draw(between(-180, 100))
    turn = (start, round(start + draw(between(20, 110)), 3))
    low = draw(between(-0.5, 0.3))
    run = (low, round(low + draw(between(0.15, 0.7)), 3))
    near = between(-0.4, 0.4)
    if kind == "sphere":
        polar = draw(between(15, 90))
        size: tuple[float, ...] = (draw(between(0.4, 1.1)),)
        u, v = (polar, round(polar + draw(between(15, 60)), 3)), turn
    elif kind == "plane":
        across = draw(between(-0.4, 0.2))
        size, u, v = (), (across, round(across + draw(between(0.15, 0.5)), 3)), run
        near = st.one_of(between(-0.8, -0.4), between(0.4, 0.8))
    else:
        size = (draw(between(0.3, 0.8)),)
        size = (*size, draw(between(0.4, 1.0))) if kind == "hyperboloid" else size
        u, v = turn, run
    limits = tuple((draw(between(-180, -70)), draw(between(70, 180))) for _ in range(6))
    return Question(
        kind=kind,
        size=size,
        u=u,
        v=v,
        position=(draw(near), draw(near), draw(between(-0.3, 0.5))),
        rpy_deg=(draw(between(-90, 90)), draw(between(-90, 90)), draw(between(-180, 180))),
        side=draw(st.sampled_from(["inside", "outside"])),
        cells=(draw(st.integers(3, 4)), draw(st.integers(3, 5))),
        standoff=draw(st.sampled_from([0.0, 0.01, 0.05])),
        cone_deg=draw(between(4, 60)),
        limits_deg=limits,
    )  # fmt: skip


def assert_alike(one: Verdict, other: Verdict, order: np.ndarray | None = None) -> None:
    """The same answer, for the same cells (other's cell order[k] is one's cell k)."""
    order = np.arange(len(one.cells)) if order is None else order
    assert one.answer is other.answer
    assert one.n_covered == other.n_covered
    # Two components may cover as many cells: the same sets have to be there.
    mine = {frozenset(component.tolist()) for component in one.components} or {frozenset()}
    assert frozenset(np.flatnonzero(other.covered[order]).tolist()) in mine
    proved = [{c.cell for c in verdict.causes if c.proved} for verdict in (one, other)]
    back = np.argsort(order)
    assert proved[0] == {int(back[k]) for k in proved[1]}
    if other.feasible:
        assert_witness(other)


def assert_no_less(narrow: Verdict, wide: Verdict) -> None:
    """Whatever the narrower question covers in one motion, the wider one does."""
    wider = [set(component.tolist()) for component in wide.components]
    for component in narrow.components[:1]:
        assert any(set(component.tolist()) <= other for other in wider)
    assert wide.n_covered >= narrow.n_covered
    assert narrow.feasible <= wide.feasible
    # A proof holds for all that is narrower. (A cell that a cut parts from the best motion is
    # proved too, but another motion covers it.)
    reached = {int(k) for component in narrow.components for k in component}
    lost = [cause for cause in wide.causes if cause.kind is not CauseKind.DISCONNECTED]
    assert not reached & {cause.cell for cause in lost if cause.proved}


@FEW
@given(questions(), st.tuples(*[between(-1, 1)] * 3), st.tuples(*[between(-180, 180)] * 3))
def test_moving_arm_and_surface_together_changes_nothing(
    question: Question, shift: tuple[float, ...], turn_deg: tuple[float, ...]
) -> None:
    rpy = [math.radians(angle) for angle in turn_deg]
    rotation = rotation_from_rpy(*rpy)
    arm = question.robot()
    with TemporaryDirectory() as folder:
        moved = built(on_a_base(bare(arm.urdf), "fixed", xyz=shift, rpy=rpy), Path(folder), arm)
    q = np.linspace(-1.0, 1.0, 6)[None]
    np.testing.assert_allclose(
        tools(moved, q)[0], tools(arm, q)[0] @ rotation.T + shift, atol=1e-12
    )
    surface = question.surface().moved(rotation, shift)
    other = check(moved, surface.cells(*question.cells), question.task())
    assert_alike(question.verdict(), other)


@FEW
@given(questions(), st.integers(0, 5), between(1, 90), st.booleans())
def test_a_wider_limit_loses_nothing(
    question: Question, joint: int, more_deg: float, upper: bool
) -> None:
    limits = [list(pair) for pair in question.limits_deg]
    limits[joint][upper] += more_deg if upper else -more_deg
    wide = question._replace(limits_deg=tuple((a, b) for a, b in limits))
    assert_no_less(question.verdict(), wide.verdict())


@FEW
@given(questions(), between(1.05, 3.0))
def test_a_wider_cone_loses_nothing(question: Question, factor: float) -> None:
    wide = question._replace(cone_deg=min(180.0, factor * question.cone_deg))
    assert_no_less(question.verdict(), wide.verdict())


@FEW
@given(questions())
def test_a_larger_tolerance_loses_nothing(question: Question) -> None:
    robot, cells = question.robot(), question.surface().cells(*question.cells)
    narrow = check(robot, cells, Task(question.standoff, question.cone_deg, 1e-3))
    wide = check(robot, cells, Task(question.standoff, question.cone_deg, 2e-3))
    assert_no_less(narrow, wide)


@FEW
@given(questions())
def test_finer_cells_lose_only_new_ones(question: Question) -> None:
    """Three times finer both ways: every centre is one of the finer centres."""
    (nu, nv), coarse = question.cells, question.verdict()
    fine = question._replace(cells=(3 * nu, 3 * nv)).verdict()
    old = np.arange(9 * nu * nv).reshape(3 * nu, 3 * nv)[1::3, 1::3].ravel()
    np.testing.assert_allclose(fine.cells.centres[old], coarse.cells.centres, atol=1e-12)
    component = set(coarse.components[0].tolist()) if coarse.components else set()
    kept = [set(np.flatnonzero(np.isin(old, c)).tolist()) for c in fine.components]
    assert not component or any(component <= cells for cells in kept)
    proved = {cause.cell for cause in fine.causes if cause.proved}
    assert not proved & {int(old[k]) for k in component}


@FEW
@given(questions())
def test_a_mirror_changes_nothing(question: Question) -> None:
    arm = question.robot()
    with TemporaryDirectory() as folder:
        other = built(mirrored(bare(arm.urdf)), Path(folder), arm)
    q = np.linspace(-1.0, 1.0, 6)[None]
    for one, image in zip(tools(arm, q), tools(other, q), strict=True):
        np.testing.assert_allclose(image, one @ MIRROR, atol=1e-12)
    # The mirrored surface: its own frame is mirrored too, and in it y runs the other way.
    (nu, nv), (roll, pitch, yaw) = question.cells, question.rpy_deg
    x, y, z = question.position
    image = question._replace(position=(x, -y, z), rpy_deg=(-roll, pitch, -yaw))
    order = np.arange(nu * nv).reshape(nu, nv)
    if question.kind in ("sphere", "plane"):
        image = image._replace(v=(-question.v[1], -question.v[0]))
        order = order[:, ::-1]
    else:
        image = image._replace(u=(-question.u[1], -question.u[0]))
        order = order[::-1]
    cells = image.surface().cells(nu, nv)
    centres = question.surface().cells(nu, nv).centres
    np.testing.assert_allclose(cells.centres[order.ravel()], centres @ MIRROR, atol=1e-12)
    assert_alike(question.verdict(), check(other, cells, question.task()), order.ravel())


@FEW
@given(questions(), st.sampled_from([0.1, 0.5, 3.0, 20.0]))
def test_a_larger_world_is_no_other(question: Question, factor: float) -> None:
    arm = question.robot()
    with TemporaryDirectory() as folder:
        other = built(scaled(bare(arm.urdf), factor), Path(folder), arm)
    lengths = {"position": question.position, "size": question.size}
    if question.kind == "plane":
        lengths["u"] = question.u
    if question.kind != "sphere":
        lengths["v"] = question.v
    grown = question._replace(
        **{name: tuple(factor * length for length in value) for name, value in lengths.items()}
    )
    task = Task(factor * question.standoff, question.cone_deg, factor * 1e-3)
    verdict = check(other, grown.surface().cells(*question.cells), task)
    assert_alike(question.verdict(), verdict)
