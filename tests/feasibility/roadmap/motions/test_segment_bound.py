"""The bound between samples, against dense sampling by Pinocchio, on random arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import joint
from dense_replay import tools
from random_arms import (
    between,
    deviation,
    planar_arm,
    random_arm,
    random_configuration,
    random_surface,
    robot_of,
    tilted,
    turn_onto,
)

from feasibility import Task
from feasibility.roadmap import arrays_of, place, project, segment_holds, stand_still, work_for
from feasibility.roadmap.motions.aiming import aim, bounds_between
from feasibility.roadmap.motions.segment_bound import peak, spread
from feasibility.roll import Roll, projected, roll_of
from surfaces import cylinder, sphere
from surfaces.patches import GridCells, plane

ROUNDING = 1e-12
KINDS = ["sphere", "cylinder", "hyperboloid", "plane"]
SPHERE = sphere(1.0, (20, 160), (-90, 90), side="outside")
CYLINDER = cylinder(1.0, (-90, 90), (-1, 1), side="outside")


def far_plane():
    """A surface for tests of the tool's motion alone."""
    return plane((-1, 1), (-1, 1)).cells(1, 1)


def random_segments(rng, arms, per_arm):
    """(robot, q0, q1), with steps of 1e-4 to 3 rad in all joints or in a few."""
    for _ in range(arms):
        robot = random_arm(rng)
        for _ in range(per_arm):
            q0 = random_configuration(robot, rng)
            step = rng.normal(size=robot.n) * 10.0 ** rng.uniform(-4.0, 0.5)
            if rng.random() < 0.5:
                step *= rng.random(robot.n) < 0.4
            yield robot, q0, q0 + step


def test_second_derivatives_bound_the_sag_of_every_segment():
    """750 segments of 50 arms: the tool point and the axis stay as near their chords as D allows.

    The bound is not loose either: some segment uses all of it, and half of them 15 per cent.
    """
    rng = np.random.default_rng(1)
    used, used_axis = [], []
    previous = None
    for robot, q0, q1 in random_segments(rng, 50, 15):
        if robot is not previous:
            arrays, work = arrays_of(robot, far_plane(), Task(0.0, 30)), work_for(robot.n)
            previous = robot
        place(arrays, work, 0, q0)
        place(arrays, work, 1, q1)
        derivative_bounds = spread(arrays, work, q0, q1)
        s, q = between(q0, q1, 32)
        for values, derivative_bound, ratios in zip(
            tools(robot, q), derivative_bounds, (used, used_axis), strict=True
        ):
            chord = (1.0 - s[:, None]) * values[0] + s[:, None] * values[-1]
            sag = np.linalg.norm(values - chord, axis=1)
            allowed = 0.5 * derivative_bound * s * (1.0 - s)
            assert (sag <= allowed * (1.0 + 1e-9) + ROUNDING).all(), (robot.urdf, q0, q1)
            if derivative_bound > 1e-6:
                ratios.append((sag[1:-1] / allowed[1:-1]).max())
    for ratios in (used, used_axis):
        assert max(ratios) > 0.99
        assert np.median(ratios) > 0.15


def test_levers_hold_where_they_are_longer_in_the_middle_than_at_the_ends():
    """Folded, stretched, folded again: the lever of the first joint peaks halfway.

    Ends: the second joint at -+bend, so that the tool is as near to the first axis at both.
    """
    robot = planar_arm(2, (-3.1, 3.1))
    arrays, work = arrays_of(robot, far_plane(), Task(0.0, 30)), work_for(2)
    worst = 0.0
    for bend in np.linspace(0.05, 3.1, 30):
        for turn in (0.01, 0.1, 1.0, 3.0):
            for q0, q1 in (
                (np.array([0.0, -bend]), np.array([turn, bend])),
                (np.array([turn, -bend]), np.array([0.0, bend])),
            ):
                place(arrays, work, 0, q0)
                place(arrays, work, 1, q1)
                bound, _ = spread(arrays, work, q0, q1)
                s, q = between(q0, q1, 200)
                points, _ = tools(robot, q)
                chord = (1.0 - s[:, None]) * points[0] + s[:, None] * points[-1]
                sag = np.linalg.norm(points - chord, axis=1)
                assert (sag <= 0.5 * bound * s * (1.0 - s) + ROUNDING).all()
                worst = max(worst, (2.0 * sag[1:-1] / (bound * s * (1.0 - s))[1:-1]).max())
    assert worst > 0.7


