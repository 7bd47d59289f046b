"""Bounds between rows hold where they are sampled, and less would be wrong; margins are exact."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arm_urdfs import joint
from random_arms import between, finite_limits, random_arm, robot_of

from feasibility import Task
from feasibility.certification.cells_reached import at_targets
from feasibility.certification.jacobians import jacobians, placements
from feasibility.certification.lever_bounds import (
    largest_levers,
    levers_along,
    longest_levers,
    peaks,
    second_derivatives,
    stretched_length,
)
from feasibility.certification.order import order_of_marks, order_of_places
from feasibility.certification.refusals import exact_faults
from feasibility.certification.stretches import Judge
from feasibility.certification.surface_replay import less_deviations
from feasibility.task import Targets
from feasibility.verdict import Walk
from robots import Kinematics
from surfaces import cylinder, mesh, plane
from surfaces.meshes import TriangleMesh
from surfaces.places import offset_surface

S = np.linspace(0.0, 1.0, 401)


def test_peaks_are_the_largest_values_of_parabolas():
    rng = np.random.default_rng(0)
    a, b, most = rng.random((3, 2000, 1)) * [[[1.0]], [[1.0]], [[20.0]]]
    truth = ((1.0 - S) * a + S * b + S * (1.0 - S) * most / 2.0).max(axis=1)
    found = peaks(a[:, 0], b[:, 0], most[:, 0])
    assert (found >= truth - 1e-15).all()
    assert found == pytest.approx(truth, abs=1e-4)
    assert np.isnan(peaks(*np.array([[np.nan, 1.0], [1.0, np.nan], [1.0, 1.0]]))).all()


@pytest.mark.parametrize("turn", [0.01, 0.3, 1.5, 3.0])
def test_levers_grow_as_joints_behind_turn(turn):
    """An elbow of two links of 1 m: its lever is |1 + exp(i q)|, least where it is folded."""
    elbow = robot_of([joint(1), joint(2, xyz=(1, 0, 0)), joint(3, "fixed", (1, 0, 0))])
    slides, kinematics = elbow.prismatic, Kinematics(elbow)
    half = np.array([[0.0, turn]])
    for middle in (0.0, 1.0, np.pi):
        at = jacobians(kinematics, np.array([[0.0, middle]]))
        truth = np.abs(1.0 + np.exp(1j * (middle + turn * (2.0 * S - 1.0)))).max()
        in_box = largest_levers(at.levers, half, slides, np.inf)[0, 0]
        ends = [np.array([[0.0, middle + way * turn]]) for way in (-1.0, 1.0)]
        levers = [jacobians(kinematics, q).levers for q in ends]
        along = levers_along(2.0 * half, slides, *levers, np.inf)[0, 0]
        assert min(in_box, along) >= truth - 1e-9
        assert truth > 1.9 or max(in_box, along) < 1.2 * truth + turn


@pytest.mark.parametrize("seed", range(20))
def test_levers_and_bends_hold_along_random_segments(seed):
    rng = np.random.default_rng(seed)
    robot = random_arm(rng)
    low, high = finite_limits(robot)
    start = rng.uniform(low, high)
    end = np.clip(start + rng.normal(size=robot.n) * 10.0 ** rng.uniform(-3, 0), low, high)
    _, q = between(start, end, 400)
    at = jacobians(Kinematics(robot), q)
    steps = np.abs(end - start)[None]
    for truth, path, cap in ((at.levers, at.points, np.inf), (at.sines, at.axes, 1.0)):
        along = levers_along(steps, robot.prismatic, truth[:1], truth[-1:], cap)
        turns = ~robot.prismatic
        assert (truth[:, turns] <= along[0, turns] * (1.0 + 1e-9) + 1e-12).all()
        bent = second_derivatives(steps, robot.prismatic, truth[[0, -1]], cap)[0]
        seen = np.linalg.norm(np.diff(path, n=2, axis=0), axis=1).max() * 400.0**2
        assert seen <= bent * (1.0 + 1e-3) + 1e-8


def test_joints_that_do_not_run_evenly_bend_the_way_by_that_as_well():
    """On a circle |p''|^2 = r^2 (q'^4 + q''^2)."""
    rate, own, levers = np.array([[0.7]]), np.array([[2.0]]), np.full((2, 1), 0.4)
    found = second_derivatives(rate, np.array([False]), levers, np.inf, own)[0]
    assert 0.4 * np.hypot(0.7**2, 2.0) <= found <= 0.4 * (0.7**2 + 2.0) + 1e-12


def test_slides_behind_a_joint_lengthen_its_lever_by_their_further_end():
    robot = robot_of(
        [joint(1), joint(2, "prismatic", (1, 0, 0), axis=(1, 0, 0), limits=(-3.0, 0.5)),
         joint(3, "prismatic", axis=(1, 0, 0), limits=(-0.25, 0.5))]
    )  # fmt: skip
    assert longest_levers(robot, robot.lower, robot.upper)[0] == pytest.approx(1.0 + 3.0 + 0.5)
    assert [stretched_length(robot, without=j) for j in (1, 2)] == pytest.approx([1.5, 4.0])


def flat(kind):
    """The plane x = 0.5, as one patch, as two triangles, or a wall that is bent about z."""
    if kind == "patch":
        return plane((-0.5, 0.5), (-0.5, 0.5), position=(0.5, 0, 0), rpy_deg=(0, 90, 0))
    if kind == "bent":
        return cylinder(0.75, (-60, 60), (-0.5, 0.5))
    corners = np.array([[0.5, y, z] for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return mesh(TriangleMesh(corners, [[0, 2, 1], [1, 2, 3]]))


def along(robot, surface, task, first, last, rounds=4):
    """Stretches of a motion of one joint, halved: of each its bounds, and 401 samples there."""
    cells = surface.cells(2, 2) if surface.kind != "mesh" else surface.cells(4)
    judge = Judge(robot, task, offset_surface(surface, 0.0), cells)
    rows = np.array([[first], [last]])
    at = judge.sampled(np.arange(2), np.zeros(2), rows)
    stretch, found = judge.between_rows(rows, placements(robot, rows), at), []
    for _ in range(rounds):
        bounds = judge.bounds(stretch)
        for k in range(len(stretch.length)):
            share = stretch.start.share[k] + S * stretch.length[k]
            q = first + share[:, None] * (last - first)
            found.append((bounds.of([k]), judge.sampled(np.zeros(len(S), int), share, q)))
        stretch = stretch.halves(judge.middles(rows, stretch))
    return found


def turning():
    """An arm of one joint, whose tool runs round a circle of 0.5 m and looks outwards."""
    return robot_of([joint(1), joint(2, "fixed", (0.5, 0, 0))], (1, 0, 0))


@pytest.mark.parametrize("kind", ["patch", "triangles", "bent"])
def test_on_a_circle_errors_and_tilts_are_bounded_and_hardly_more(kind):
    task = Task(0.0, 60, 0.4, approach=(1.0, 0.0, 0.0) if kind == "bent" else "normal")
    used = []
    for bounds, there in along(turning(), flat(kind), task, -0.15, 0.4):
        assert there.error.max() <= bounds.error + 1e-12
        assert there.chord.max() <= bounds.chord + 1e-12
        used.append(there.error.max() / bounds.error[0])
    assert max(used) > 0.97


def test_distances_from_triangles_are_no_less_than_is_said_and_hardly_more():
    """A tool that bends towards a wall, and one that slides past the tip of a thorn, at 0.1 m."""
    wall = mesh(TriangleMesh([[1.5, -1, -1], [1.5, 1, -1], [1.5, 0, 1]], [[0, 1, 2]]))
    thorn = mesh(TriangleMesh([[0.1, 0, 0], [1.1, 0.1, 0.1], [1.1, -0.1, 0.1]], [[0, 1, 2]]))
    slide = robot_of([joint(1, "prismatic", axis=(0, 1, 0))])
    for robot, surface, far in ((turning(), wall, 0.5), (slide, thorn, 0.3)):
        for bounds, there in along(robot, surface, Task(0.0, 180, 1.0), -far, far, 2):
            assert bounds.facets <= there.facets.min() + 1e-12
            assert bounds.facets > 0.9 * there.facets.min()
    assert bounds.facets == pytest.approx(there.facets.min())


@pytest.mark.parametrize("share", [1.0 - 1e-4, 1.0 + 1e-4])
def test_tolerance_and_cone_are_exact(share):
    """Turned by 0.3 rad the tool is 0.5 (1 - cos 0.3) m before the plane."""
    off, turn = 0.5 - 0.5 * np.cos(0.3), np.degrees(0.3)
    for tolerance, cone in ((share * off, 60.0), (1.0, share * turn)):
        task = Task(0.0, cone, tolerance)
        judge = Judge(
            turning(), task, offset_surface(flat("patch"), 0.0), flat("patch").cells(2, 2)
        )
        at = judge.sampled(np.zeros(1, int), np.zeros(1), np.array([[0.3]]))
        assert judge.within(at).all() == (share > 1.0)
        right = replace(at, error=np.zeros(1), chord=np.zeros(1))
        for facets in (-share * task.effective_tolerance, np.nan):
            near = replace(right, facets=np.array([task.standoff + facets]))
            assert judge.within(near).all() == (facets == facets and share < 1.0)


@pytest.mark.parametrize("what", range(4))
@pytest.mark.parametrize("share", [1.0 - 1e-4, 1.0 + 1e-4])
def test_a_cell_is_reached_within_tolerance_cone_and_roll_and_no_further(what, share):
    """The tool is off by 1 mm, tilted by 10 deg about x, or rolled by 20 deg either way."""
    x, y, z = np.eye(3)
    aims = Targets(np.zeros((1, 3)), z[None], x[None])
    task = Task(0.0, 10.0, 1e-3, roll_deg=(-20.0, 20.0), roll_reference=(1.0, 0.0, 0.0))
    off = np.where(np.arange(4) == what, share, 0.0) * [1e-3, *np.radians([10.0, 20.0, -20.0])]
    axis = np.cos(off[1]) * z - np.sin(off[1]) * y
    roll = off[2] + off[3]
    reference = np.cos(roll) * x + np.sin(roll) * y
    found = at_targets(task, aims, np.zeros(1, int), off[:1, None] * y, axis[None], reference[None])
    assert found.all() == (share < 1.0)


@pytest.mark.parametrize(("off", "leans"), [(1e-3, 0.0), (0.0, 0.05), (2e-3, 0.1)])
def test_what_a_surface_may_deviate_by_is_taken_off(off, leans):
    """A target is f + d n, and the angle between unit vectors is 2 asin of half their chord."""
    task = Task(0.02, 30.0, 0.01)
    left = less_deviations(task, SimpleNamespace(deviations=(off, leans)))
    assert left.effective_tolerance == pytest.approx(0.01 - off - 0.02 * leans)
    assert left.cone == pytest.approx(task.cone - 2.0 * np.arcsin(0.5 * leans))
    far = less_deviations(task, SimpleNamespace(deviations=(0.5, 2.0)))
    assert far.effective_tolerance < 1e-11
    assert far.cone == 0.0


def test_what_is_not_known_at_an_end_is_not_known_between():
    """No NaN in, no acceptance out: of error, tilt or distance from triangles, at either end."""
    surface, rows = flat("triangles"), np.array([[0.0], [0.1]])
    judge = Judge(turning(), Task(0.0, 180, 0.4), offset_surface(surface, 0.0), surface.cells(4))
    at = judge.sampled(np.arange(2), np.zeros(2), rows)
    whole = judge.between_rows(rows, placements(judge.robot, rows), at)
    assert judge.within(judge.bounds(whole)).all()
    for end in ("start", "end"):
        for name in ("points", "axes", "facets"):
            known = getattr(whole, end)
            lost = replace(known, **{name: np.full_like(getattr(known, name), np.nan)})
            assert not judge.within(judge.bounds(replace(whole, **{end: lost}))).any()


@pytest.mark.parametrize("value", [1.0 - 1e-4, 1.0 + 1e-4, np.nan])
@pytest.mark.parametrize("name", ["error", "chord", "roll", "facets"])
def test_a_row_is_at_fault_where_it_is_not_within_one_of_its_margins(name, value):
    task = Task(0.02, 30.0, 0.01, roll_deg=(-20.0, 20.0), roll_reference=(0.0, 0.0, 1.0))
    judge = Judge(turning(), task, offset_surface(flat("patch"), 0.0), flat("patch").cells(2, 2))
    at = judge.sampled(np.zeros(1, int), np.zeros(1), np.zeros((1, 1)))
    none = np.zeros(1)
    right = replace(at, error=none, chord=none, roll=none, facets=np.full(1, np.inf))
    margins = {"error": 0.01, "chord": task.cone_chord, "roll": np.radians(20.0), "facets": 0.01}
    given = replace(right, **{name: np.full(1, value * margins[name])})
    wrong = not (value > 1.0 if name == "facets" else value < 1.0)
    assert judge.within(right).all()
    assert not exact_faults(judge, right, "row")
    assert judge.within(given).all() == (not wrong)
    assert bool(exact_faults(judge, given, "row")) == wrong


@pytest.mark.parametrize("share", [1.0 - 1e-4, 1.0 + 1e-4])
def test_a_toolpath_is_run_back_by_no_more_than_the_tolerance(share):
    along = np.array([0.0, 0.7, 0.7 - 0.4 * share, 0.9])
    offset = SimpleNamespace(along=lambda places: along)
    passed = SimpleNamespace(places=None, row=np.arange(4), share=np.zeros(4))
    assert bool(order_of_places(offset, passed, 0.4)) == (share > 1.0)


@pytest.mark.parametrize(("marks", "right"), [((0, -1, 1, 1, 2), True), ((0, 1, 3), False),
                                              ((0, 1, 0), False)])  # fmt: skip
def test_marks_go_from_pose_to_pose(marks, right):
    walk = Walk(np.zeros((len(marks), 1)), np.array(marks))
    assert (order_of_marks(SimpleNamespace(in_order=True), walk) == "") == right
