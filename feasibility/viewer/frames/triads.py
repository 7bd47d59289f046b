"""Three short lines for a frame, x red, y green, z blue; and a line from flange to tool point."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from feasibility.viewer import threejs
from feasibility.viewer.meshes import tubes
from feasibility.viewer.robot_visuals import SKELETON, joint_paths
from robots.robot import Robot
from robots.shapes.tool import tool_line

AXES = ((0.85, 0.1, 0.1), (0.1, 0.65, 0.1), (0.1, 0.2, 0.9))
THIN = 0.003  # [1] of the reach: radius of the line from flange to TCP
SMALL = 0.1  # [1] of the reach: length of an axis


def triad(path: str, place: Array, length: float) -> threejs.Command:
    """The axes of a frame.

    Args:
        path: where in the scene tree.
        place: (4, 4) m, the frame in the group that it belongs to.
        length: m, of an axis.
    """
    ends = place[:3, 3] + length * place[:3, :3].T
    points = np.stack([np.broadcast_to(place[:3, 3], (3, 3)), ends], axis=1).reshape(-1, 3)
    return threejs.segments(path, points, (0, 0, 0), colours=np.repeat(AXES, 2, axis=0))


def triads(robot: Robot) -> list[threejs.Command]:
    """The frames of the TCP, of the arm's base, and of the link that carries the surface.

    And a line from the flange to the TCP, where a tool may have no shape of its own.
    """
    import pinocchio as pin

    model, body = robot.model, pin.FrameType.BODY
    base = model.getFrameId(robot.root_link or robot.link_names[0], body)
    shown = {"TCP": robot.tool_frame_id, "base": base}
    if robot.surface_link is not None:
        shown["surface frame"] = model.getFrameId(robot.surface_link, body)
    paths = joint_paths(robot)
    drawn = []
    for name, number in shown.items():
        frame = model.frames[number]
        path = f"{paths[int(frame.parentJoint)]}/frame of the {name}"
        drawn.append(triad(path, frame.placement.homogeneous, SMALL * max(robot.length_unit, 0.2)))
    line = tool_line(robot)
    if (line.ends[0] == line.ends[1]).all():
        return drawn
    rod = tubes([line.ends], THIN * max(robot.length_unit, 0.2))
    path = f"{paths[line.joint]}/flange to TCP"
    return [*drawn, threejs.mesh_object(path, *rod, SKELETON)]