def test_peak_is_the_largest_value():
    """Against 2,001 points of the parabola, for 2,000 random ones; exactly at its corner cases."""
    rng = np.random.default_rng(2)
    s = np.linspace(0.0, 1.0, 2001)
    for _ in range(2000):
        a, b = rng.uniform(0.0, 1.0, 2)
        most = 10.0 ** rng.uniform(-3.0, 2.0)
        sampled = ((1.0 - s) * a + s * b + 0.5 * most * s * (1.0 - s)).max()
        assert sampled <= peak(a, b, most) * (1.0 + 1e-12)
        assert peak(a, b, most) <= sampled + 0.5 * most * 2.6e-7
    assert peak(0.3, 0.3, 0.0) == 0.3
    assert peak(0.0, 0.5, 1.0) == 0.5
    assert peak(0.2, 0.2, 8.0) == pytest.approx(1.2, rel=1e-15)
    assert peak(0.1, 0.2, np.inf) == np.inf
    for hole in range(3):
        values = [0.1, 0.2, 0.3]
        values[hole] = np.nan
        assert np.isnan(peak(*values))


def two_cells(surface, parameters):
    """Two neighbouring cells of a patch with their centres at given parameters (2, 2)."""
    (u0, v0), (u1, v1) = parameters
    u, v = np.array([u0, u1]), np.array([v0, v1])
    return GridCells(
        surface, surface.point(u, v), surface.normal(u, v), np.ones(2), (1, 2), u=u, v=v
    )


def surface_segment(rng, robot, kind, task, share, offsets, longest, onto):
    """A segment that starts near a random target surface, axis at a share of the cone.

    Its targets run along a curve from the closest point of one end to that of the other. Returns
    arrays, work, cells, q0, q1 (slots 0 and 1 hold both ends), or None where Newton does not
    bring the second end onto the surface.
    """
    surface = random_surface(rng, kind)
    u, v = (rng.uniform(*span) * 0.9 for span in (surface.u_range, surface.v_range))
    sign = surface.side_sign
    normal = surface.normal(u, v)
    target = surface.point(u, v) + sign * task.standoff * normal
    q0 = random_configuration(robot, rng)
    (point,), (axis,) = tools(robot, q0[None])
    approach = tilted(axis, share * min(task.cone, 3.1), rng)
    turn = turn_onto(-sign * normal, approach, rng)
    offset = rng.normal(size=3)
    offset *= rng.choice(offsets) * task.tolerance / np.linalg.norm(offset)
    surface = surface.moved(turn, point + offset - turn @ target)
    q1 = q0 + rng.normal(size=robot.n) * 10.0 ** rng.uniform(-3.0, longest)
    (away,), _ = tools(robot, q1[None])
    closest = surface.closest(np.array([surface.point(u, v), away]))
    cells = two_cells(surface, np.column_stack([closest.u, closest.v]))
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    if task.roll is not None:
        aim(arrays, work, 0, 0.0)
        place(arrays, work, 0, q0)
        middle = arrays.roll[0] + work.error[0, 2] + rng.uniform(-1.0, 1.0) * task.roll.half
        arrays = arrays._replace(roll=np.array([middle, task.roll.half]))
    bounds_between(arrays, work, 0, 0.0, 1.0)
    aim(arrays, work, 0, 1.0)
    place(arrays, work, 1, q1)
    if onto:
        work.secondary_step[:] = 0.0
        if not project(arrays, work, q1, 1e-6, np.inf, 60):
            return None
        place(arrays, work, 1, q1)
    aim(arrays, work, 0, 0.0)
    place(arrays, work, 0, q0)
    return arrays, work, cells, q0, q1


def beside_the_curve(robot, cells, task, q0, q1, samples):
    """Distance from the moving target, and |a - b| there and at the tool's closest point."""
    s, q = between(q0, q1, samples)
    points, axes = tools(robot, q)
    on_curve, normal = cells.curves.at(np.zeros(len(s), dtype=np.int64), s)
    sign = cells.surface.side_sign
    distance = np.linalg.norm(points - on_curve - sign * task.standoff * normal, axis=1)
    chord = np.linalg.norm(axes + sign * normal, axis=1)
    return distance, chord, deviation(cells.surface, task.standoff, points, axes).chord


@pytest.mark.parametrize("kind", KINDS)
def test_a_segment_that_is_accepted_holds_everywhere(kind):
    """120 segments of each kind; `make campaign NAME=larger_samples` has more."""
    assert_accepted_segments_hold(kind, 6)


