"""The parts of the judge of collisions that bound: how bodies move between rows, what parts them.

Each bound is held against dense samples by Pinocchio and coal, or against a distance known by hand.
"""

from __future__ import annotations

import arm_urdfs
import numpy as np
import pytest
from bounds import holds
from capsule_arms import at, planar_arm
from mesh_patches import of_patch
from random_arms import robot_of
from scipy.optimize import nnls

from feasibility.certification.collisions import piece_of, sheet_piece
from feasibility.certification.collisions.budgets import Budget, TooNear
from feasibility.certification.collisions.descent import Descent, rough_bounds
from feasibility.certification.collisions.first_look import Body, CoupledBodies, FirstLook
from feasibility.certification.collisions.parting import by_balls, parted
from feasibility.certification.collisions.pieces import coal_distance
from feasibility.certification.collisions.plane_search import nearest_of
from feasibility.certification.collisions.relative_motion import ArmMotion
from feasibility.certification.collisions.trees import TriangleTree
from robots import Kinematics, load_robot
from robots.urdf import Box, Capsule, Cylinder, Sphere
from surfaces import sphere

UR5 = load_robot("ur5")
COAL = 1e-6  # m, what coal's distances may be off


def seen(robot, q, a, b, points):
    """Points (k, 3) of joint b as seen from joint a, at configurations q (m, n)."""
    frames = Kinematics(robot).joints(q)
    world = np.einsum("mij,kj->mki", frames.rotations[:, b], points) + frames.points[:, None, b]
    return np.einsum("mji,mkj->mki", frames.rotations[:, a], world - frames.points[:, None, a])


def how_far(robot, rows, deviations, a, b, points, rng):
    """m, that points leave their chords, move, and move besides where joints deviate."""
    t = np.linspace(0, 1, 41)[:, None]
    straight = rows[0] + t * (rows[1] - rows[0])
    at_t = seen(robot, straight, a, b, points)
    chords = at_t[0] + t[:, :, None] * (at_t[-1] - at_t[0])
    bent = straight + rng.choice([-1, 1], straight.shape) * deviations
    off = [at_t - chords, at_t - at_t[0], seen(robot, bent, a, b, points) - at_t]
    return [np.linalg.norm(each, axis=2).max() for each in off]


def some_arms(rng):
    """The UR5, and chains with sliding joints along and across."""
    yield UR5
    for _ in range(3):
        kinds = rng.choice(["revolute", "revolute", "prismatic"], 5).tolist()
        axes = [tuple(np.round(rng.normal(size=3), 3).tolist()) for _ in kinds]
        yield planar_arm(rng.uniform(0.1, 0.6, 5).tolist(), kinds, axes)


@pytest.mark.parametrize("step", [0.001, 0.03, 0.5])
def test_no_point_moves_or_leaves_its_chord_further(step):
    rng, bounds, truths = np.random.default_rng(7), [], []
    for robot in some_arms(rng):
        q = rng.uniform(-2, 2, robot.n)
        for _ in range(12):
            a, b = np.sort(rng.choice(robot.n + 1, 2, replace=False)).tolist()
            rows = np.vstack([q, q + step * rng.normal(size=robot.n)])
            centre, ball = rng.normal(size=3) * 0.3, rng.uniform(0.01, 0.3)
            deviations = step * 0.2 * rng.random((1, robot.n))
            s = ArmMotion(robot, rows, deviations).stretches(a, b, centre, ball)
            around = rng.normal(size=(60, 3))
            points = centre + ball * around / np.linalg.norm(around, axis=1, keepdims=True)
            bounds.append([s.delta[0], s.moved[0], s.deviation[0]])
            truths.append(how_far(robot, rows, deviations, a, b, points, rng))
            q = q + step * rng.normal(size=robot.n)
    for bound, truth in zip(np.transpose(bounds), np.transpose(truths), strict=True):
        holds(bound, truth, 0.6)


