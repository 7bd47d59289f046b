"""The ladder that many write themselves: closed-form IK at every pose, and a shortest path.

EAIK's solutions at each pose are the rungs; two at neighbouring poses are joined at the cost of
their distance in joint space. Nothing is asked of the way between them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from foreign_replay import chain, placed
from squares import BASE, TIP, Floats, Square

PACKAGE = "eaik"
NOTHING = "no solution at {} of 90 poses"
FOUND = "a path, rungs {:.3g} deg apart at most"


def shortest_way(rungs: Sequence[Floats]) -> list[int]:
    """Of each rung the vertex that the shortest path from the first rung to the last goes through.

    Args:
        rungs: (k, n) joint values of each pose, k at least 1.
    """
    cost, before = np.zeros(len(rungs[0])), list[Floats]()
    for here, there in pairwise(rungs):
        apart = np.linalg.norm(there[:, None] - here[None], axis=2) + cost
        before.append(apart.argmin(axis=1))
        cost = apart.min(axis=1)
    way = [int(cost.argmin())]
    for back in reversed(before):
        way.append(int(back[way[-1]]))
    return way[::-1]


def within(q: Floats, low: Floats, high: Floats) -> Floats:
    """The rows inside limits, with each joint taken in (-pi, pi]."""
    turned = np.pi - np.mod(np.pi - q, 2.0 * np.pi)
    return turned[((turned >= low) & (turned <= high)).all(axis=1)]


def prepare(square: Square, urdf: str) -> Callable[[], tuple[str, Floats | None]]:
    """What answers the question."""
    from eaik.IK_URDF import UrdfRobot

    joints = chain(urdf, BASE, TIP)
    turning = [joint for joint in joints if joint.axis is not None]
    low, high = (np.array([getattr(joint, end) for joint in turning]) for end in ("low", "high"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf)
        robot = UrdfRobot(str(path))
    zero = np.zeros(len(turning))
    # EAIK's own last frame is fixed to the last link, and so is ours to it.
    offset = np.linalg.inv(placed(joints, zero[None])[0]) @ robot.fwdKin(zero)

    def answer() -> tuple[str, Floats | None]:
        rungs = []
        for point in square.points():
            poses = np.broadcast_to(np.eye(4), (len(square.rotations()), 4, 4)).copy()
            poses[:, :3, :3], poses[:, :3, 3] = square.rotations(), point
            found = [np.empty((0, len(turning)))]
            for one in robot.IK_batched(poses @ offset):
                exact = ~np.array(one.is_LS, dtype=bool)
                found.append(np.reshape(one.Q, (-1, len(turning)))[exact])
            rungs.append(within(np.concatenate(found), low, high))
        missing = sum(len(rung) == 0 for rung in rungs)
        if missing:
            return NOTHING.format(missing), None
        q = np.array([rung[k] for rung, k in zip(rungs, shortest_way(rungs), strict=True)])
        return FOUND.format(np.degrees(np.abs(np.diff(q, axis=0)).max())), q

    return answer
