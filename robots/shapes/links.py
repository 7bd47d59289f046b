"""The bodies of a robot's links, in the frames of the joints that carry them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from coverable.errors import listed
from robots.errors import RobotError
from robots.robot import Robot
from robots.shapes.bodies import Fineness, Geometry, Polytope, Solid
from robots.shapes.hulls import hull_of, pieces_of
from robots.shapes.solids import MeshBodies
from robots.urdf.checked_urdf import CheckedUrdf, check_urdf
from robots.urdf.link_shapes import LinkShape, MeshFile, mesh_paths

MOST_NAMED = 8  # links in one note


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
    root: str
    """The link that no joint moves."""
    tool: str
    """The link whose origin is the tool point."""
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
    gathered = _Gathered(robot, checked)
    for link in checked.links:
        gathered.add(link)
    solids = tuple(gathered.solids)
    unchecked, notes = gathered.unchecked(), gathered.notes()
    if not solids:
        why = "; ".join(notes) or "its links have neither collision shapes nor visuals"
        raise RobotError(
            f"no link has a shape that can be used for collisions: {why}", f"robot {robot.name!r}"
        )
    polytopes = tuple(body for solid in solids for body in outer_bodies(solid, fineness))
    parents = {joint.child: joint.parent for joint in checked.joints}
    embodied = gathered.embodied()
    return LinkShapes(
        solids, polytopes, unchecked, notes, embodied, checked.root, robot.tool_frame, parents
    )


def outer_bodies(solid: Solid, fineness: Fineness = "hulls") -> list[Polytope]:
    """Convex bodies that together hold a solid, in the frame of its joint."""
    place = solid.placement
    hulls = [hull_of(solid.geometry)] if fineness == "hulls" else pieces_of(solid.geometry)
    bodies = []
    for hull in hulls:
        vertices = hull.vertices @ place[:3, :3].T + place[:3, 3]
        bodies.append(Polytope(solid.owner, solid.joint, vertices, hull.radius))
    return bodies


class _Gathered:
    """Solids link by link, and what is to be said about them."""

    def __init__(self, robot: Robot, checked: CheckedUrdf) -> None:
        self.robot = robot
        self.root = checked.root
        shapes = checked.collisions.shapes or checked.visuals
        self.meshes = MeshBodies(mesh_paths(shapes))
        self.solids: list[Solid] = []
        self.collisions, self.visuals = map(_by_link, (checked.collisions.shapes, checked.visuals))
        self.collision_faults = {fault.link: fault.why for fault in checked.collisions.faults}
        self.visual_faults = {fault.link: fault.why for fault in checked.visual_faults}
        self.without = [link for link in checked.collisions.without if link in self.visuals]
        self.bare = set(checked.collisions.without)
        self.stand_ins: list[str] = []
        self.replaced: dict[str, list[str]] = {}  # what is wrong -> links
        self.lost: dict[str, list[str]] = {}  # what is wrong -> links
        self.carriers: dict[int, str] = {}  # the first link of each joint
        self.bodies = {f.name for f in robot.model.frames if f.type == pin.FrameType.BODY}

    def add(self, link: str) -> None:
        """Take the shapes of one link."""
        if link not in self.bodies:  # the file has changed since it was loaded
            return
        frame = self.robot.model.frames[self.robot.model.getFrameId(link, pin.FrameType.BODY)]
        joint, place = int(frame.parentJoint), frame.placement.homogeneous
        self.carriers.setdefault(joint, link)
        if link in self.bare:
            return
        found, fault = self._read(self.collisions.get(link, []))
        fault = fault or self.collision_faults.get(link, "")
        if fault or not found:
            shown, visual_fault = self._read(self.visuals.get(link, []))
            visual_fault = visual_fault or self.visual_faults.get(link, "")
            if visual_fault or (fault and not shown):
                self.lost.setdefault(visual_fault or fault, []).append(link)
            elif fault:
                self.replaced.setdefault(fault, []).append(link)
            elif shown:
                self.stand_ins.append(link)
            found += shown  # those that can be read are kept: more is safe
        for origin, geometry in found:
            placement = place @ origin
            placement.flags.writeable = False
            self.solids.append(Solid(link, joint, placement, geometry))

    def _read(self, shapes: Iterable[LinkShape]) -> tuple[list[tuple[np.ndarray, Geometry]], str]:
        """The shapes that can be used, and what is wrong with the first of the others."""
        found: list[tuple[np.ndarray, Geometry]] = []
        fault = ""
        for shape in shapes:
            given = shape.geometry
            try:
                geometry = self.meshes.read(given) if isinstance(given, MeshFile) else given
            except RobotError as error:
                fault = fault or str(error)
                continue
            found.append((shape.origin, geometry))
        return found, fault

    def embodied(self) -> frozenset[str]:
        """See `LinkShapes.embodied`."""
        return frozenset(solid.owner for solid in self.solids) | {*self._lost(), *self.without}

    def _lost(self) -> list[str]:
        return [link for links in self.lost.values() for link in links]

    def unchecked(self) -> tuple[str, ...]:
        """See `LinkShapes.unchecked`."""
        carrying = {solid.joint for solid in self.solids}
        bare = {*carrying, 0}
        gaps = [link for joint, link in self.carriers.items() if joint not in bare]
        gaps = [link for link in gaps if link != self.root]  # moves only as seen from another link
        return tuple(dict.fromkeys([*self._lost(), *self.without, *gaps]))

    def notes(self) -> tuple[str, ...]:
        """See `LinkShapes.notes`."""
        notes = []
        for why, links in self.lost.items():
            so = "they are" if len(links) > 1 else "it is"
            notes.append(f"a shape of {_named(links)} cannot be used, so {so} not checked: {why}")
        notes += [
            f"a collision shape of {_named(links)} cannot be used, so visuals stand in: {why}"
            for why, links in self.replaced.items()
        ]
        if self.stand_ins:
            notes.append(f"no collision shapes, so visuals stand in: {_named(self.stand_ins)}")
        if self.without:
            notes.append(
                f"left without collision shapes by the URDF, so not checked: {_named(self.without)}"
            )
        return tuple(notes)


def _by_link(shapes: Iterable[LinkShape]) -> dict[str, list[LinkShape]]:
    """The shapes of each link."""
    found: dict[str, list[LinkShape]] = {}
    for shape in shapes:
        found.setdefault(shape.link, []).append(shape)
    return found


def _named(links: list[str]) -> str:
    """Links by name, in short."""
    return f"link{'s' if len(links) > 1 else ''} {listed(links, MOST_NAMED)}"