@pytest.mark.parametrize("turn", [0.1, 1.0])
def test_a_lever_that_is_longer_in_the_middle_than_at_the_ends(turn):
    """Folded, stretched, folded again: the first joint carries a point further halfway."""
    robot, rng, bounds, truths = planar_arm([0.3, 0.3]), np.random.default_rng(0), [], []
    tip = np.array([[0.3, 0.0, 0.0]])
    for bend in np.linspace(0.1, 3.1, 16):
        rows = np.array([[0.0, -bend], [turn, bend]])
        s = ArmMotion(robot, rows).stretches(0, 2, tip[0], 0.0)
        bounds.append([s.delta[0], s.moved[0]])
        truths.append(how_far(robot, rows, np.zeros((1, 2)), 0, 2, tip, rng)[:2])
        q = np.linspace(0.0, 1.0, 2001)[:, None] * (rows[1] - rows[0]) + rows[0]
        way = np.linalg.norm(np.diff(seen(robot, q, 0, 2, tip)[:, 0], axis=0), axis=1).sum()
        truths[-1][1] = way  # no less than what it moves, and what the sum of two distances needs
    for column, used in ((0, 0.55), (1, 0.8)):
        holds(np.array(bounds)[:, column], np.array(truths)[:, column], used)


def test_joints_that_deviate_move_a_point_by_their_levers():
    """Two links in line: 0.6 m and 0.3 m from the axes, both joints off by 0.1 rad."""
    robot, off = planar_arm([0.3, 0.3]), np.array([[0.1, 0.1]])
    s = ArmMotion(robot, np.zeros((2, 2)), off).stretches(0, 2, np.array([0.3, 0.0, 0.0]), 0.0)
    ends = seen(robot, np.array([[0.0, 0.0], [0.1, 0.1]]), 0, 2, np.array([[0.3, 0.0, 0.0]]))
    holds(s.deviation[0], np.linalg.norm(ends[1] - ends[0]), 0.95)


def test_halves_are_placed_where_the_motion_is_and_bounded_like_the_whole():
    rng, point, truths, bounds = np.random.default_rng(3), np.array([0.1, 0.0, 0.2]), [], []
    rows = rng.normal(size=(4, 6))
    motion = ArmMotion(UR5, rows)
    whole = s = motion.stretches(1, 5, point, 0.0)
    for _ in range(3):
        s = motion.halves(s, 1, 5)
    places = sorted(zip(s.row.tolist(), s.share.tolist(), strict=True))
    assert places == [(row, k / 8) for row in range(3) for k in range(8)]
    assert s.length.tolist() == [0.125] * 24
    np.testing.assert_allclose(s.delta, whole.delta[s.row] / 64)
    np.testing.assert_allclose(s.moved, whole.moved[s.row] / 8)
    for k in range(len(s.row)):
        ends = np.array([s.share[k], s.share[k] + s.length[k]])[:, None]
        q = rows[s.row[k]] + ends * (rows[s.row[k] + 1] - rows[s.row[k]])
        expected = seen(UR5, q, 1, 5, point[None])[:, 0]
        found = np.vstack([s.first.moved(point)[k], s.last.moved(point)[k]])
        np.testing.assert_allclose(found, expected, atol=1e-12)
        truths.append(how_far(UR5, q, np.zeros((1, 6)), 1, 5, point[None], rng)[:2])
        bounds.append([s.delta[k], s.moved[k]])
    holds(bounds, truths, 0.6)


# the first look at all bodies


def some_bodies(rng, n):
    """Three of each joint, the root among them."""
    for joint in range(n + 1):
        for shape in (
            Box(tuple(rng.uniform(0.02, 0.3, 3).tolist())),
            Capsule(*rng.uniform(0.02, 0.2, 2).tolist()),
            Cylinder(*rng.uniform(0.02, 0.2, 2).tolist()),
        ):
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            yield Body(joint, piece_of(shape, at(*rng.uniform(-0.1, 0.1, 3), turn)), 0.0)


