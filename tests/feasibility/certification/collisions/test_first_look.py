"""The judge's first look at all bodies: its bounds against coal's distances along motions."""

from __future__ import annotations

import numpy as np
import pytest

from feasibility.certification.collisions.first_look import Body, CoupledBodies, FirstLook
from feasibility.certification.collisions.pieces import COAL, coal_distance
from feasibility.certification.collisions.relative_motion import ArmMotion
from feasibility.certification.collisions.shape_pieces import piece_of
from feasibility.collisions import HalfSpace
from robots import load_robot
from robots.urdf import Box, Capsule, Cylinder

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
