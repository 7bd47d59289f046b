"""roboplan's Cartesian planner, from starts that its own IK finds.

It follows whole poses, so that it is asked only where the roll is fixed.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from squares import BASE, FIXED_DEG, LINE, TIP, Floats, Square

PACKAGE = "roboplan"
GROUP = "manipulator"
SRDF = f"""
<robot name="arm">
  <group name="{GROUP}"><chain base_link="{BASE}" tip_link="{TIP}"/></group>
</robot>
"""
HOME = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
ACCELERATION = 5.0  # [rad/s^2] of every joint, as in roboplan's own model of this arm
STARTS = 10  # the first from a home posture, the others from anywhere


def prepare(square: Square, urdf: str) -> Callable[[], tuple[str, Floats | None]]:
    """What answers the question."""
    from roboplan.cartesian_planning import CartesianPathPlanner, CartesianPlannerOptions
    from roboplan.core import (
        CartesianConfiguration,
        CartesianPath,
        JointConfiguration,
        Scene,
        loadJointLimitsConfig,
        loadUrdfSceneDescriptionFromXml,
    )
    from roboplan.simple_ik import SimpleIk, SimpleIkOptions

    scene = Scene("square", loadUrdfSceneDescriptionFromXml(urdf))
    scene.importSrdf(SRDF)
    names = scene.getJointNames()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "limits.yaml"
        limits = (f"  {name}: {{max_acceleration: [{ACCELERATION}]}}" for name in names)
        file.write_text("\n".join(["joint_limits:", *limits]))
        scene.importJointLimitsFromConfig(loadJointLimitsConfig(file))
    poses = np.broadcast_to(np.eye(4), (len(square.points()), 4, 4)).copy()
    poses[:, :3, :3], poses[:, :3, 3] = square.rotations()[0], square.points()
    options = CartesianPlannerOptions(
        group_name=GROUP,
        max_position_error=LINE,
        max_orientation_error=float(np.radians(FIXED_DEG)),
    )
    ik = SimpleIk(scene, SimpleIkOptions(group_name=GROUP, max_time=0.1, max_restarts=10))
    planner = CartesianPathPlanner(scene, options)
    first = CartesianConfiguration(BASE, TIP, poses[0])
    path = CartesianPath([BASE], [TIP], [list(poses)])

    def answer() -> tuple[str, Floats | None]:
        scene.setRngSeed(0)
        ik.setRngSeed(0)
        said = "no start was found"
        for number in range(STARTS):
            guess, start = JointConfiguration(), JointConfiguration()
            guess.joint_names = names
            guess.positions = scene.randomPositions() if number else HOME
            if not ik.solveIk(first, guess, start):
                continue
            try:
                found = planner.plan(path, start)
            except RuntimeError as error:
                said = f"none from {STARTS} starts; the last: {str(error).split(':')[0]}"
                continue
            return f"a trajectory of {found.times[-1]:.0f} s", np.array(found.positions)
        return said, None

    return answer
