"""100 random planes with a fixed orientation or a range of rolls, against closed-form kinematics.

The oracle looks at straight ways between centres with the axis along the normal, and at rolls on a
grid. With limits a little narrower what it covers can be covered; with limits a little wider, what
it does not can not, up to what a cone of half a degree and the tolerance allow: next to the wrist's
singularity, where two of its axes are one line, that is a way from one branch to another. So every
motion is also held against Pinocchio's placements, at many places.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from roll_oracle import Poses, Question, covered, puma, ur5

from feasibility import Answer, Search, Task, check, verify
from feasibility.verdict import Evidence
from robots import Kinematics, load_robot
from surfaces import plane

SLACK = np.radians(2.0)
COUNT = 50  # of each arm
FIXED_DEG = 0.5


def question(arm, seed):
    """(robot, cells, task, question) at random."""
    rng = np.random.default_rng([seed, len(arm)])
    robot = load_robot(arm)
    near, far = (0.3, 0.7) if arm == "ur5" else (0.5, 1.0)
    angle, out = rng.uniform(-np.pi, np.pi), rng.uniform(near, far)
    size = rng.uniform(0.05, 0.25) * (1.0 if arm == "ur5" else 1.5)
    place = (out * np.cos(angle), out * np.sin(angle), rng.uniform(-0.1, 0.4))
    turn = (*rng.uniform(-25, 25, 2), rng.uniform(-180, 180))
    patch = plane((-size, size), (-size, size), position=place, rpy_deg=turn, side="outside")
    middle = rng.uniform(-180, 180)
    half = FIXED_DEG if rng.random() < 0.6 else rng.uniform(2.0, 12.0)
    task = Task(0.005, FIXED_DEG, roll_deg=(middle - half, middle + half))
    limits = {}
    for j in rng.choice(robot.n, rng.integers(0, 4), replace=False):
        width = rng.uniform(1.5, 4.5)
        centre = rng.uniform(-1.5, 1.5)
        low, high = max(robot.lower[j], centre - width / 2), min(robot.upper[j], centre + width / 2)
        if low < high:
            limits[robot.joint_names[j]] = (low, high)
    robot, cells = robot.with_limits(limits), patch.cells(4, 4)
    targets = task.targets(cells)
    axis, reference = targets.approaches[0], targets.references[0]
    # What the cone allows is not the oracle's; of the range of rolls it looks at all but that.
    rolls = tuple(np.radians([middle - half + FIXED_DEG, middle + half - FIXED_DEG]))
    rolls = rolls if half > 1.0 else (np.radians(middle),) * 2
    return robot, cells, task, Question(robot, targets.points, cells.pairs, axis, reference, rolls)


def sampled(q):
    """50 configurations between each two of a motion, (k, n) rad."""
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    return np.concatenate([a + shares * (b - a) for a, b in pairwise(q)])


def holds_everywhere(robot, cells, task, motion):
    """Whether tool point, cone, roll and limits hold at all these, and each centre is reached."""
    kinematics, targets = Kinematics(robot), task.targets(cells)
    b, r = targets.approaches[0], targets.references[0]
    rotations = kinematics.joints(motion).rotations[:, -1]
    frames = rotations @ robot.model.frames[robot.tool_frame_id].placement.rotation
    points, (x, y, a) = kinematics.tools(motion)[0], np.moveaxis(frames, 2, 0)
    # Swing-twist: the least rotation that takes a to b, and the angle of x about b after it.
    roll = np.degrees(np.arctan2(x @ np.cross(b, r) - y @ r, x @ r + y @ np.cross(b, r)))
    low, high = task.roll_deg
    off = np.abs((roll - (low + high) / 2 + 180) % 360 - 180)
    tilt = np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0)))
    reached = np.linalg.norm(points[:, None] - targets.points, axis=2).min(axis=0)
    return (
        (motion >= robot.lower - 1e-9).all()
        and (motion <= robot.upper + 1e-9).all()
        and (np.abs((points - targets.points[0]) @ b) <= 1e-3).all()
        and (tilt <= task.cone_deg).all()
        and (off <= (high - low) / 2).all()
        and (reached <= 1e-3).all()
    )


@pytest.mark.parametrize("arm", ["ur5", "puma560"])
def test_the_oracle_knows_every_configuration(arm):
    rng, robot = np.random.default_rng(1), load_robot(arm)
    kinematics, solve = Kinematics(robot), ur5 if arm == "ur5" else puma
    tool = robot.model.frames[robot.tool_frame_id].placement.rotation
    for _ in range(60):
        q = rng.uniform(-3.0, 3.0, robot.n)
        point, _ = kinematics.tool(q)
        frame = kinematics.joints(q[None]).rotations[0, -1] @ tool
        found = solve(robot, Poses(point[None], frame[None]))
        apart = np.abs((found - q + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
        assert apart.min() < 1e-6
        assert len(found) <= 8
        frames = kinematics.joints(found).rotations[:, -1] @ tool
        assert np.abs(frames - frame).max() < 1e-7
        assert np.abs(kinematics.tools(found)[0] - point).max() < 1e-7


@pytest.mark.parametrize("seed", range(COUNT))
@pytest.mark.parametrize("arm", ["ur5", "puma560"])
def test_verdicts_agree_with_closed_form_kinematics(arm, seed):
    robot, cells, task, asked = question(arm, seed)
    verdict = check(robot, cells, task, Search(seed=0))
    if verdict.feasible:
        assert verify(verdict).holds
        motion = sampled(verdict.witness.q)
        assert holds_everywhere(robot, cells, task, motion)
        from_singularity = np.abs(np.sin(motion[:, 4])).min()
        if from_singularity > np.sin(np.radians(FIXED_DEG)):
            assert covered(asked, SLACK) == len(cells), verdict.message
    if verdict.answer is Answer.INFEASIBLE:
        slack = 0.0 if verdict.evidence is Evidence.PROOF else -SLACK
        assert covered(asked, slack) < len(cells), verdict.message
    assert verdict.answer is not Answer.UNDECIDED, verdict.message


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("arm", ["ur5", "puma560"])
def test_a_wider_range_never_covers_less(arm, seed):
    robot, cells, task, _ = question(arm, seed)
    low, high = task.roll_deg
    wider = replace(task, roll_deg=(low - 5.0, high + 5.0))
    free = replace(task, roll_deg=None)
    answers = [check(robot, cells, one, Search(seed=0)).answer for one in (task, wider, free)]
    feasible = [answer is Answer.FEASIBLE for answer in answers]
    assert feasible == sorted(feasible), answers
