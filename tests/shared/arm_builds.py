"""Arms that the tests build from the URDF text of others: moved, mirrored, scaled, on a rail."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from robots import Robot, load_robot

MIRROR = np.diag([1.0, -1.0, 1.0])
"""Reflection in the xz plane."""


def _text(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values, dtype=float))


def _floats(element: ET.Element | None, key: str, default: str = "0 0 0") -> NDArray[np.float64]:
    text = default if element is None else element.get(key, default)
    return np.array([float(word) for word in text.split()])


def bare(path: Path | str) -> ET.Element:
    """The links and joints of a URDF file, without pictures."""
    robot = ET.parse(path).getroot()
    for child in list(robot):
        if child.tag not in ("link", "joint"):
            robot.remove(child)
        elif child.tag == "link":
            for part in list(child):
                child.remove(part)
    return robot


def on_a_base(
    robot: ET.Element,
    kind: str,
    xyz: object = (0, 0, 0),
    rpy: object = (0, 0, 0),
    axis: object = (1, 0, 0),
    limits: tuple[float, float] = (0, 0),
) -> ET.Element:
    """Put one more joint ('fixed', 'prismatic', ...) under the root link."""
    children = {joint.find("child").get("link") for joint in robot.iter("joint")}
    (root,) = [link.get("name") for link in robot.iter("link") if link.get("name") not in children]
    robot.append(ET.Element("link", name="test_base"))
    joint = ET.SubElement(robot, "joint", name="test_joint", type=kind)
    ET.SubElement(joint, "parent", link="test_base")
    ET.SubElement(joint, "child", link=root)
    ET.SubElement(joint, "origin", xyz=_text(xyz), rpy=_text(rpy))
    if kind != "fixed":
        ET.SubElement(joint, "axis", xyz=_text(axis))
        low, high = (repr(float(limit)) for limit in limits)
        ET.SubElement(joint, "limit", lower=low, upper=high, effort="1", velocity="1")
    return robot


def mirrored(robot: ET.Element) -> ET.Element:
    """The arm's mirror image in the xz plane; the same joint values place it in the mirror."""
    for joint in robot.iter("joint"):
        origin, axis = joint.find("origin"), joint.find("axis")
        if origin is not None:
            origin.set("xyz", _text(MIRROR @ _floats(origin, "xyz")))
            origin.set("rpy", _text(_floats(origin, "rpy") * [-1.0, 1.0, -1.0]))
        if axis is not None:
            # A turn's axis is a pseudovector: the mirror image of a turn runs the other way.
            sign = 1.0 if joint.get("type") == "prismatic" else -1.0
            axis.set("xyz", _text(sign * MIRROR @ _floats(axis, "xyz", "1 0 0")))
    return robot


def scaled(robot: ET.Element, factor: float) -> ET.Element:
    """The arm with all its lengths multiplied."""
    for joint in robot.iter("joint"):
        origin, limit = joint.find("origin"), joint.find("limit")
        if origin is not None:
            origin.set("xyz", _text(factor * _floats(origin, "xyz")))
        if joint.get("type") == "prismatic" and limit is not None:
            for key in ("lower", "upper"):
                limit.set(key, repr(factor * float(limit.get(key, "0"))))
    return robot


def built(robot: ET.Element, folder: Path, like: Robot) -> Robot:
    """Load a changed URDF with the tool, and the limits of the joints that it shares, of `like`."""
    path = folder / "built.urdf"
    path.write_text(ET.tostring(robot, encoding="unicode"), encoding="utf-8")
    made = load_robot(path, tool_frame=like.tool_frame, approach_axis=like.approach_axis)
    limits = zip(like.joint_names, np.column_stack([like.lower, like.upper]), strict=True)
    revolute = [not sliding for sliding in like.prismatic]
    return made.with_limits(
        {name: pair for (name, pair), keep in zip(limits, revolute, strict=True) if keep}
    )