def assert_accepted_segments_hold(kind, surfaces):
    """Segments at either side of random surfaces in any pose, 20 each, 40 samples on each.

    Every segment that `segment_holds` accepts stays within tolerance and cone at every sample, and
    within the share that it states. It accepts a fair part, and some use at least half of what it
    allows the tool point beyond the errors of the ends.
    """
    rng = np.random.default_rng(KINDS.index(kind))
    passed, tried, worst = 0, 0, 0.0
    for _ in range(surfaces):
        robot = random_arm(rng)
        for _ in range(20):
            cone_deg = float(rng.choice([2.0, 20.0, 60.0, 120.0, 179.0, 180.0]))
            task = Task(float(rng.choice([0.0, 0.05])), cone_deg, 10.0 ** rng.uniform(-4.5, -2.0))
            made = surface_segment(
                rng, robot, kind, task, rng.random(), (0.0, 0.02, 0.7), -0.3, rng.random() < 0.8
            )
            if made is None:
                continue
            arrays, work, cells, q0, q1 = made
            position, cone = segment_holds(arrays, work, q0, q1)
            tried += 1
            if not (position <= 1.0 and cone <= 1.0):
                continue
            passed += 1
            distance, chord, own = beside_the_curve(robot, cells, task, q0, q1, 40)
            assert distance.max() <= position * work.allowance[0] + ROUNDING
            assert distance.max() <= task.tolerance
            if task.cone_deg < 180.0:
                assert chord.max() <= cone * work.allowance[1] + ROUNDING
                ends = max(work.error[0, 0], work.error[1, 0])
                if ends <= arrays.near:  # as everywhere in a search
                    angle = 2.0 * np.arcsin(np.minimum(0.5 * own, 1.0))
                    assert angle.max() <= task.cone + 1e-9
            grown = position * work.allowance[0] - max(distance[0], distance[-1])
            if grown > 1e-7:
                worst = max(worst, (distance.max() - max(distance[0], distance[-1])) / grown)
    assert tried > 9 * surfaces
    assert passed > 4 * surfaces
    assert worst > 0.5


