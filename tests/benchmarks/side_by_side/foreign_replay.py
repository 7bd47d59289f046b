"""What the joint values that a tool returns do, measured in one way for all tools.

The arm's kinematics are read from the URDF and written out here, in numpy: none of the tools has a
part in them. Between the rows that a tool returns, every joint runs straight.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
STEP = np.radians(0.2)  # of a joint between two looks


class Joint(NamedTuple):
    """A joint of the chain, between its own frame and its parent's."""

    name: str
    origin: Floats
    """(4, 4)."""
    axis: Floats | None
    """(3,) of a joint that turns; None of one that is fixed."""
    low: float
    high: float


class Measured(NamedTuple):
    """The largest of each along the whole motion, beside what was asked for."""

    missed_mm: float
    """Distance of a pose from the nearest place of the tool point."""
    line_mm: float
    """Distance of the tool point from the straight lines between poses, in their order."""
    plane_mm: float
    """Height of the tool point above or below the square."""
    tilt_deg: float
    """Angle between the tool's axis and straight down."""
    roll_deg: float
    """Angle of the tool about its axis, from the roll that is asked for where it is fixed."""
    step_deg: float
    """Of one joint, from one row to the next."""
    beyond_deg: float
    """Of one joint, beyond its limits."""


def chain(urdf: str, base: str, tip: str) -> list[Joint]:
    """The joints from one link to another, in that order."""
    by_child = {
        joint.find("child").get("link"): joint
        for joint in ElementTree.fromstring(urdf).iter("joint")
    }
    found, link = list[Joint](), tip
    while link != base:
        joint = by_child[link]
        found.append(_joint(joint))
        link = joint.find("parent").get("link")
    return found[::-1]


def _joint(given: ElementTree.Element) -> Joint:
    origin, fixed = np.eye(4), given.get("type") == "fixed"
    placed, axis, limit = given.find("origin"), given.find("axis"), given.find("limit")
    if placed is not None:
        origin[:3, 3] = [float(x) for x in placed.get("xyz", "0 0 0").split()]
        angles = [float(x) for x in placed.get("rpy", "0 0 0").split()]
        origin[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    along = [float(x) for x in ("1 0 0" if axis is None else axis.get("xyz", "1 0 0")).split()]
    ends = [0.0, 0.0] if limit is None else [float(limit.get(k, "0")) for k in ("lower", "upper")]
    name = given.get("name", "")
    return Joint(name, origin, None if fixed else np.array(along) / np.linalg.norm(along), *ends)


def placed(joints: list[Joint], q: Floats) -> Floats:
    """(k, 4, 4) of the last link, for (k, n) values of the joints that turn, rad."""
    pose, column = np.broadcast_to(np.eye(4), (len(q), 4, 4)), 0
    for joint in joints:
        pose = pose @ joint.origin
        if joint.axis is not None:
            turn = np.broadcast_to(np.eye(4), (len(q), 4, 4)).copy()
            turned = Rotation.from_rotvec(q[:, column, None] * joint.axis)
            turn[:, :3, :3] = turned.as_matrix()
            pose, column = pose @ turn, column + 1
    return np.asarray(pose)


def dense(q: Floats) -> Floats:
    """Rows on the straight lines between rows of joint values, `STEP` apart at most."""
    pieces = [q[:1]]
    for here, there in pairwise(q):
        count = max(int(np.ceil(np.abs(there - here).max() / STEP)), 1)
        share = np.arange(1, count + 1)[:, None] / count
        pieces.append(here + share * (there - here))
    return np.concatenate(pieces)


def off_the_lines(points: Floats, corners: Floats) -> Floats:
    """(k,) distances of points from the nearest of the lines that join corners."""
    begin, along = corners[:-1], np.diff(corners, axis=0)
    found = np.full(len(points), np.inf)
    for start, line in zip(begin, along, strict=True):
        share = np.clip((points - start) @ line / (line @ line), 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(points - start - share[:, None] * line, axis=1))
    return found


def measured(joints: list[Joint], q: Floats, poses: Floats, rotation: Floats | None) -> Measured:
    """Replay joint values against poses.

    Args:
        joints: of the chain.
        q: (k, n) rad, as a tool returned them.
        poses: (N, 3) m, points to go to.
        rotation: (3, 3) of the tool where all of it is fixed; None where its roll is free.
    """
    turning = [joint for joint in joints if joint.axis is not None]
    looked = dense(q)
    at = placed(joints, looked)
    points, axes = at[:, :3, 3], at[:, :3, 2]
    missed = max(np.linalg.norm(points - pose, axis=1).min() for pose in poses)
    tilt = np.arctan2(np.linalg.norm(axes[:, :2], axis=1), -axes[:, 2]).max()
    roll = 0.0
    if rotation is not None:
        x = at[:, :3, 0] @ rotation
        roll = np.abs(np.arctan2(x[:, 1], x[:, 0])).max()
    low, high = (np.array([getattr(joint, end) for joint in turning]) for end in ("low", "high"))
    beyond = max(float((low - looked).max()), float((looked - high).max()), 0.0)
    return Measured(
        missed_mm=1e3 * missed,
        line_mm=1e3 * off_the_lines(points, poses).max(),
        plane_mm=1e3 * np.abs(points[:, 2] - poses[0, 2]).max(),
        tilt_deg=np.degrees(tilt),
        roll_deg=np.degrees(roll),
        step_deg=np.degrees(np.abs(np.diff(q, axis=0)).max(initial=0.0)),
        beyond_deg=np.degrees(beyond),
    )
