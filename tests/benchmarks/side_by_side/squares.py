"""The questions that all tools are asked: a ur5, tool down, over squares of 90 poses."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROWS, COLUMNS = 9, 10
ROLLS = 24  # that a tool tries where the roll is free and it has to be told some
TIP, BASE = "tool0", "base_link"
LINE = 1e-3  # [m] that the tool point may leave the straight lines by, for tools that ask
TILT_DEG, FIXED_DEG = 1.0, 0.1  # of the tool, where its roll is free, and where nothing is


@dataclass(frozen=True)
class Square:
    """One question. Where the roll is fixed, the tool's x axis is along that of the base."""

    name: str
    side: float
    """m; the poses are the centres of 9 x 10 cells, run to and fro."""
    centre: tuple[float, float, float]
    fixed: bool
    """Whether the tool may not turn about its axis."""
    limits_deg: Mapping[str, tuple[float, float]]
    """By joint, in place of those of the URDF."""

    def points(self) -> Floats:
        """(90, 3) m, in the frame of the arm's base."""
        u, v = (self.side * ((np.arange(n) + 0.5) / n - 0.5) for n in (ROWS, COLUMNS))
        flat = [(x, y, 0.0) for row, x in enumerate(u) for y in (v if row % 2 == 0 else v[::-1])]
        return np.array(flat) + self.centre

    def rotations(self) -> Floats:
        """(k, 3, 3) of the tool: the one that is asked for, or samples where the roll is free."""
        rolls = np.zeros(1) if self.fixed else 2.0 * np.pi * np.arange(ROLLS) / ROLLS
        c, s, zero = np.cos(rolls), np.sin(rolls), np.zeros_like(rolls)
        x = np.stack([c, -s, zero], axis=-1)
        y = np.stack([-s, -c, zero], axis=-1)
        return np.stack([x, y, np.broadcast_to([0.0, 0.0, -1.0], x.shape)], axis=-1)


HALF_TURNS = (-180.0, 180.0)
BEHIND = {
    "shoulder_pan_joint": HALF_TURNS,
    "shoulder_lift_joint": (-120.0, 0.0),
    "wrist_1_joint": HALF_TURNS,
    "wrist_2_joint": HALF_TURNS,
    "wrist_3_joint": HALF_TURNS,
}
SQUARES = tuple(
    Square(f"{name}, roll {'fixed' if fixed else 'free'}", side, centre, fixed, limits)
    for name, side, centre, limits in (
        ("0.15 m in front", 0.15, (0.5, 0.0, 0.1), {}),
        ("0.4 m in front", 0.4, (0.5, 0.0, 0.1), {}),
        ("0.4 m behind, narrower limits", 0.4, (-0.5, 0.0, 0.1), BEHIND),
    )
    for fixed in (False, True)
)


def bare_urdf(text: str, square: Square) -> str:
    """A URDF without shapes, since collisions are nobody's question, and with the square's limits.

    Args:
        text: of the URDF.
        square: whose limits count.
    """
    robot = ElementTree.fromstring(text)
    for link in robot.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
    for part in [part for part in robot if part.tag not in ("link", "joint")]:
        robot.remove(part)
    for joint in robot.iter("joint"):
        limit = joint.find("limit")
        if limit is not None and joint.get("name") in square.limits_deg:
            low, high = np.radians(square.limits_deg[joint.get("name", "")])
            limit.set("lower", repr(float(low)))
            limit.set("upper", repr(float(high)))
    return ElementTree.tostring(robot, encoding="unicode")
