"""Whether an arm covers a plane with its orientation fixed, or only its roll free within a range.

Closed-form inverse kinematics gives all branches for every pose: of the UR5 from its three parallel
axes, of the PUMA from its wrist centre. With the windings that the limits allow they are nodes over
each cell, at every roll of a few, followed through poses in between to the neighbouring cells. What
is joined is one component, and the best one tells how many cells a motion covers. Nothing here is
shared with the packages under test but Pinocchio's placements of the wrist.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from puma_oracle import arms
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from ur5_oracle import D1, D4, D5, D6, L2, L3

from robots import Kinematics, Robot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BETWEEN = 12  # poses between neighbouring cells
ROLL_STEP = np.radians(3.0)  # of rolls in a range, at most
JUMP = 0.6  # [rad] of any joint between neighbouring poses, at most
TAU = 2.0 * np.pi
SIGNS = np.array([1.0, -1.0])


class Poses(NamedTuple):
    """k poses of the tool."""

    points: Floats
    """(k, 3) m."""
    frames: Floats
    """(k, 3, 3) x, y and z of the tool as columns."""


@dataclass(frozen=True)
class Question:
    """An arm over the cells of a plane."""

    robot: Robot
    targets: Floats
    """(N, 3) m."""
    pairs: Ints
    """(M, 2) neighbouring cells."""
    axis: Floats
    """(3,) where the tool's z axis points."""
    reference: Floats
    """(3,) where its x axis points at a roll of 0; square to the axis."""
    rolls: tuple[float, float]
    """rad, the least and the largest."""

    def frames(self) -> Floats:
        """(r, 3, 3) of the tool, at rolls from the least to the largest."""
        low, high = self.rolls
        rolls = np.linspace(low, high, int(np.ceil((high - low) / ROLL_STEP)) + 1)
        aside = np.cross(self.axis, self.reference)
        x = np.cos(rolls)[:, None] * self.reference + np.sin(rolls)[:, None] * aside
        z = np.broadcast_to(self.axis, x.shape)
        return np.stack([x, np.cross(z, x), z], axis=2)


def covered(question: Question, slack: float) -> int:
    """The most cells that one motion covers, with limits wider by `slack` (rad)."""
    frames = question.frames()
    every = question.targets, question.pairs
    nodes = [[_nodes(question, target, frame, slack) for frame in frames] for target in every[0]]
    first = np.cumsum([0] + [len(q) for rows in nodes for q in rows])
    at = {
        (cell, roll): first[cell * len(frames) + roll]
        for cell in range(len(nodes))
        for roll in range(len(frames))
    }
    joined = []
    for cell, roll in itertools.product(range(len(nodes)), range(len(frames) - 1)):
        links = _links(nodes[cell][roll], nodes[cell][roll + 1])
        joined.append(links + np.array([at[cell, roll], at[cell, roll + 1]]))
    for a, b in question.pairs:
        for roll, frame in enumerate(frames):
            way = np.linspace(question.targets[a], question.targets[b], BETWEEN + 2)[1:-1]
            links = _followed(question, nodes[a][roll], way, frame, nodes[b][roll], slack)
            joined.append(links + np.array([at[a, roll], at[b, roll]]))
    count = int(first[-1])
    if count == 0:
        return 0
    ends = np.concatenate([np.empty((0, 2), dtype=np.int64), *joined])
    graph = coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    owner = np.repeat(np.arange(len(nodes)), [sum(map(len, rows)) for rows in nodes])
    both = np.unique(np.column_stack([label, owner]), axis=0)
    return int(np.bincount(both[:, 0]).max())


def _followed(
    question: Question, q: Floats, way: Floats, frame: Floats, last: Floats, slack: float
) -> Ints:
    """(k, 2) which configurations lead along poses to which others."""
    start = np.arange(len(q))
    for target in way:
        found = _nodes(question, target, frame, slack)
        links = _links(q, found)
        start, q = start[links[:, 0]], found[links[:, 1]]
    links = _links(q, last)
    return np.column_stack([start[links[:, 0]], links[:, 1]])


def _links(a: Floats, b: Floats) -> Ints:
    """(k, 2) configurations a (m, n) and b (l, n) that are next to each other: the nearest ones."""
    if not len(a) or not len(b):
        return np.empty((0, 2), dtype=np.int64)
    apart = np.abs(a[:, None] - b[None]).max(axis=2)
    near = np.argmin(apart, axis=1)
    rows = np.flatnonzero(apart[np.arange(len(a)), near] <= JUMP)
    return np.column_stack([rows, near[rows]])