def off_middle(arrays, cells, task, x, axes, normals):
    """|roll - middle| (k,) of reference axes and axes (k, 3) over places with these normals."""
    b = -cells.surface.side_sign * normals
    t, sine = projected(np.broadcast_to(task.fixed_reference(cells), b.shape), b)
    roll = Roll(float(arrays.roll[0]), float(arrays.roll[1]))
    return np.where(sine > 0.02, np.abs(roll.off(roll_of(x, axes, t, b))), 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_roll_holds_on_a_segment_that_is_accepted(kind):
    """128 segments of each kind; `make campaign NAME=larger_samples` has more."""
    assert_roll_holds(kind, 8)


def assert_roll_holds(kind, arms):
    """16 segments for each arm, as above, with ranges of 0.5 to 300 deg about a random reference.

    Roll stays in its range at every sample, over the curve and over the tool point's own foot.
    """
    rng = np.random.default_rng(20 + KINDS.index(kind))
    passed = 0
    for _ in range(arms):
        robot = random_arm(rng)
        turned = replace(
            robot, approach_axis=robot.reference_axis, reference_axis=robot.approach_axis
        )
        for _ in range(16):
            half = float(rng.choice([0.25, 2.0, 15.0, 150.0]))
            task = Task(
                float(rng.choice([0.0, 0.05])),
                float(rng.choice([2.0, 20.0, 60.0, 90.0])),
                10.0 ** rng.uniform(-3.5, -2.0),
                roll_deg=(-half, half),
                roll_reference=tuple(rng.normal(size=3).tolist()),
            )
            made = surface_segment(rng, robot, kind, task, rng.random(), (0.0, 0.02), -0.3, True)
            if made is None:
                continue
            arrays, work, cells, q0, q1 = made
            position, orientation = segment_holds(arrays, work, q0, q1)
            if not (position <= 1.0 and orientation <= 1.0):
                continue
            passed += 1
            s, q = between(q0, q1, 20)
            (points, axes), (_, x) = tools(robot, q), tools(turned, q)
            _, normals = cells.curves.at(np.zeros(len(s), dtype=np.int64), s)
            along = off_middle(arrays, cells, task, x, axes, normals)
            assert along.max() <= orientation * work.allowance[2] + arrays.frame_deviations[0, 1]
            assert along.max() <= arrays.roll[1]
            if max(work.error[0, 0], work.error[1, 0]) <= arrays.near:
                own = cells.surface.closest(points).normal
                assert off_middle(arrays, cells, task, x, axes, own).max() <= arrays.roll[1]
    assert passed > 2.5 * arms


@pytest.mark.parametrize("kind", KINDS)
def test_the_cone_holds_on_long_segments(kind):
    """90 segments of each kind; `make campaign NAME=larger_samples` has more."""
    assert_the_cone_holds(kind, 6)


def assert_the_cone_holds(kind, arms):
    """15 segments for each arm, long ones: the tolerance is 0.15 m, and cones go beyond 90 deg.

    There a normal that bulges between the ends turns away from the axis: the bound covers that.
    """
    rng = np.random.default_rng(10 + KINDS.index(kind))
    passed = 0
    for _ in range(arms):
        robot = random_arm(rng)
        for _ in range(15):
            task = Task(0.01, float(rng.choice([45.0, 100.0, 150.0, 178.0])), 0.15)
            arrays, work, cells, q0, q1 = surface_segment(
                rng, robot, kind, task, rng.uniform(0.5, 1.0), (0.0, 0.3), 0.1, False
            )
            position, cone = segment_holds(arrays, work, q0, q1)
            if not position <= 1.0:
                continue
            passed += 1
            distance, chord, _ = beside_the_curve(robot, cells, task, q0, q1, 20)
            assert distance.max() <= position * work.allowance[0] + ROUNDING
            assert chord.max() <= cone * work.allowance[1] + ROUNDING
    assert passed > 5 * arms


@pytest.mark.parametrize("surface", [SPHERE, CYLINDER], ids=lambda surface: surface.kind)
@pytest.mark.parametrize("half", [0.01, 0.1, 0.3])
def test_a_normal_that_bulges_away_from_a_fixed_axis(surface, half):
    """A gantry with its tool turned away: 2 cos(half / 2) at the ends, 2 in the middle.

    The bound covers the middle, and the growth from the ends to it is at least 0.2 of what the
    bound allows for (the most that a bound by the ends' norms alone can do here is 0.43, and as
    much again is for the normal at the tool point's closest point).
    """
    gantry = robot_of([joint(i, "prismatic", axis=np.eye(3)[i - 1]) for i in (1, 2, 3)], (1, 0, 0))
    at = {"sphere": lambda a: (0.5 * np.pi, a), "cylinder": lambda a: (a, 0.0)}[surface.kind]
    cells = two_cells(surface, (at(-half), at(half)))
    # The approach direction is -x where the surface's outward normal is +x.
    arrays = arrays_of(gantry, cells, Task(0.0, 179.0, 0.1))
    work = work_for(3)
    q0, q1 = (np.array([np.cos(a), np.sin(a), 0.0]) for a in (-half, half))
    for slot, q in enumerate((q0, q1)):
        aim(arrays, work, 0, float(slot))
        place(arrays, work, slot, q)
    bounds_between(arrays, work, 0, 0.0, 1.0)
    position, cone = segment_holds(arrays, work, q0, q1)
    assert position * 0.1 >= 1.0 - np.cos(half)
    assert position * 0.1 <= 1.2 * (1.0 - np.cos(half))
    end = 2.0 * np.cos(half / 2.0)
    assert cone * work.allowance[1] >= 2.0 - ROUNDING
    assert (2.0 - end) / (cone * work.allowance[1] - end) > 0.2


def test_nothing_that_is_not_a_number_passes():
    """NaN or infinity in a joint, or a surface that folds, never certifies a segment."""
    robot = planar_arm(3)
    arrays, work = arrays_of(robot, far_plane(), Task(0.0, 180, 1.0)), work_for(3)
    q = np.array([0.1, 0.2, 0.3])
    work.target[0], work.target[1] = np.zeros(3), np.array([0.0, 0.0, 1.0])
    stand_still(arrays, work)
    place(arrays, work, 0, q)
    place(arrays, work, 1, q)
    position, cone = segment_holds(arrays, work, q, q)
    assert position <= 1.0
    assert cone == 0.0
    for bad in (np.nan, np.inf):
        wrong = np.array([0.1, bad, 0.3])
        place(arrays, work, 1, wrong)
        position, cone = segment_holds(arrays, work, q, wrong)
        assert not (position <= 1.0 and cone <= 1.0)
    place(arrays, work, 1, q)
    work.derivative_bound[:] = np.inf
    position, cone = segment_holds(arrays, work, q, q + 1e-9)
    assert not (position <= 1.0 and cone <= 1.0)
