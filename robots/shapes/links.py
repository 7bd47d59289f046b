"""The bodies of a robot's links, in the frames of the joints that carry them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable.errors import listed
from robots.errors import RobotError
from robots.robot import Robot
from robots.shapes.bodies import Fineness, Geometry, Polytope, Solid, outline
from robots.shapes.hulls import hull_of, pieces_of
from robots.shapes.solids import mesh_reader
from robots.urdf.checked_urdf import CheckedUrdf, check_urdf
from robots.urdf.link_shapes import LinkShape, MeshFile, mesh_paths

MOST_NAMED = 8  # links in one note
NEAR = 1e-3  # [m] from flange to tool point, which are one then
KINDS = LOST, REPLACED, STAND_IN, WITHOUT = (
    "a shape of {} cannot be used, so {} not checked: ",
    "a collision shape of {} cannot be used, so visuals stand in: ",
    "no collision shapes, so visuals stand in: {}",
    "left without collision shapes by the URDF, so not checked: {}",
)
Said = dict[tuple[str, str], list[str]]
"""Links by what is said of them, and why; those `WITHOUT` are drawn."""


@dataclass(frozen=True, eq=False, slots=True)
class LinkShapes:
    """What the links of a robot are made of."""

    solids: tuple[Solid, ...]
    """Exact, as the URDF has them."""
    polytopes: tuple[Polytope, ...]
    """Convex bodies that hold them."""
    unchecked: tuple[str, ...]
    """Links with a shape that cannot be used and has no stand-in, links that the URDF leaves
    without collision shapes on purpose, and links of moving joints on which nothing has a shape.

    A link without a shape is not listed where others that move with it have some: it is a mere
    frame, such as tool0 or flange; nor is the root link, which is often just called world.
    """
    notes: tuple[str, ...]
    """Which shapes stand in for which, and what is not checked, one sentence each."""
    embodied: frozenset[str]
    """Links that are more than a frame, whether they are checked or not."""
    parents: Mapping[str, str]
    """The link that each other link hangs on."""


def link_shapes(robot: Robot, fineness: Fineness = "hulls") -> LinkShapes:
    """The bodies of all links, those on locked joints too.

    A link's <collision> shapes are taken. Where there are none, or one of them cannot be used, its
    visuals stand in for them; a note says so. Links marked with collision="none" have no bodies.

    Args:
        robot: with the path of its URDF.
        fineness: "hulls": one convex body for each shape; "pieces": several where one is crude.
            "meshes" gives pieces too: the search always works with convex bodies.

    Raises:
        RobotError: the robot has no URDF, it cannot be read, or no link has a shape that can be
            used.
    """
    if robot.urdf is None:
        raise RobotError(
            "has no URDF file, so its links have no shapes for collisions; load it from a file",
            f"robot {robot.name!r}",
        )
    checked = check_urdf(
        robot.urdf, robot.package_dirs, robot.axes, xacro_args=dict(robot.xacro_args)
    )
    solids, carriers, said = _gathered(robot, checked)
    notes = _notes(said)
    if not solids:
        why = "; ".join(notes) or "its links have neither collision shapes nor visuals"
        raise RobotError(
            f"no link has a shape that can be used for collisions: {why}", f"robot {robot.name!r}"
        )
    ended = [links for (what, _), links in said.items() if what in (LOST, WITHOUT)]
    lost = [link for links in ended for link in links]
    # What bears nothing but the root moves only as seen from another link.
    carrying = {0, *(solid.joint for solid in solids)}
    gaps = [link for joint, link in carriers.items() if joint not in carrying]
    unchecked = dict.fromkeys([*lost, *(link for link in gaps if link != checked.root)])
    polytopes = tuple(body for solid in solids for body in outer_bodies(solid, fineness))
    parents = {joint.child: joint.parent for joint in checked.joints}
    embodied = frozenset([*(solid.owner for solid in solids), *lost])
    return LinkShapes(tuple(solids), polytopes, tuple(unchecked), notes, embodied, parents)


def outer_bodies(solid: Solid, fineness: Fineness = "hulls") -> list[Polytope]:
    """Convex bodies that together hold a solid, in the frame of its joint."""
    place = solid.placement
    hulls = (hull_of(solid.geometry),) if fineness == "hulls" else pieces_of(solid.geometry)
    return [
        Polytope(solid.owner, solid.joint, vertices @ place[:3, :3].T + place[:3, 3], radius)
        for vertices, radius, _ in hulls
    ]


def _gathered(robot: Robot, checked: CheckedUrdf) -> tuple[list[Solid], dict[int, str], Said]:
    """The shapes of all links, the first link of each joint, and what is to be said of links."""
    own, model = checked.collisions, robot.model
    read = mesh_reader(mesh_paths(own.shapes or checked.visuals))
    faults = [{one.link: one.why for one in some} for some in (own.faults, checked.visual_faults)]
    drawn = {shape.link for shape in checked.visuals}
    solids, carriers, said = list[Solid](), dict[int, str](), Said()
    for link in checked.links:
        if not model.existFrame(link, pin.FrameType.BODY):  # the file has changed since
            continue
        frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
        carriers.setdefault(int(frame.parentJoint), link)
        if link in own.without:
            continue
        found, fault = _read(read, link, own.shapes, faults[0])
        if fault or not found:
            shown, unseen = _read(read, link, checked.visuals, faults[1])
            if unseen or (fault and not shown):
                said.setdefault((LOST, unseen or fault), []).append(link)
            elif shown:
                said.setdefault((REPLACED if fault else STAND_IN, fault), []).append(link)
            found += shown  # those that can be read are kept: more is safe
        for origin, geometry in found:
            place = frame.placement.homogeneous @ origin
            solids.append(Solid(link, int(frame.parentJoint), place, geometry))
    without = [link for link in own.without if link in drawn]
    return solids, carriers, said | ({(WITHOUT, ""): without} if without else {})


def _read(
    read: Callable[[MeshFile], Geometry],
    link: str,
    shapes: Iterable[LinkShape],
    faults: Mapping[str, str],
) -> tuple[list[tuple[np.ndarray, Geometry]], str]:
    """The shapes of a link that can be used, and what is wrong with the first of the others."""
    found, fault = list[tuple[np.ndarray, Geometry]](), ""
    for shape in (one for one in shapes if one.link == link):
        given = shape.geometry
        try:
            geometry = read(given) if isinstance(given, MeshFile) else given
            found.append((shape.origin, geometry))
        except RobotError as error:
            fault = fault or str(error)
    return found, fault or faults.get(link, "")


def _notes(said: Said) -> tuple[str, ...]:
    """See `LinkShapes.notes`."""
    notes = []
    for (what, why), links in sorted(said.items(), key=lambda one: KINDS.index(one[0][0])):
        many = len(links) > 1
        named = f"link{'s' if many else ''} {listed(links, MOST_NAMED)}"
        notes.append(what.format(named, "they are" if many else "it is") + why)
    return tuple(notes)


class ToolLine(NamedTuple):
    """From the flange to the tool point."""

    flange: str
    """The link that the tool is mounted on."""
    joint: int
    """Pinocchio's, that carries both."""
    ends: np.ndarray
    """(2, 3) m in the joint's frame: the flange and the tool point, which may be one."""


