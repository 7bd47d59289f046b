"""Bounds between rows hold where they are sampled, and less would be wrong; margins are exact."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arm_urdfs import finite_limits, joint
from bounds import holds
from random_arms import between, random_arm, robot_of
from samples import sampled, seeds

from coverable import Task, cylinder, mesh, plane
from feasibility.certification import lever_bounds
from feasibility.certification.cells_reached import at_targets, cells_reached
from feasibility.certification.faults import less_deviations
from feasibility.certification.lever_bounds import jacobians, levers_along, longest_levers, peaks
from feasibility.certification.motion_replay import limits, replay_over_surface
from feasibility.certification.pose_replay import order_of_marks, order_of_places
from feasibility.certification.stretches import Judge
from feasibility.certification.tool_along import exact_faults
from feasibility.task import Targets
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from surfaces.meshes.triangle_mesh import TriangleMesh

S = np.linspace(0.0, 1.0, 401)
X, Y, Z = np.eye(3)
JUST = pytest.mark.parametrize("share", [1.0 - 1e-4, 1.0 + 1e-4])


def links(count):
    """`count` links of 1 m in a plane, the tool at the end of the last one."""
    turns = [joint(k + 1, xyz=(min(k, 1), 0, 0)) for k in range(count)]
    return robot_of([*turns, joint(count + 1, "fixed", (1, 0, 0))], (1, 0, 0))


def test_peaks_are_the_largest_values_of_parabolas():
    rng = np.random.default_rng(0)
    a, b, most = rng.random((3, 2000, 1)) * [[[1.0]], [[1.0]], [[20.0]]]
    truth = ((1.0 - S) * a + S * b + S * (1.0 - S) * most / 2.0).max(axis=1)
    found = peaks(a[:, 0], b[:, 0], most[:, 0])
    holds(found, truth)
    assert found == pytest.approx(truth, abs=1e-4)
    assert np.isnan(peaks(*np.array([[np.nan, 1.0], [1.0, np.nan], [1.0, 1.0]]))).all()
    ends = np.array([np.inf, 1.0])  # unknown, and no warning
    assert np.array_equal(peaks(ends, ends, np.array([np.inf, 0.0])), [np.nan, 1.0], equal_nan=True)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_stretched_arm_bends_as_much_as_is_said(count):
    """All links in a line: |p''| is the sum of the squares of their own rates."""
    steps = np.random.default_rng(count).uniform(0.2, 1.0, (1, count))
    robot = links(count)
    levers = jacobians(Kinematics(robot), np.zeros((1, count))).levers
    assert levers[0] == pytest.approx(np.arange(count, 0, -1))
    bound = lever_bounds.second_derivative_bound(levers, steps, robot.prismatic)
    each = np.cumsum(steps, axis=1) ** 2
    holds(bound, each.sum(axis=1), 1.0 - 1e-9)
    bends = lever_bounds.column_changes(levers, steps, robot.prismatic, True)
    holds(bends, np.cumsum(each[:, ::-1], axis=1)[:, ::-1], 1.0 - 1e-9)


def test_a_slide_on_a_turning_arm_bends_by_twice_the_turn():
    """At the axes themselves |p''| = 2 r' (the sum of the turns)."""
    robot = robot_of([joint(1), joint(2), joint(3, "prismatic", axis=(1, 0, 0))])
    steps, none = np.array([[0.3, 0.4, 0.5]]), np.zeros((1, 3))
    levers = jacobians(Kinematics(robot), none).levers
    found = lever_bounds.second_derivative_bound(levers, steps, robot.prismatic)
    holds(found, 2 * 0.5 * 0.7, 1.0 - 1e-9)
    bends = lever_bounds.column_changes(levers, steps, robot.prismatic, True)
    holds(bends, [[2 * 0.5 * 0.7, 2 * 0.5 * 0.7, 0.7**2]], 1.0 - 1e-9)


@pytest.mark.parametrize("turn", [0.01, 0.3, 1.5, 3.1])
def test_levers_grow_as_joints_behind_turn(turn):
    """Two links: the lever is |1 + exp(i q)|, least where the arm is folded."""
    elbow = links(2)
    for middle in (0.0, 1.0, np.pi):
        ends = [np.array([[0.0, middle + way * turn]]) for way in (-1.0, 1.0)]
        first, last = (jacobians(Kinematics(elbow), q).levers for q in ends)
        truth = np.abs(1.0 + np.exp(1j * (middle + turn * (2.0 * S - 1.0)))).max()
        along = levers_along(np.array([[0, 2 * turn]]), elbow.prismatic, first, last, np.inf)[0, 0]
        assert along >= truth - 1e-9
        assert truth > 1.9 or along < 1.2 * truth + turn


