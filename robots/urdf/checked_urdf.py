"""The check that every URDF passes before a native parser sees it.

Native URDF readers accept axes of length zero, limits that lock a joint, NaN and mesh names that
climb out of their folder, and a long enough chain crashes the process. Here each of these is either
one clear error or a correct robot, and no native parser sees the file.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from coverable.arrays import Array
from robots.urdf.elements import Faults, Node, UrdfError, is_xacro, parse_xml, read_bytes, shown
from robots.urdf.joints import JointInfo
from robots.urdf.link_shapes import (
    CollisionShapes,
    LinkShape,
    ShapeFault,
    read_collisions,
    read_visuals,
)
from robots.urdf.tree import read_links, read_tree, refuse_other_formats

if TYPE_CHECKING:
    from robots.urdf.axes import Axis
    from robots.urdf.mesh_folders import MeshFolders

MAX_WARNINGS = 100


@dataclass(frozen=True, eq=False, slots=True)
class CheckedUrdf:
    """A tree of links and joints that is safe to use, and what there is to draw."""

    path: str
    """Where it came from, for messages."""
    name: str
    root: str
    """The link that no joint moves; with composed axes the world."""
    mounted: str
    """The root link of the file itself."""
    links: tuple[str, ...]
    """From the root outwards, parents before children."""
    joints: tuple[JointInfo, ...]
    """From the root outwards, in the order of `links[1:]`: joint i moves link i + 1."""
    leaves: tuple[str, ...]
    """Links without a child, those of composed axes left out."""
    visuals: tuple[LinkShape, ...]
    visual_faults: tuple[ShapeFault, ...]
    """Visuals that cannot be drawn; `warnings` says so in short."""
    collisions: CollisionShapes
    warnings: tuple[str, ...]
    """What is odd in the file and leaves the robot correct."""
    package_dirs: tuple[str, ...]
    mesh_paths: tuple[str, ...]
    """Where meshes were looked for, in the allowed folders; not all are there."""

    def path_to(self, link: str) -> tuple[JointInfo, ...]:
        """The joints from the root to `link`, base to tip.

        Raises:
            UrdfError: there is no such link.
        """
        if link not in self.links:
            raise UrdfError(
                f"has no link {shown(link)}; its leaves are: {', '.join(self.leaves[:20])}",
                self.path,
            )
        above = {joint.child: joint for joint in self.joints}
        path: list[JointInfo] = []
        while link != self.root:
            path.append(above[link])
            link = above[link].parent
        return tuple(reversed(path))

    def __repr__(self) -> str:
        """One line: name, links and moving joints."""
        moving = sum(joint.moves for joint in self.joints)
        return f"CheckedUrdf({self.name!r}, {len(self.links)} links, {moving} moving joints)"


def check_urdf(
    path: str | os.PathLike[str],
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    axes: Sequence[Axis] = (),
    base: Array | None = None,
    xacro_args: Mapping[str, Any] = {},
) -> CheckedUrdf:
    """Read and check a URDF file, or a .xacro file, which is expanded first.

    Args:
        path: the file.
        package_dirs: folders that hold the packages of `package://` mesh names.
        axes: that arm or surface are mounted on, added to the tree; the world is then its root.
        base: (4, 4) m, with axes, the file's root link in the world or on the last base axis.
        xacro_args: arguments of a .xacro file.

    Raises:
        UrdfError: with every fault that was found, each with its line and what would do.
    """
    name = os.fsdecode(path)
    root = _root_of(name, package_dirs, xacro_args)
    checked = checked_tree(root, name, os.path.dirname(os.path.abspath(name)), package_dirs)
    if not axes:
        return checked
    from robots.urdf.axes import axis_joints

    joints = axis_joints(axes, base, checked.joints, checked.root, name)
    links = (joints[0].parent, *(joint.child for joint in joints))
    return replace(checked, root=links[0], links=links, joints=joints)


def _root_of(
    path: str, package_dirs: Sequence[str | os.PathLike[str]], xacro_args: Mapping[str, Any]
) -> Node:
    """The first element of a file; lines are those of the expanded text."""
    if is_xacro(path):
        from robots.urdf.xacro_files import expanded

        called = f"{path} (expanded)"
        found = expanded(path, tuple(map(os.fsdecode, package_dirs)), xacro_args)
        root = parse_xml(found.text, called, encoding="utf-8")
    elif xacro_args:
        raise UrdfError("is no .xacro file, so it has no xacro_args; leave them out", path)
    else:
        called, root = path, parse_xml(read_bytes(path), path)
    refuse_other_formats(root, called)
    return root


def checked_tree(
    robot: Node,
    path: str,
    base_dir: str,
    package_dirs: Sequence[str | os.PathLike[str]],
) -> CheckedUrdf:
    """Check the tree of a <robot>; mesh names are relative to `base_dir`.

    Raises:
        UrdfError: with every fault that was found.
    """
    faults = Faults()
    folders = tuple(os.path.abspath(os.fsdecode(folder)) for folder in package_dirs)
    faults.errors += [
        f"package_dirs: {shown(folder, 200)} is not a folder"
        for folder in folders
        if not os.path.isdir(folder)
    ]
    links = read_links(robot, faults)
    joints = read_tree(robot, links, faults)
    if faults.errors:
        raise UrdfError(faults.errors, path)
    places: list[MeshFolders] = []  # one, once a mesh is named

    def resolve(name: str) -> str:
        if not places:
            from robots.urdf.mesh_folders import MeshFolders

            places.append(MeshFolders(base_dir, folders))
        return places[0].resolve(name)

    visuals, visual_faults = read_visuals(robot, resolve, faults)
    collisions = read_collisions(robot, resolve, faults)
    parents = {joint.parent for joint in joints}
    root = next(iter(set(links) - {joint.child for joint in joints}))
    names = (root, *(joint.child for joint in joints))
    unlisted = len(faults.warnings) - MAX_WARNINGS
    more = [f"... and {unlisted:,} more"] if unlisted > 0 else []
    title = robot.attributes.get("name") or os.path.splitext(os.path.basename(path))[0] or "robot"
    return CheckedUrdf(
        path=path,
        name=title,
        root=root,
        mounted=root,
        links=names,
        joints=joints,
        leaves=tuple(name for name in names if name not in parents),
        visuals=visuals,
        visual_faults=visual_faults,
        collisions=collisions,
        warnings=(*faults.warnings[:MAX_WARNINGS], *more),
        package_dirs=folders,
        mesh_paths=tuple(path for place in places for path in place.tried),
    )
