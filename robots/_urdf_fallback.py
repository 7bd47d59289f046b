"""Stands in for robots.urdf until that lands."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass


@dataclass(frozen=True)
class JointInfo:
    """One joint."""

    name: str
    kind: str
    parent: str
    child: str
    lower: float | None
    upper: float | None
    mimic: object


@dataclass(frozen=True)
class CheckedUrdf:
    """A URDF."""

    path: str
    text: str
    root: str
    links: tuple
    joints: tuple
    leaves: tuple
    package_dirs: tuple


def check_urdf(path, package_dirs=()):
    """Read without checks."""
    text = open(path).read()
    robot = ET.fromstring(text.encode())
    links = tuple(x.get("name") for x in robot.findall("link"))
    joints = []
    for j in robot.findall("joint"):
        lim = j.find("limit")
        lo = hi = None
        if lim is not None:
            lo, hi = float(lim.get("lower", 0)), float(lim.get("upper", 0))
        joints.append(
            JointInfo(
                j.get("name"), j.get("type"), j.find("parent").get("link"),
                j.find("child").get("link"), lo, hi, j.find("mimic"),
            )
        )  # fmt: skip
    kids = {j.child for j in joints}
    parents = {j.parent for j in joints}
    root = next(x for x in links if x not in kids)
    leaves = tuple(x for x in links if x not in parents)
    return CheckedUrdf(str(path), text, root, links, tuple(joints), leaves, tuple(package_dirs))
