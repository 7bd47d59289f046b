"""The gate that every URDF passes before a native parser sees it.

Native URDF readers accept axes of length zero, limits that lock a joint, NaN and mesh names that
climb out of their folder, and a long enough chain crashes the process. Here each of these is either
one clear error or a correct robot. The native parser is then given a text of our own that holds the
links and joints and nothing else of the file.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.sax.saxutils import quoteattr

from robots.urdf_joints import JointInfo, Mimic, read_joint
from robots.urdf_values import MAX_LENGTH, Faults, name_of
from robots.urdf_visuals import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    MeshFile,
    MeshFolders,
    Sphere,
    Visual,
    leaves_package,
    read_visuals,
)
from robots.urdf_xml import Node, UrdfError, parse_xml, read_bytes, shown

__all__ = [
    "MAX_LINKS", "Box", "Capsule", "CheckedUrdf", "Cylinder", "Geometry", "JointInfo", "MeshFile",
    "Mimic", "Sphere", "UrdfError", "Visual", "check_urdf", "check_urdf_text",
]  # fmt: skip

MAX_LINKS = 1000  # native readers recurse along a chain: 4,000 links overflow the stack


@dataclass(frozen=True, eq=False, slots=True)
class CheckedUrdf:
    """A tree of links and joints that is safe to use, and what there is to draw."""

    path: str
    """Where it came from, for messages."""
    name: str
    text: str
    """The same tree as URDF, written anew, for a native parser.

    Only names, joint kinds, origins, axes and limits; mimic joints are free in it, and a joint
    without usable limits (`JointInfo.fault`) has very wide ones, so that it is not locked.
    """
    root: str
    """The link that no joint moves."""
    links: tuple[str, ...]
    """From the root outwards, parents before children."""
    joints: tuple[JointInfo, ...]
    """From the root outwards, in the order of `links[1:]`: joint i moves link i + 1."""
    leaves: tuple[str, ...]
    """Links without a child."""
    visuals: tuple[Visual, ...]
    warnings: tuple[str, ...]
    """What is odd in the file and leaves the robot correct."""
    package_dirs: tuple[str, ...]

    def path_to(self, link: str) -> tuple[JointInfo, ...]:
        """The joints from the root to `link`, base to tip.

        Raises:
            UrdfError: there is no such link.
        """
        if link not in self.links:
            raise UrdfError(
                self.path,
                (f"has no link {shown(link)}; its leaves are: {', '.join(self.leaves[:20])}",),
            )
        above = {joint.child: joint for joint in self.joints}
        path: list[JointInfo] = []
        while link != self.root:
            path.append(above[link])
            link = above[link].parent
        return tuple(reversed(path))

    def __repr__(self) -> str:
        """One line that says which robot this is."""
        moving = sum(joint.moves for joint in self.joints)
        return f"CheckedUrdf({self.name!r}, {len(self.links)} links, {moving} moving joints)"


def check_urdf(
    path: str | os.PathLike[str], package_dirs: Sequence[str | os.PathLike[str]] = ()
) -> CheckedUrdf:
    """Read and check a URDF file.

    Args:
        path: the file.
        package_dirs: folders that hold the packages of `package://` mesh names.

    Raises:
        UrdfError: with every fault that was found, each with its line and what would do.
    """
    name = os.fspath(path)
    root = parse_xml(read_bytes(name), name)
    return _check(root, name, os.path.dirname(os.path.abspath(name)), package_dirs)


def check_urdf_text(
    text: str,
    name: str = "URDF text",
    base_dir: str | os.PathLike[str] | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
) -> CheckedUrdf:
    """Check a URDF that is a string.

    Args:
        text: the URDF.
        name: what to call it in messages.
        base_dir: folder of relative mesh names; without it they are not looked for.
        package_dirs: as in `check_urdf`.

    Raises:
        UrdfError: as `check_urdf`.
    """
    try:
        data = text.encode()
    except UnicodeEncodeError as error:
        raise UrdfError(name, (f"is no text: {error.reason} at {error.start}",)) from None
    root = parse_xml(data, name, encoding="utf-8")
    return _check(root, name, os.fspath(base_dir) if base_dir is not None else None, package_dirs)


def _check(
    robot: Node, path: str, base_dir: str | None, package_dirs: Sequence[str | os.PathLike[str]]
) -> CheckedUrdf:
    _refuse_other_formats(robot, path)
    faults = Faults()
    folders = tuple(os.path.abspath(os.fspath(folder)) for folder in package_dirs)
    faults.errors += [
        f"package_dirs: {shown(folder, 200)} is not a folder"
        for folder in folders
        if not os.path.isdir(folder)
    ]
    links = _links(robot, faults)
    declared = _joints(robot, links, faults)
    if faults.errors:  # the tree would only echo them
        raise UrdfError(path, tuple(faults.errors))
    order = _tree(links, declared, faults)
    if faults.errors:
        raise UrdfError(path, tuple(faults.errors))
    joints = _with_mimic_faults(order)
    visuals = read_visuals(robot, MeshFolders(base_dir, folders), faults)
    parents = {joint.parent for joint in joints}
    root = next(iter(set(links) - {joint.child for joint in joints}))
    names = (root, *(joint.child for joint in joints))
    title = robot.attributes.get("name") or os.path.splitext(os.path.basename(path))[0] or "robot"
    return CheckedUrdf(
        path=path,
        name=title,
        text=_written(title, names, joints),
        root=root,
        links=names,
        joints=joints,
        leaves=tuple(name for name in names if name not in parents),
        visuals=visuals,
        warnings=tuple(faults.warnings),
        package_dirs=folders,
    )


def _refuse_other_formats(robot: Node, path: str) -> None:
    """One clear error for a file that is no URDF yet, instead of one for each of its elements."""
    tag = robot.tag
    if tag != "robot":
        known = {
            "sdf": "SDF; convert it to URDF",
            "mujoco": "a MuJoCo model; convert it to URDF",
            "html": "a web page; download the raw file",
            "COLLADA": "a COLLADA mesh; give the URDF that names it",
        }
        what = known.get(tag, "not a URDF, which starts with <robot name=...>")
        raise UrdfError(path, (f"line {robot.line}: its first element is <{tag[:60]}>: {what}",))
    pending = deque(
        child for child in robot.children if child.tag not in ("gazebo", "transmission", "sensor")
    )
    while pending:
        node = pending.popleft()
        values = " ".join(node.attributes.values())
        if node.tag.startswith("xacro:") or "${" in values or "$(" in values:
            raise UrdfError(
                path,
                (
                    f"line {node.line}: <{node.tag[:60]}> still holds xacro; expand it first: "
                    "xacro robot.urdf.xacro > robot.urdf",
                ),
            )
        if node.tag.split(":")[-1] == "include":
            raise UrdfError(
                path,
                (
                    f"line {node.line}: <{node.tag[:60]}> would include another file, which is "
                    "not done; write one URDF that holds every link",
                ),
            )
        pending.extend(node.children)


def _links(robot: Node, faults: Faults) -> dict[str, Node]:
    nodes = robot.all("link")
    if not nodes:
        faults.error(robot, 'has no links; a URDF has a <link name="..."/> for each body')
    if len(nodes) > MAX_LINKS:
        faults.error(
            robot,
            f"has {len(nodes):,} links, more than {MAX_LINKS:,}; give the arm alone, or merge "
            "links that do not move",
        )
        return {}
    links: dict[str, Node] = {}
    for node in nodes:
        name = name_of(node, faults)
        if name is not None and name in links:
            faults.error(
                node, f"link {shown(name)} stands already on line {links[name].line}; rename one"
            )
        elif name is not None:
            links[name] = node
        for visual in node.all("visual"):
            for mesh in (mesh for shape in visual.all("geometry") for mesh in shape.all("mesh")):
                if leaves_package(mesh.attributes.get("filename", "")):
                    faults.error(
                        mesh,
                        f"link {shown(name or '?')}: mesh {shown(mesh.attributes['filename'])} "
                        "climbs out of its package; write the path inside the package",
                    )
    return links


def _joints(robot: Node, links: dict[str, Node], faults: Faults) -> dict[str, JointInfo]:
    nodes = robot.all("joint")
    if len(nodes) >= MAX_LINKS:
        faults.error(robot, f"has {len(nodes):,} joints, more than {MAX_LINKS - 1:,}")
        return {}
    joints: dict[str, JointInfo] = {}
    lines: dict[str, int] = {}
    for node in nodes:
        name = node.attributes.get("name", "")
        if name and name in lines:
            faults.error(
                node, f"joint {shown(name)} stands already on line {lines[name]}; rename one"
            )
        lines.setdefault(name, node.line)
        joint = read_joint(node, faults)
        if joint is None:
            continue
        joints[joint.name] = joint
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if links and link not in links:
                faults.error(
                    node,
                    f"joint {shown(joint.name)} has the unknown {role} link {shown(link)}; "
                    "mend the name or add the link",
                )
    return joints


def _tree(
    links: dict[str, Node], joints: dict[str, JointInfo], faults: Faults
) -> tuple[JointInfo, ...]:
    """The joints from the root outwards, or the faults that keep them from being one tree."""
    above: dict[str, JointInfo] = {}
    below: dict[str, list[JointInfo]] = {}
    for joint in joints.values():
        below.setdefault(joint.parent, []).append(joint)
        if joint.child in above:
            faults.errors.append(
                f"line {joint.line}: link {shown(joint.child)} is the child of two joints, "
                f"{shown(above[joint.child].name)} and {shown(joint.name)}: a loop; a URDF is a "
                "tree, so cut the loop by removing one"
            )
        above.setdefault(joint.child, joint)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        listed = ", ".join(shown(name) for name in roots[:10])
        faults.errors.append(
            f"has {len(roots)} links that no joint moves ({listed}); only the base may stand "
            "alone, so join the others to it or remove them"
        )
    reached: set[str] = set(roots)
    order: list[JointInfo] = []
    pending = deque(roots)
    while pending:
        for joint in below.get(pending.popleft(), ()):
            if joint.child not in reached:
                reached.add(joint.child)
                order.append(joint)
                pending.append(joint.child)
    lost = [name for name in links if name not in reached]
    if lost:
        listed = ", ".join(shown(name) for name in lost[:10])
        faults.errors.append(
            f"the links {listed} form a closed loop that hangs on no base; remove the joint that "
            "closes it"
        )
    return tuple(order)


def _with_mimic_faults(joints: tuple[JointInfo, ...]) -> tuple[JointInfo, ...]:
    """Mark the joints whose mimic leads nowhere."""
    by_name = {joint.name: joint for joint in joints}
    marked = []
    for joint in joints:
        fault = _mimic_fault(joint, by_name)
        if fault is not None and joint.fault is None:
            said = (
                f"line {joint.line}: joint {shown(joint.name)} {fault}; mend it, or lock the joint"
            )
            joint = replace(joint, fault=said)
        marked.append(joint)
    return tuple(marked)


def _mimic_fault(joint: JointInfo, by_name: dict[str, JointInfo]) -> str | None:
    seen = {joint.name}
    follower = joint
    while follower.mimic is not None:
        leader = by_name.get(follower.mimic.joint)
        if leader is None:
            return f"mimics the unknown joint {shown(follower.mimic.joint)}"
        if not leader.moves:
            return f"mimics joint {shown(leader.name)}, which is fixed"
        if leader.name in seen:
            return "mimics itself" + ("" if leader is follower else " through other joints")
        seen.add(leader.name)
        follower = leader
    return None


def _written(title: str, links: tuple[str, ...], joints: tuple[JointInfo, ...]) -> str:
    """Write the tree as URDF; repr keeps every digit of a number."""
    lines = [f"<robot name={quoteattr(title)}>"]
    lines += [f"  <link name={quoteattr(link)}/>" for link in links]
    for joint in joints:
        xyz, rpy, axis = (
            " ".join(map(repr, values)) for values in (joint.xyz, joint.rpy, joint.axis)
        )
        lines += [
            f'  <joint name={quoteattr(joint.name)} type="{joint.kind}">',
            f"    <parent link={quoteattr(joint.parent)}/>",
            f"    <child link={quoteattr(joint.child)}/>",
            f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        ]
        if joint.moves:
            lines.append(f'    <axis xyz="{axis}"/>')
        if joint.kind in ("revolute", "prismatic"):
            lower = -MAX_LENGTH if joint.lower is None else joint.lower
            upper = MAX_LENGTH if joint.upper is None else joint.upper
            lines.append(
                f'    <limit lower="{lower!r}" upper="{upper!r}" effort="0" velocity="0"/>'
            )
        lines.append("  </joint>")
    return "\n".join([*lines, "</robot>", ""])
