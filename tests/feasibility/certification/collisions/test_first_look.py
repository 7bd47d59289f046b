"""The judge's first look at all bodies: its bounds against coal's distances along motions."""

from __future__ import annotations

import arm_urdfs
import numpy as np
import pytest
from random_arms import robot_of

from feasibility.certification.collisions.first_look import Body, CoupledBodies, FirstLook
from feasibility.certification.collisions.parting import by_balls, parted
from feasibility.certification.collisions.pieces import COAL, coal_distance
from feasibility.certification.collisions.relative_motion import ArmMotion
from feasibility.certification.collisions.shape_pieces import piece_of, sheet_piece
from feasibility.collisions import HalfSpace
from robots import load_robot
from robots.urdf import Box, Capsule, Cylinder, Sphere

SHARES = np.linspace(0.0, 1.0, 9)


def bodies(rng, n):
    """Three of each joint, the root among them."""
    for joint in range(n + 1):
        for shape in (
            Box(tuple(rng.uniform(0.02, 0.3, 3).tolist())),
            Capsule(*rng.uniform(0.02, 0.2, 2).tolist()),
            Cylinder(*rng.uniform(0.02, 0.2, 2).tolist()),
        ):
            placement = np.eye(4)
            placement[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            placement[:3, 3] = rng.uniform(-0.1, 0.1, 3)
            yield Body(joint, piece_of(shape, placement), 0.0)


@pytest.mark.parametrize("step", [0.01, 0.2])
def test_no_bound_is_above_a_distance_and_boxes_tell_more_than_balls(step):
    rng, robot = np.random.default_rng(5), load_robot("ur5")
    all_bodies = list(bodies(rng, robot.n))
    couples = [(a, b) for a in all_bodies for b in all_bodies if a.joint < b.joint]
    q = np.cumsum(np.vstack([rng.uniform(-1, 1, 6), step * rng.normal(size=(3, 6))]), axis=0)
    motion = ArmMotion(robot, q)
    low = FirstLook(motion, CoupledBodies(couples)).low
    spare, by_boxes = [], 0
    for k, (a, b) in enumerate(couples):
        for row in range(len(q) - 1):
            poses = [motion.pose(a.joint, b.joint, row, share) for share in SHARES]
            poses = [(pose.rotations[0], pose.points[0]) for pose in poses]
            found = min(coal_distance(a.piece, b.piece, *pose)[0] for pose in poses)
            spare.append(found + COAL - low[k, row])
            ahead = [turn @ b.piece.centre + at - a.piece.centre for turn, at in poses]
            balls = np.linalg.norm(ahead, axis=1).min() - a.piece.ball - b.piece.ball
            by_boxes += low[k, row] > balls + 1e-3
    assert min(spare) >= 0.0
    assert by_boxes > 20
    assert np.quantile(spare, 0.2) < 0.1


def test_of_what_has_no_end_nothing_is_told():
    robot = load_robot("ur5")
    ground = Body(0, piece_of(HalfSpace(), np.eye(4), at_rest=True), 0.0)
    thing = Body(3, piece_of(Box((0.1, 0.1, 0.1)), np.eye(4)), 0.0)
    motion = ArmMotion(robot, np.array([np.zeros(6), np.full(6, 0.1)]))
    low = FirstLook(motion, CoupledBodies([(ground, thing)])).low
    assert (low == -np.inf).all()


def wall_of(kind, at):
    """A ball, a box, or a plate of many triangles whose nearest point is at (x, y), m."""
    place = np.eye(4)
    place[:2, 3] = at
    if kind == "triangles":
        side = np.linspace(-0.5, 0.5, 9)
        corners = np.array([[at[0], at[1] + y, z] for y in side for z in side]).reshape(9, 9, 3)
        a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:], corners[1:, 1:]
        halves = [np.stack(half, axis=2).reshape(-1, 3, 3) for half in ((a, b, c), (b, d, c))]
        return sheet_piece(np.concatenate(halves), False)
    place[0, 3] += 0.2
    return piece_of(Sphere(0.2) if kind == "ball" else Box((0.4, 1.0, 1.0)), place)


@pytest.mark.parametrize("kind", ["ball", "box", "triangles"])
@pytest.mark.parametrize(
    ("first", "last", "off", "nearest"),
    [(-0.3, 0.3, 0.0, 1.0), (np.pi / 2, np.pi / 2, 0.05, np.sin(0.05)), (0.2, 0.0, 0.0, 1.0)],
    ids=["bulges", "deviates", "approaches"],
)
def test_a_ball_on_a_circle_comes_as_near_as_is_said(kind, first, last, off, nearest):
    """A ball of 0.1 m goes round at 1 m, up to x = `nearest`; the wall is 0.05 m beyond."""
    robot, place = robot_of([arm_urdfs.joint(1), arm_urdfs.joint(2, "fixed", (1, 0, 0))]), np.eye(4)
    place[0, 3] = 1.0
    b = piece_of(Sphere(0.1), place)
    a = wall_of(kind, (nearest + 0.15, np.sqrt(1.0 - nearest**2)))
    motion = ArmMotion(robot, np.array([[first], [last]]), np.array([[off]]))
    s = motion.stretches(0, 1, b.centre, b.ball)
    known = CoupledBodies([(Body(0, a, 0.0), Body(1, b, 0.0))])
    assert by_balls(a, b, s)[0] <= 0.05 + 1e-9
    assert FirstLook(motion, known).low[0, 0] <= 0.05 + 1e-9
    found = parted(a, b, s, np.array([-1.0, 0.0, 0.0]))[0]
    assert 0.04 <= found <= 0.05 + 1e-9
    assert kind != "ball" or by_balls(a, b, s)[0] >= 0.04