@sampled("seed", seeds(12, all=100))
def test_levers_and_bends_hold_along_segments_and_over_boxes(seed):
    rng = np.random.default_rng(seed)
    robot = random_arm(rng)
    kinematics, slides, turns = Kinematics(robot), robot.prismatic, ~robot.prismatic
    low, high = finite_limits(robot)
    start = rng.uniform(low, high)
    end = np.clip(start + rng.normal(size=robot.n) * 10.0 ** rng.uniform(-3, 0), low, high)
    at = jacobians(kinematics, between(start, end, 400)[1])
    steps = np.abs(end - start)[None]
    for truth, path, cap in ((at.levers, at.points, np.inf), (at.sines, at.axes, 1.0)):
        found = levers_along(steps, slides, truth[:1], truth[-1:], cap)
        assert (truth[:, turns] <= found[0, turns] * (1.0 + 1e-9) + 1e-12).all()
        bent = lever_bounds.second_derivatives(steps, slides, truth[[0, -1]], cap)[0]
        seen = np.linalg.norm(np.diff(path, n=2, axis=0), axis=1).max() * 400.0**2
        assert seen <= bent * (1.0 + 1e-3) + 1e-8

    low, high = np.maximum(low, -4.0), np.minimum(high, 4.0)
    half = np.minimum(np.exp(rng.uniform(-5, 1)) * rng.random(robot.n), 0.5 * (high - low))
    centre = rng.uniform(low + half, high - half)
    d = rng.uniform(-1, 1, (200, robot.n))
    d = np.where(rng.random(d.shape) < 0.5, np.sign(d), d) * half
    here, there = jacobians(kinematics, centre[None]), jacobians(kinematics, centre + d)
    for value, columns in (("points", "point"), ("axes", "axis")):
        slopes, moved = getattr(here, columns), getattr(there, value) - getattr(here, value)
        levers = np.linalg.norm(slopes, axis=1)
        second = lever_bounds.second_derivative_bound(levers, half[None], slides)
        assert (np.linalg.norm(moved - d @ slopes[0].T, axis=1) <= 0.5 * second + 1e-12).all()
        assert (np.linalg.norm(moved, axis=1) <= levers @ half + 1e-12).all()
    assert (there.levers <= longest_levers(robot, low, high) + 1e-9)[:, turns].all()


def test_slides_behind_a_joint_lengthen_its_lever_by_their_further_end():
    robot = robot_of(
        [joint(1), joint(2, "prismatic", (1, 0, 0), axis=(1, 0, 0), limits=(-3.0, 0.5)),
         joint(3, "prismatic", axis=(1, 0, 0), limits=(-0.25, 0.5))]
    )  # fmt: skip
    assert longest_levers(robot, robot.lower, robot.upper)[0] == pytest.approx(1.0 + 3.0 + 0.5)
    without = [lever_bounds.stretched_length(robot, without=j) for j in (1, 2)]
    assert without == pytest.approx([1.5, 4.0])


