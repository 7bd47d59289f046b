"""The links and joints of a URDF as one tree, or every fault that keeps them from being one."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from itertools import accumulate

from coverable.errors import close_matches
from robots.urdf.elements import Faults, Node, UrdfError, name_of, shown
from robots.urdf.joints import JointInfo, read_joint

# Native readers recurse along a chain: 4,000 links overflow a stack of 8 MB, 250 one of 0.5 MB.
MAX_LINKS = 1000
MAX_IN_A_ROW = 200
# Pinocchio's working memory grows with the cube of the moving joints: 0.3 GB at 150.
MAX_MOVING = 150
EXTENSIONS = ("gazebo", "transmission", "sensor", "ros2_control")  # not the arm's shape: not read
OTHER_FORMATS = {
    "sdf": "SDF; convert it to URDF",
    "mujoco": "a MuJoCo model; convert it to URDF",
    "html": "a web page; download the raw file",
    "COLLADA": "a COLLADA mesh; give the URDF that names it",
}


def refuse_other_formats(robot: Node, path: str) -> None:
    """One clear error for a file that is no URDF yet, instead of one for each of its elements.

    Raises:
        UrdfError: another format, xacro that was not expanded, or a part left in another file.
    """
    if robot.tag != "robot":
        what = OTHER_FORMATS.get(robot.tag, "not a URDF, which starts with <robot name=...>")
        raise UrdfError(f"line {robot.line}: its first element is <{robot.tag[:60]}>: {what}", path)
    pending = deque([robot])
    while pending:
        node = pending.popleft()
        pending.extend(child for child in node.children if child.tag not in EXTENSIONS)
        values = " ".join(node.attributes.values())
        if node.tag.startswith("xacro:") or "${" in values or "$(" in values:
            what = "still holds xacro; end the name of the file in .xacro to expand it"
        elif node.tag.split(":")[-1] == "include":
            what = "would include another file, which is not done; write one URDF with every link"
        else:
            continue
        raise UrdfError(f"line {node.line}: <{node.tag[:60]}> {what}", path)


def read_links(robot: Node, faults: Faults) -> dict[str, Node]:
    """The <link> elements by name, in the order of the file."""
    for node in robot.children:
        known = node.tag in ("link", "joint")
        if not known and close_matches(node.tag, ("link", "joint"), cutoff=0.85):
            faults.error(node, f"<{node.tag}> is no element of URDF; write <link> or <joint>")
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
                node,
                f"link {shown(name)} is already defined on line {links[name].line}; rename one",
            )
        elif name is not None:
            links[name] = node
        shapes = [shape for visual in node.all("visual") for shape in visual.all("geometry")]
        for mesh in (mesh for shape in shapes for mesh in shape.all("mesh")):
            if _leaves_package(mesh.attributes.get("filename", "")):
                faults.error(
                    mesh,
                    f"link {shown(name or '?')}: mesh {shown(mesh.attributes['filename'])} "
                    "climbs out of its package; write the path inside the package",
                )
    return links


def read_tree(robot: Node, links: dict[str, Node], faults: Faults) -> tuple[JointInfo, ...]:
    """The joints from the root outwards; empty when a fault was noted."""
    declared = _joints(robot, links, faults)
    if faults.errors:  # the tree would only echo them
        return ()
    order = _tree(links, declared, faults)
    if faults.soft_limits:
        faults.warnings.append(
            "the soft limits of <safety_controller> are narrower than <limit> and are not used: "
            f"joints {', '.join(faults.soft_limits)}"
        )
    moving = sum(joint.moves for joint in order)
    if moving > MAX_MOVING:
        faults.error(
            robot,
            f"has {moving} moving joints, more than {MAX_MOVING}; make those that the arm does "
            "not need fixed",
        )
    return () if faults.errors else _with_mimic_faults(order)


def _joints(robot: Node, links: dict[str, Node], faults: Faults) -> dict[str, JointInfo]:
    nodes = robot.all("joint")
    if len(nodes) >= MAX_LINKS:
        if len(robot.all("link")) <= MAX_LINKS:  # else that was reported
            faults.error(
                robot,
                f"has {len(nodes):,} joints, more than {MAX_LINKS - 1:,}; a tree of links has one "
                "joint fewer than links",
            )
        return {}
    joints: dict[str, JointInfo] = {}
    lines: dict[str, int] = {}
    for node in nodes:
        name = node.attributes.get("name", "")
        if name and name in lines:
            faults.error(
                node, f"joint {shown(name)} is already defined on line {lines[name]}; rename one"
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
                    "correct the name or add the link",
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
    depth = dict.fromkeys(roots, 0)
    order: list[JointInfo] = []
    pending = deque(roots)
    while pending:
        for joint in below.get(pending.popleft(), ()):
            if joint.child not in depth:
                depth[joint.child] = depth[joint.parent] + 1
                order.append(joint)
                pending.append(joint.child)
    lost = [name for name in links if name not in depth]
    if lost:
        listed = ", ".join(shown(name) for name in lost[:10])
        faults.errors.append(
            f"the links {listed} form a closed loop that hangs on no base; remove the joint that "
            "closes it"
        )
    if max(depth.values(), default=0) > MAX_IN_A_ROW:
        faults.errors.append(
            f"has {max(depth.values())} joints in a row, more than {MAX_IN_A_ROW}; merge links "
            "that do not move"
        )
    return tuple(order)


def _with_mimic_faults(joints: tuple[JointInfo, ...]) -> tuple[JointInfo, ...]:
    """Mark the joints whose mimic has no moving leader."""
    by_name = {joint.name: joint for joint in joints}
    for joint in joints:
        fault = _mimic_fault(joint, by_name)
        if fault is not None and joint.fault is None:
            owner = f"line {joint.line}: joint {shown(joint.name)}"
            fault = f"{owner} {fault}; correct it, or lock the joint"
            by_name[joint.name] = replace(joint, fault=fault)
    return tuple(by_name.values())


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


def _leaves_package(name: str) -> bool:
    """True for a package:// name that climbs out of its package with '..'."""
    if not name.startswith(("package://", "model://")):
        return False
    parts = name.split("://", 1)[1].replace("\\", "/").split("/")
    return min(accumulate({"": 0, ".": 0, "..": -1}.get(part, 1) for part in parts)) < 0