def _nodes(question: Question, point: Floats, frame: Floats, slack: float) -> Floats:
    """(m, n) all configurations within the limits, windings apart."""
    robot = question.robot
    solve = ur5 if robot.name == "ur5" else puma
    found = solve(robot, Poses(point[None], frame[None]))
    low, high = robot.lower - slack, robot.upper + slack
    every = []
    for q in found:
        turns = [
            q[j] + TAU * np.arange(np.ceil((low[j] - q[j]) / TAU), (high[j] - q[j]) // TAU + 1)
            for j in range(robot.n)
        ]
        every += list(itertools.product(*turns))
    return np.array(every).reshape(-1, robot.n)


def ur5(robot: Robot, poses: Poses) -> Floats:
    """(m, 6) all configurations of a UR5 at one pose, mod 2 pi."""
    (p,), (frame,) = poses
    a, found = frame[:, 2], []
    wrist = p - D6 * a
    square = wrist[0] ** 2 + wrist[1] ** 2 - D4**2
    for s, t, e in itertools.product(SIGNS, SIGNS, SIGNS) if square > 0.0 else ():
        q = np.zeros(6)
        q[0] = np.arctan2(wrist[1], wrist[0]) - np.arctan2(D4, s * np.sqrt(square))
        c1, s1 = np.cos(q[0]), np.sin(q[0])
        q[4] = t * np.arccos(np.clip(c1 * a[1] - s1 * a[0], -1.0, 1.0))
        s5 = np.sin(q[4])
        if abs(s5) < 1e-9:
            continue
        psi = np.arctan2(-a[2] / s5, (c1 * a[0] + s1 * a[1]) / s5)
        along = c1 * wrist[0] + s1 * wrist[1] + D5 * np.sin(psi)
        drop = -(wrist[2] - D1 + D5 * np.cos(psi))
        cosine = (along**2 + drop**2 - L2**2 - L3**2) / (2.0 * L2 * L3)
        if abs(cosine) > 1.0:
            continue
        q[2] = e * np.arccos(cosine)
        q[1] = np.arctan2(drop, along) - np.arctan2(L3 * np.sin(q[2]), L2 + L3 * np.cos(q[2]))
        q[3] = psi - q[1] - q[2]
        q[5] = _last(robot, q, frame)
        found.append(q)
    return np.array(found).reshape(-1, 6)


def _last(robot: Robot, q: Floats, frame: Floats) -> float:
    """The last joint, about the tool's z, that brings x to the frame's; the others are right."""
    joints = _kinematics(robot).joints(np.array(q)[None]).rotations[0, -1]
    tool = robot.model.frames[robot.tool_frame_id].placement.rotation
    x = joints @ tool[:, 0]
    return float(np.arctan2(np.cross(x, frame[:, 0]) @ frame[:, 2], x @ frame[:, 0]))


def puma(robot: Robot, poses: Poses) -> Floats:
    """(m, 6) all configurations of the PUMA at one pose, mod 2 pi; its tool is at its wrist."""
    (p,), (frame,) = poses
    placements = [placement.rotation for placement in robot.model.jointPlacements]
    tool = robot.model.frames[robot.tool_frame_id].placement.rotation
    kinematics, found = _kinematics(robot), []
    for first in arms(p[None])[0]:
        q = np.concatenate([first, np.zeros(3)])
        if np.linalg.norm(kinematics.tool(q)[0] - p) > 1e-9:
            continue  # out of reach
        turn = (kinematics.joints(q[None]).rotations[0, 3] @ placements[4]).T @ frame @ tool.T
        found += [np.concatenate([first, wrist]) for wrist in _wrist(placements, turn)]
    return np.array(found).reshape(-1, 6)


def _wrist(placements: list[Floats], turn: Floats) -> list[Floats]:
    """Angles with turn = Rz(q4) P5 Rz(q5) P6 Rz(q6), where P5 and P6 tilt z by a right angle."""
    fifth, sixth = placements[5], placements[6]
    z = sixth[:, 2]  # the last axis, before the fifth joint turns
    # z-component of P5 Rz(q5) z: A cos q5 + B sin q5 + C.
    row = fifth[2]
    a, b = row[0] * z[0] + row[1] * z[1], row[1] * z[0] - row[0] * z[1]
    rest, size = turn[2, 2] - row[2] * z[2], np.hypot(a, b)
    if abs(rest) > size:
        return []
    found = []
    for sign in SIGNS:
        q5 = np.arctan2(b, a) + sign * np.arccos(rest / size)
        bent = fifth @ _about_z(q5) @ sixth
        if np.hypot(bent[0, 2], bent[1, 2]) < 1e-9:
            continue
        q4 = np.arctan2(turn[1, 2], turn[0, 2]) - np.arctan2(bent[1, 2], bent[0, 2])
        last = (_about_z(q4) @ bent).T @ turn
        found.append(np.array([q4, q5, np.arctan2(last[1, 0], last[0, 0])]))
    return found


@cache
def _kinematics(robot: Robot) -> Kinematics:
    return Kinematics(robot)


def _about_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