def flat(kind):
    """The plane x = 0.5, as one patch, as two triangles, or a wall that is bent about z."""
    if kind == "patch":
        return plane((-0.5, 0.5), (-0.5, 0.5), position=(0.5, 0, 0), rpy_deg=(0, 90, 0))
    if kind == "bent":
        return cylinder(0.75, (-60, 60), (-0.5, 0.5))
    corners = np.array([[0.5, y, z] for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return mesh(TriangleMesh(corners, [[0, 2, 1], [1, 2, 3]]))


def judged(robot, surface, task, *rows):
    cells = surface.cells(2, 2) if surface.kind != "mesh" else surface.cells(4)
    return Judge(robot, task, surface, cells, np.array(rows)[:, None])


def along(robot, surface, task, first, last, rounds=4):
    """Stretches of a motion of one joint, halved: of each its bounds, and 401 samples there."""
    judge = judged(robot, surface, task, first, last)
    stretch, found = judge.between_rows(judge.at_rows()), []
    for _ in range(rounds):
        bounds = judge.bounds(stretch)
        for k in range(len(stretch.length)):
            share = stretch.start.share[k] + S * stretch.length[k]
            found.append((bounds.of([k]), judge.sampled(np.zeros(len(S), int), share)))
        stretch = stretch.halves(judge.sampled(stretch.row, stretch.middle))
    return found


def turning():
    """An arm of one joint, whose tool runs round a circle of 0.5 m and looks outwards."""
    return robot_of([joint(1), joint(2, "fixed", (0.5, 0, 0))], (1, 0, 0))


def sliding(x=0.0):
    """An arm of one joint, whose tool slides along y at x and looks along it."""
    return robot_of([joint(1, "prismatic", (x, 0, 0), axis=(0, 1, 0))], (1, 0, 0))


MOTIONS = {
    "a circle inside a plane": (turning(), flat("patch"), "normal", (-0.15, 0.4)),
    "a circle inside triangles": (turning(), flat("triangles"), "normal", (-0.15, 0.4)),
    "a circle inside a wider one": (turning(), flat("bent"), X, (-0.15, 0.4)),
    "a circle through a plane": (turning(), flat("patch").moved(np.eye(3), -0.04 * X), "normal",
                                 (-0.403, 0.6)),
    "a line and a curved wall": (sliding(0.6), flat("bent"), X, (-0.45, 0.45)),
}  # fmt: skip


@pytest.mark.parametrize("name", MOTIONS)
def test_errors_and_tilts_are_bounded_and_hardly_more(name):
    robot, surface, approach, ends = MOTIONS[name]
    approach = approach if isinstance(approach, str) else tuple(approach)
    found = along(robot, surface, Task(0.0, 60, 0.4, approach=approach), *ends)
    holds([b.error[0] for b, _ in found], [there.error.max() for _, there in found])
    assert all(there.chord.max() <= b.chord + 1e-12 for b, there in found)


def test_distances_from_triangles_are_no_less_than_is_said_and_hardly_more():
    """A tool that bends towards a wall, and one that slides past the tip of a thorn, at 0.1 m."""
    wall = mesh(TriangleMesh([[1.5, -1, -1], [1.5, 1, -1], [1.5, 0, 1]], [[0, 1, 2]]))
    thorn = mesh(TriangleMesh([[0.1, 0, 0], [1.1, 0.1, 0.1], [1.1, -0.1, 0.1]], [[0, 1, 2]]))
    for robot, surface, far in ((turning(), wall, 0.5), (sliding(), thorn, 0.3)):
        for bounds, there in along(robot, surface, Task(0.0, 180, 1.0), -far, far, 2):
            assert bounds.facets <= there.facets.min() + 1e-12
            assert bounds.facets > 0.9 * there.facets.min()
    assert bounds.facets == pytest.approx(there.facets.min())


@JUST
def test_tolerance_and_cone_are_exact(share):
    """Turned by 0.3 rad the tool is 0.5 (1 - cos 0.3) m before the plane."""
    off, turn = 0.5 - 0.5 * np.cos(0.3), np.degrees(0.3)
    for tolerance, cone in ((share * off, 60.0), (1.0, share * turn)):
        judge = judged(turning(), flat("patch"), Task(0.0, cone, tolerance), 0.3)
        assert judge.within(judge.at_rows()).all() == (share > 1.0)


@pytest.mark.parametrize(("cone", "chord"), [(60, 1.0), (90, 2**0.5), (120, 3**0.5), (180, np.inf)])
def test_the_chord_of_a_cone_is_that_of_its_angle(cone, chord):
    """Up to 180 degrees, where any axis will do."""
    assert Task(0.0, cone).cone_chord == pytest.approx(chord)


@pytest.mark.parametrize("value", [1.0 - 1e-4, 1.0 + 1e-4, np.nan])
@pytest.mark.parametrize("name", ["error", "chord", "roll", "facets"])
def test_a_row_is_at_fault_where_it_is_not_within_one_of_its_margins(name, value):
    """Facets have to be the standoff less the tolerance away: 20 mm less 10 mm."""
    task = Task(0.02, 30.0, 0.01, roll_deg=(-20.0, 20.0), roll_reference=(0.0, 0.0, 1.0))
    judge, none = judged(turning(), flat("patch"), task, 0.0), np.zeros(1)
    right = replace(judge.at_rows(), error=none, chord=none, roll=none, facets=np.full(1, np.inf))
    chord = 2.0 * np.sin(np.radians(15.0))
    margins = {"error": 0.01, "chord": chord, "roll": np.radians(20.0), "facets": 0.01}
    given = replace(right, **{name: np.full(1, value * margins[name])})
    wrong = not (value > 1.0 if name == "facets" else value < 1.0)
    assert judge.within(right).all()
    assert not exact_faults(judge, right, "row")
    assert judge.within(given).all() == (not wrong)
    assert bool(exact_faults(judge, given, "row")) == wrong


def test_what_is_not_known_at_an_end_is_not_known_between():
    """No NaN in, no acceptance out: of error, tilt or distance from triangles, at either end."""
    judge = judged(turning(), flat("triangles"), Task(0.0, 180, 0.4), 0.0, 0.1)
    whole = judge.between_rows(judge.at_rows())
    assert judge.within(judge.bounds(whole)).all()
    for end in ("start", "end"):
        for name in ("points", "axes", "facets"):
            known = getattr(whole, end)
            lost = replace(known, **{name: np.full_like(getattr(known, name), np.nan)})
            assert not judge.within(judge.bounds(replace(whole, **{end: lost}))).any()


@pytest.mark.parametrize(("off", "leans"), [(1e-3, 0.0), (0.0, 0.05), (2e-3, 0.1)])
def test_what_a_surface_may_deviate_by_is_taken_off(off, leans):
    """A target is f + d n, and the angle between unit vectors is 2 asin of half their chord."""
    task = Task(0.02, 30.0, 0.01)
    left = less_deviations(task, SimpleNamespace(deviations=(off, leans)))
    assert left.effective_tolerance == pytest.approx(0.01 - off - 0.02 * leans)
    assert left.cone == pytest.approx(np.radians(30.0) - 2.0 * np.arcsin(0.5 * leans))
    far = less_deviations(task, SimpleNamespace(deviations=(0.5, 2.0)))
    assert far.effective_tolerance < 1e-11
    assert far.cone == 0.0


@pytest.mark.parametrize("what", range(4))
@JUST
def test_a_cell_is_reached_within_tolerance_cone_and_roll_and_no_further(what, share):
    """The tool is off by 1 mm, tilted by 10 deg about x, or rolled by 20 deg either way."""
    aims = Targets(np.zeros((1, 3)), Z[None], X[None])
    task = Task(0.0, 10.0, 1e-3, roll_deg=(-20.0, 20.0), roll_reference=(1.0, 0.0, 0.0))
    off = np.where(np.arange(4) == what, share, 0.0) * [1e-3, *np.radians([10.0, 20.0, -20.0])]
    axis = np.cos(off[1]) * Z - np.sin(off[1]) * Y
    roll = off[2] + off[3]
    reference = np.cos(roll) * X + np.sin(roll) * Y
    held = at_targets(task, aims, np.zeros(1, int), off[:1, None] * Y, axis[None], reference[None])
    assert np.isfinite(held[0]).all() == (share < 1.0)


@pytest.mark.parametrize(("reached", "turn"), [(True, 4.0), (True, -4.0), (False, 0.0)])
def test_a_cell_is_looked_for_all_along_the_way_past_it(reached, turn):
    """The tool slides over the target and turns: where it is nearest it is 0.5 deg too tilted."""
    robot = robot_of([joint(1, "prismatic", axis=(1, 0, 0)), joint(2, axis=(0, 1, 0))], (0, 0, -1))
    cells, task = plane((-0.1, 0.1), (-0.1, 0.1), "outside").cells(1, 1), Task(0.0, 10.0, 1e-3)
    tilt = np.radians(10.5 + turn * np.array([-1.0, 1.0]))  # by `turn` deg within 2 mm
    rows = np.column_stack([[-2e-3, 2e-3], tilt])
    judge = Judge(robot, task, cells.surface, cells, rows)
    assert cells_reached(judge, task, judge.at_rows(), np.ones((2, 2))).all() == reached
    lifted = np.array([True, False, True])  # on the way, and back where it is
    found = replay_over_surface(robot, cells, task, rows[[0, 1, 1]], working=lifted)
    assert not found.reached.any()


@pytest.mark.parametrize(("j", "end"), [(0, "lower"), (2, "upper")])
@pytest.mark.parametrize("by", [0.0, 1e-9, 0.2])
def test_limits_are_exact_and_the_nearest_counts(j, end, by):
    robot, rows = links(3), np.zeros((4, 3))
    robot = robot.with_limits(np.tile([-1.5, 1.0], (3, 1)))
    rows[2, j] = getattr(robot, end)[j] + (by if end == "upper" else -by)
    margin, faults = limits(robot, rows)
    assert margin == pytest.approx(-by, abs=1e-12)
    assert [fault.row for fault in faults] == ([2] if by else [])
    assert all(f"j{j + 1} passes its limit by" in fault.text for fault in faults)
    assert limits(robot, rows[:1])[0] == pytest.approx(1.0)


@JUST
def test_a_toolpath_is_run_back_by_no_more_than_the_tolerance(share):
    offset = SimpleNamespace(along=lambda places: np.array([0.0, 0.7, 0.7 - 0.4 * share, 0.9]))
    passed = SimpleNamespace(places=None, row=np.arange(4), share=np.zeros(4))
    assert bool(order_of_places(offset, passed, 0.4)) == (share > 1.0)


@pytest.mark.parametrize(("marks", "right"), [((0, -1, 1, 1, 2), True), ((0, 1, 3), False),
                                              ((0, 1, 0), False)])  # fmt: skip
def test_marks_go_from_pose_to_pose(marks, right):
    walk = Walk(np.zeros((len(marks), 1)), np.array(marks))
    assert (order_of_marks(SimpleNamespace(in_order=True), walk) == "") == right