def tool_line(robot: Robot) -> ToolLine:
    """The flange is the link of the tool frame, or the last before it that is elsewhere.

    Example:
        >>> from coverable import load_robot
        >>> line = tool_line(load_robot("ur5", tcp=((0, 0, 0.15), (0, 0, 0))))
        >>> line.flange, (line.ends[1] - line.ends[0]).round(9).tolist()
        ('tool0', [0.0, 0.15, 0.0])
    """
    frames, tcp = robot.model.frames, robot.model.frames[robot.tool_frame_id]
    end, number = tcp.placement.translation, robot.tool_link_id
    while number and frames[number].parentJoint == tcp.parentJoint:
        frame = frames[number]
        start = frame.placement.translation
        if frame.type == pin.FrameType.BODY and np.linalg.norm(end - start) > NEAR:
            return ToolLine(frame.name, int(tcp.parentJoint), np.stack([start, end]))
        number = frame.parentFrame
    return ToolLine(robot.tool_frame, int(tcp.parentJoint), np.stack([end, end]))


def tool_reach(robot: Robot, solids: Iterable[Solid]) -> dict[str, float]:
    """By owner, how far (m) bodies on the last joint reach beyond the tool point, furthest first.

    What reaches further than the standoff is inside a flat surface that is treated, whatever the
    arm does. Exact shapes count, not the convex bodies around them.
    """
    frame = robot.model.frames[robot.tool_frame_id].placement
    axis, beyond = frame.rotation @ robot.approach_axis, dict[str, float]()
    tip = float(frame.translation @ axis)
    for one in (one for one in solids if one.joint == robot.n):
        own, (corners, radius, circle) = one.placement[:3, :3].T @ axis, outline(one.geometry)
        end = float(one.placement[:3, 3] @ axis) + float((corners @ own).max()) + radius
        end += circle * math.hypot(own[0], own[1])
        beyond[one.owner] = max(beyond.get(one.owner, -np.inf), end - tip)
    return dict(sorted(beyond.items(), key=lambda reach: -reach[1]))
