"""How far bodies move between rows: the bounds against dense samples of their points."""

from __future__ import annotations

import numpy as np
import pytest
from capsule_arms import planar_arm

from feasibility.certification.collisions.relative_motion import ArmMotion
from robots import Kinematics, load_robot

SAMPLES = 40


def seen(kinematics, q, a, b, points):
    """Points (k, 3) of joint b as seen from joint a, at configurations q (m, n)."""
    frames = kinematics.joints(q)
    world = np.einsum("mij,kj->mki", frames.rotations[:, b], points) + frames.points[:, None, b]
    return np.einsum("mji,mkj->mki", frames.rotations[:, a], world - frames.points[:, None, a])


def arms(rng):
    """The UR5, and random chains with sliding joints along and across."""
    yield load_robot("ur5")
    for _ in range(3):
        kinds = rng.choice(["revolute", "revolute", "prismatic"], 5).tolist()
        axes = [tuple(np.round(rng.normal(size=3), 3).tolist()) for _ in kinds]
        yield planar_arm(rng.uniform(0.1, 0.6, 5).tolist(), kinds, axes)


@pytest.mark.parametrize("step", [0.001, 0.03, 0.5])
def test_no_point_moves_or_leaves_its_chord_further(step):
    rng, tightest = np.random.default_rng(7), np.zeros(3)
    for robot in arms(rng):
        kinematics, q = Kinematics(robot), rng.uniform(-2, 2, robot.n)
        for _ in range(12):
            a, b = np.sort(rng.choice(robot.n + 1, 2, replace=False)).tolist()
            rows = np.vstack([q, q + step * rng.normal(size=robot.n)])
            centre, ball = rng.normal(size=3) * 0.3, rng.uniform(0.01, 0.3)
            deviations = step * 0.2 * rng.random((1, robot.n))
            s = ArmMotion(robot, rows, deviations).stretches(a, b, centre, ball)
            around = rng.normal(size=(60, 3))
            points = centre + ball * around / np.linalg.norm(around, axis=1, keepdims=True)
            t = np.linspace(0, 1, SAMPLES + 1)[:, None]
            straight = rows[0] + t * (rows[1] - rows[0])
            at = seen(kinematics, straight, a, b, points)
            chords = at[0] + t[:, :, None] * (at[-1] - at[0])
            bent = straight + rng.choice([-1, 1], (SAMPLES + 1, robot.n)) * deviations
            off = seen(kinematics, bent, a, b, points)
            shares = [
                np.linalg.norm(at - chords, axis=2).max() - s.delta[0],
                np.linalg.norm(at - at[0], axis=2).max() - s.moved[0],
                np.linalg.norm(off - at, axis=2).max() - s.deviation[0],
            ]
            assert max(shares) <= 1e-12
            true = [np.linalg.norm(at - chords, axis=2).max(), np.linalg.norm(at - at[0], axis=2)]
            bounds = np.array([s.delta[0], s.moved[0], s.deviation[0]])
            far = [true[0], true[1].max(), np.linalg.norm(off - at, axis=2).max()]
            tightest = np.maximum(tightest, np.array(far) / np.maximum(bounds, 1e-300))
            q = q + step * rng.normal(size=robot.n)
    # The bounds are attained nearly: one of another factor would be noticed.
    assert (tightest > 0.6).all()


def test_halves_are_placed_where_the_motion_is_and_bounded_like_the_whole():
    rng = np.random.default_rng(3)
    robot = load_robot("ur5")
    rows = rng.normal(size=(4, 6))
    motion = ArmMotion(robot, rows)
    s = motion.stretches(1, 5, np.array([0.1, 0.0, 0.2]), 0.1)
    for _ in range(3):
        s = motion.halves(s, 1, 5)
    assert len(s.row) == 24
    assert s.length.tolist() == [0.125] * 24
    np.testing.assert_allclose(s.delta, motion.stretches(1, 5, *BALL).delta[s.row] / 64)
    np.testing.assert_allclose(s.moved, motion.stretches(1, 5, *BALL).moved[s.row] / 8)
    point = np.array([[0.1, 0.2, 0.3]])
    for share, poses in ((s.share, s.first), (s.share + s.length, s.last)):
        q = rows[s.row] + share[:, None] * (rows[s.row + 1] - rows[s.row])
        expected = seen(Kinematics(robot), q, 1, 5, point)[:, 0]
        np.testing.assert_allclose(poses.moved(point[0]), expected, atol=1e-12)
    assert sorted(zip(s.row, s.share, strict=True)) == [
        (r, k / 8) for r in range(3) for k in range(8)
    ]


BALL = (np.array([0.1, 0.0, 0.2]), 0.1)