@pytest.mark.parametrize("step", [0.01, 0.2])
def test_no_first_bound_is_above_a_distance_and_boxes_tell_more_than_balls(step):
    rng, by_boxes, spare = np.random.default_rng(5), 0, []
    bodies = list(some_bodies(rng, 6))
    couples = [(a, b) for a in bodies for b in bodies if a.joint < b.joint]
    q = np.cumsum(np.vstack([rng.uniform(-1, 1, 6), step * rng.normal(size=(3, 6))]), axis=0)
    motion = ArmMotion(UR5, q)
    low = FirstLook(motion, CoupledBodies(couples)).low
    for k, (a, b) in enumerate(couples):
        for row in range(len(q) - 1):
            poses = [motion.pose(a.joint, b.joint, row, t) for t in np.linspace(0, 1, 9)]
            poses = [(pose.rotations[0], pose.points[0]) for pose in poses]
            found = min(coal_distance(a.piece, b.piece, *pose)[0] for pose in poses)
            spare.append(found + COAL - low[k, row])
            ahead = [turn @ b.piece.centre + place - a.piece.centre for turn, place in poses]
            balls = np.linalg.norm(ahead, axis=1).min() - a.piece.ball - b.piece.ball
            by_boxes += low[k, row] > balls + 1e-3
    assert min(spare) >= 0.0
    assert by_boxes > 20
    assert np.quantile(spare, 0.2) < 0.1


@pytest.mark.parametrize("ends", [(0.0, 0.75), (0.75, 0.0), (0.7, 0.75)])
def test_boxes_that_come_nearer_are_as_near_as_at_the_nearer_end(ends):
    """A box on a slide and one at rest, 1 m away, sides of 0.2 m: 0.05 m apart at the nearest."""
    box = piece_of(Box((0.2, 0.2, 0.2)), np.eye(4))
    wall = piece_of(Box((0.2, 0.2, 0.2)), at(1.0))
    motion = ArmMotion(planar_arm([0.1], ["prismatic"]), np.array(ends)[:, None])
    low = FirstLook(motion, CoupledBodies([(Body(0, wall, 0.0), Body(1, box, 0.0))])).low
    assert low[0, 0] == pytest.approx(0.05, abs=1e-9)


# planes that part two bodies


def wall_of(kind, place):
    """A ball, a box, or a plate of many triangles whose nearest point is at (x, y), m."""
    if kind == "triangles":
        side = np.linspace(-0.5, 0.5, 9)
        corners = np.array([[place[0], place[1] + y, z] for y in side for z in side])
        corners = corners.reshape(9, 9, 3)
        a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:], corners[1:, 1:]
        halves = [np.stack(half, axis=2).reshape(-1, 3, 3) for half in ((a, b, c), (b, d, c))]
        return sheet_piece(np.concatenate(halves), False)
    shape = Sphere(0.2) if kind == "ball" else Box((0.4, 1.0, 1.0))
    return piece_of(shape, at(place[0] + 0.2, place[1]))


