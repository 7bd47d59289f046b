"""The comment at the head of a program: what it is of, its axes, the frames of tool and part."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.collisions.words import listed_words
from feasibility.programs.controller_axes import AxisMap
from feasibility.programs.controllers import KRL, RAPID, URSCRIPT, Language
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.version import version
from robots.robot import Robot
from surfaces.surface import Surface

FLANGES = ("tool0", "flange", "ee_link")


def frame_words(language: Language, frame: Array) -> str:
    """A frame (4, 4) m as a controller's display or language has it.

    Example:
        >>> frame = np.eye(4)
        >>> frame[:3, 3] = 0.1, 0.0, -0.25
        >>> frame_words(KRL, frame)
        '{X 100, Y 0, Z -250, A 0, B 0, C 0}'
    """
    turn = Rotation.from_matrix(frame[:3, :3])
    metres, mm = (_numbers(scale * frame[:3, 3]) for scale in (1.0, 1e3))
    fixed = _numbers(turn.as_euler("xyz", degrees=True))  # about x, y and z as they stand
    if language is URSCRIPT:
        return f"p[{', '.join([*metres, *_numbers(turn.as_rotvec())])}]"
    if language is RAPID:
        quaternion = _numbers(turn.as_quat(canonical=True, scalar_first=True))
        return f"[[{','.join(mm)}],[{','.join(quaternion)}]]"
    if language is KRL:
        return "{" + _named("X Y Z A B C", [*mm, *reversed(fixed)], ", ") + "}"
    return f"{_named(language.frame, [*mm, *fixed], ' ')} (mm, deg)"


def head(
    axes: AxisMap,
    robot: Robot,
    run: Trajectory,
    case: str,
    surface: Surface | None,
    switched: Sequence[tuple[float, float]],
) -> list[str]:
    """The comment, in lines of plain ASCII.

    The frame of the surface is stated; on the stretches `switched` (s) the tool is on.
    """
    flange, tool = _tool(robot)
    lines = [
        f"{axes.language.name} program of a coverage motion, written by coverable {version()}",
        f"case: {case:.200}; robot: {robot.name:.80}; {run.duration:.3f} s",
        f"{listed_words(run.collisions)}, and dynamics are not checked",
        f"tool: {frame_words(axes.language, tool)} from {flange}",
    ]
    if surface is not None:
        link, part = _part(robot, surface)
        lines.append(f"part: {frame_words(axes.language, part)} from {link}")
    lines += axes.words(robot)
    if switched:
        stretches = counted(len(switched), "stretch", "stretches")
        lines.append(f"The tool is on along {stretches}; how exactly is the controller's affair.")
    lines += [
        "Angles are those of the URDF: compare a few poses with the controller's display first.",
        "No controller has run a program of this kind yet: it follows the language's description.",
        "The move to the first point is not checked. Run it dry, at reduced speed, before use.",
    ]
    return ["".join(c if " " <= c <= "~" else "?" for c in line) for line in lines]


def _tool(robot: Robot) -> tuple[str, Array]:
    """The flange, or what is nearest to one, and the tool centre point (4, 4) m in its frame."""
    model = robot.model
    last = model.frames[robot.tool_frame_id].parentJoint
    own = [f for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint == last]
    named = sorted((FLANGES.index(f.name), k) for k, f in enumerate(own) if f.name in FLANGES)
    flange = own[named[0][1] if named else 0]
    tcp = model.frames[robot.tool_frame_id].placement
    return f"link {flange.name}", np.array(flange.placement.actInv(tcp).homogeneous)


def _part(robot: Robot, surface: Surface) -> tuple[str, Array]:
    """What the part stands on, and its frame (4, 4) m in that one's."""
    part = np.eye(4)
    part[:3, :3], part[:3, 3] = surface.rotation, surface.position
    if robot.surface_link is not None:
        return f"{robot.surface_link}, which carries it", part
    root = f"link {robot.root_link or robot.link_names[0]}"
    if any(axis.carries == "base" for axis in robot.axes):
        root += ", with the axes that carry it at zero"
    return root, np.array(np.linalg.inv(robot.base) @ part)


def _numbers(values: Array) -> list[str]:
    """Short decimal numbers."""
    return [f"{value + 0.0:.10g}" for value in np.round(values, 6).tolist()]


def _named(names: str, values: Sequence[str], between: str) -> str:
    return between.join(
        f"{name} {value}" for name, value in zip(names.split(), values, strict=True)
    )