@pytest.mark.parametrize("kind", ["ball", "box", "triangles"])
@pytest.mark.parametrize(
    ("first", "last", "off", "nearest"),
    [(-0.3, 0.3, 0.0, 1.0), (np.pi / 2, np.pi / 2, 0.05, np.sin(0.05)), (0.2, 0.0, 0.0, 1.0)],
    ids=["bulges", "deviates", "approaches"],
)
def test_a_ball_on_a_circle_comes_as_near_as_is_said(kind, first, last, off, nearest):
    """A ball of 0.1 m goes round at 1 m, up to x = `nearest`; the wall is 0.05 m beyond."""
    robot = robot_of([arm_urdfs.joint(1), arm_urdfs.joint(2, "fixed", (1, 0, 0))])
    b = piece_of(Sphere(0.1), at(1.0))
    a = wall_of(kind, (nearest + 0.15, np.sqrt(1.0 - nearest**2)))
    motion = ArmMotion(robot, np.array([[first], [last]]), np.array([[off]]))
    s = motion.stretches(0, 1, b.centre, b.ball)
    known = CoupledBodies([(Body(0, a, 0.0), Body(1, b, 0.0))])
    assert by_balls(a, b, s)[0] <= 0.05 + 1e-9
    assert FirstLook(motion, known).low[0, 0] <= 0.05 + 1e-9
    found = parted(a, b, s, np.array([-1.0, 0.0, 0.0]))[0]
    assert 0.04 <= found <= 0.05 + 1e-9
    assert kind != "ball" or by_balls(a, b, s)[0] >= 0.04


def dome(count):
    """A quarter of a sphere of radius 1 in 2 count^2 triangles."""
    made = of_patch(sphere(1.0, np.degrees((0.3, 1.5)), (0, 180), "outside"), count, count)
    return made.vertices[made.faces]


@pytest.mark.parametrize("count", [1, 3, 8, 20])
def test_every_triangle_is_in_its_boxes(count):
    triangles = dome(count)
    tree = TriangleTree(triangles)
    assert set(tree.last) == set(range(len(triangles)))
    of = np.arange(len(tree.last))
    for level in tree.levels[::-1]:
        apart = triangles[tree.last] - level.centres[of][:, None]
        along = np.abs(np.einsum("kci,kai->kca", apart, level.axes[of]))
        if level.triangles is None:
            assert (along <= level.halves[of][:, None] + 1e-12).all()
        else:
            assert (level.triangles[of] == triangles[tree.last]).all()
        assert (np.linalg.norm(apart, axis=2) <= level.balls[of][:, None] + 1e-12).all()
        of = of // 8


def test_the_point_of_a_tetrahedron_nearest_to_the_origin():
    """Against non-negative least squares; flat and thin ones, and the origin inside."""
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(300, 4, 3)) + rng.normal(size=(300, 1, 3))
    corners[::7, 3] = corners[::7, 2]
    corners[::11, 2] = corners[::11, 1]
    corners[::13, 3] = corners[::13, :3].mean(axis=1)
    points, spanned = nearest_of(corners)
    assert (points == 0.0).all(axis=1).any()
    for four, point, three in zip(corners, points, spanned, strict=True):
        weights = nnls(np.vstack([four.T, np.full(4, 1e4)]), np.array([0.0, 0.0, 0.0, 1e4]))[0]
        np.testing.assert_allclose(point, weights @ four / weights.sum(), atol=1e-6)
        if point.any():  # it is spanned by what is said to span it
            weights = np.linalg.lstsq(np.vstack([three.T, np.ones(3)]), np.append(point, 1.0))[0]
            np.testing.assert_allclose(weights @ three, point, atol=1e-9)


BODIES = (Box((0.1, 0.06, 0.3)), Sphere(0.05), Capsule(0.03, 0.2), Cylinder(0.04, 0.1))


@pytest.mark.parametrize("off", [0.0, 0.01])
@pytest.mark.parametrize("body", BODIES, ids=lambda body: type(body).__name__)
def test_bounds_of_many_triangles_are_never_above_the_distance_and_seldom_far_below(body, off):
    """A body that turns and slides inside a dome: coal at samples of each stretch."""
    rng = np.random.default_rng(3)
    robot = planar_arm([0.3, 0.4, 0.1], ["revolute", "revolute", "prismatic"])
    sheet, piece = sheet_piece(dome(20), False), piece_of(body, at(0.05))
    walk = np.cumsum(rng.normal(size=(60, 3)) * [0.08, 0.08, 0.02], axis=0)
    walk += [0.6, 0.3, 0.2]
    motion = ArmMotion(robot, walk, np.full((59, 3), [0.0, 0.0, off]))
    s = motion.stretches(0, 3, piece.centre, piece.ball)
    true = np.empty(len(s.row))
    for row in s.row:
        q = walk[row] + np.linspace(0, 1, 7)[:, None] * (walk[row + 1] - walk[row])
        moved = [q + np.array([0.0, 0.0, way * off]) for way in ((-1, 0, 1) if off else (0,))]
        one = ArmMotion(robot, np.concatenate(moved)).stretches(0, 3, piece.centre, 0.0)
        poses = [*zip(one.first.rotations, one.first.points, strict=True)]
        poses.append((one.last.rotations[-1], one.last.points[-1]))
        true[row] = min(coal_distance(sheet, piece, *pose)[0] for pose in poses)
    assert (rough_bounds(sheet.tree, piece, s) <= true + COAL).all()
    assert true.min() < 0.03 < 0.1 < true.max()  # or nothing is asked
    for aim in (0.03, 0.05, 0.1):
        descent = Descent(sheet.tree, piece, aim, aim)
        left, near = set(descent.parted(s).at), set(np.flatnonzero(true < aim))
        assert aim <= descent.bound
        assert near <= left  # nothing is called clear that is not
        lost = s.delta + s.deviation  # what chords may be off
        assert not {k for k in left - near if true[k] - 2.0 * lost[k] > 1.01 * aim}


@pytest.mark.parametrize("off", [0.0, 0.05])
def test_a_ball_before_small_triangles_is_nearer_where_it_deviates(off):
    """A ball of 0.1 m on a slide, and triangles of 1 mm, 1 m ahead of it."""
    corners = np.random.default_rng(0).uniform(-5e-4, 5e-4, (20, 3, 3)) + np.array([1.0, 0.0, 0.0])
    sheet, ball = sheet_piece(corners, False), piece_of(Sphere(0.1), np.eye(4))
    motion = ArmMotion(planar_arm([0.1], ["prismatic"]), np.zeros((2, 1)), np.array([[off]]))
    s = motion.stretches(0, 1, ball.centre, ball.ball)
    assert 0.89 - off < rough_bounds(sheet.tree, ball, s)[0] <= 0.9 - off
    for aim, left in ((0.88 - off, 0), (0.91 - off, 20)):
        assert len(set(Descent(sheet.tree, ball, aim, aim).parted(s).boxes)) == left


# distances alone


@pytest.mark.parametrize("needed", [0.05, 0.079, 0.081, 0.2])
def test_distances_alone_certify_what_is_there_between_rows_and_no_more(needed):
    """A body that comes as near as 0.08 m in the middle, by as much as its points move at most."""

    def measured(row, share):
        return 0.08 + 0.3 * abs(share - 0.5)

    rows, wanted = np.zeros(1, dtype=np.intp), np.array([needed])
    budget = Budget(measured, np.array([0.3]), 1000)
    if needed > 0.08:
        with pytest.raises(TooNear):
            budget.certify(rows, wanted, 1.0)
    else:
        assert needed <= budget.certify(rows, wanted, 1.0) <= 0.08
    with pytest.raises(TooNear):
        Budget(measured, np.array([0.3]), 2).certify(rows, wanted, 1.0)


def test_a_distance_at_one_row_holds_at_others_but_for_the_way():
    """Five rows 0.1 m apart, on a straight way to a wall that the last one is 0.02 m from."""
    asked = []

    def measured(row, share):
        asked.append(row + share)
        return 0.42 - 0.1 * (row + share)

    rows = np.arange(4, dtype=np.intp)
    found = Budget(measured, np.full(4, 0.1), 1000).certify(rows, np.full(4, 0.01), 0.015)
    assert 0.01 <= found <= 0.02
    with pytest.raises(TooNear):
        Budget(measured, np.full(4, 0.1), 1000).certify(rows, np.full(4, 0.03), 0.03)
