"""Descartes, the ladder planner of Tesseract, by its Python wrapper and its own IK for this arm."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from squares import BASE, ROLLS, TIP, Floats, Square

PACKAGE = "tesseract-robotics"
NAME = "DEFAULT"
KINEMATICS = f"""
kinematic_plugins:
  search_libraries: [tesseract_kinematics_kdl_factories, tesseract_kinematics_ur_factory]
  fwd_kin_plugins:
    manipulator:
      default: KDLFwdKinChain
      plugins:
        KDLFwdKinChain:
          class: KDLFwdKinChainFactory
          config: {{base_link: {BASE}, tip_link: {TIP}}}
  inv_kin_plugins:
    manipulator:
      default: URInvKin
      plugins:
        URInvKin:
          class: URInvKinFactory
          config: {{base_link: {BASE}, tip_link: {TIP}, model: UR5}}
"""
SRDF = f"""
<robot name="{{name}}" version="1.0.0">
  <group name="manipulator"><chain base_link="{BASE}" tip_link="{TIP}"/></group>
  <kinematics_plugin_config filename="file://{{folder}}/kinematics.yaml"/>
</robot>
"""


def prepare(square: Square, urdf: str) -> Callable[[], tuple[str, Floats | None]]:
    """What answers the question."""
    from tesseract_robotics import tesseract_command_language as language
    from tesseract_robotics import tesseract_motion_planners_descartes as descartes
    from tesseract_robotics.tesseract_common import GeneralResourceLocator, ManipulatorInfo
    from tesseract_robotics.tesseract_environment import Environment
    from tesseract_robotics.tesseract_motion_planners import PlannerRequest

    locator, environment = GeneralResourceLocator(), Environment()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "kinematics.yaml").write_text(KINEMATICS)
        name = ElementTree.fromstring(urdf).get("name")
        if not environment.init(urdf, SRDF.format(name=name, folder=folder), locator):
            raise RuntimeError("Tesseract cannot read the arm")
    manipulator = ManipulatorInfo()
    manipulator.tcp_frame, manipulator.working_frame = TIP, BASE
    manipulator.manipulator = "manipulator"
    profiles = language.ProfileDictionary()
    profile = _profile(descartes, square.fixed)
    profiles.addProfile(NAME, NAME, descartes.cast_DescartesPlanProfileD(profile))
    planner = descartes.DescartesMotionPlannerD(NAME)
    kept = [locator, environment, manipulator, profile, profiles, planner]

    def answer() -> tuple[str, Floats | None]:
        request = PlannerRequest()
        request.instructions = _program(language, square, manipulator)
        request.env, request.profiles = environment, profiles
        response = planner.solve(request)
        kept[6:] = [request, response]  # the wrapper's values are parts of these
        said = str(response.message)
        return said, _joint_values(language, response) if response.successful else None

    return answer


def _profile(descartes: Any, fixed: bool) -> Any:
    """Every roll, 15 degrees apart, or the one that is given; collisions are not asked for."""
    profile = descartes.DescartesDefaultPlanProfileD()
    profile.target_pose_fixed = fixed
    profile.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    profile.target_pose_sample_resolution = 2.0 * np.pi / ROLLS
    profile.target_pose_sample_min = -np.pi
    profile.target_pose_sample_max = np.pi - 2.0 * np.pi / ROLLS
    profile.allow_collision = True
    profile.enable_collision = profile.enable_edge_collision = False
    return profile


def _program(language: Any, square: Square, manipulator: Any) -> Any:
    """Straight moves from pose to pose."""
    from tesseract_robotics.tesseract_common import Isometry3d, Quaterniond, Translation3d

    program = language.CompositeInstruction(NAME)
    program.setManipulatorInfo(manipulator)
    for x, y, z in square.points():
        down = Quaterniond(0.0, 1.0, 0.0, 0.0)  # half a turn about x
        pose = Isometry3d.Identity() * Translation3d(x, y, z) * down
        waypoint = language.CartesianWaypoint(pose)
        move = language.MoveInstruction(
            language.CartesianWaypointPoly_wrap_CartesianWaypoint(waypoint),
            language.MoveInstructionType_LINEAR,
            NAME,
        )
        program.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
    return program


def _joint_values(language: Any, response: Any) -> Floats:
    """(90, 6) rad. Each part of the answer ends with the part that it is of, so all are kept."""
    results = response.results
    flat, rows, kept = results.flatten(), list[Floats](), list[Any]()
    for k in range(len(flat)):
        instruction = flat[k]
        move = language.InstructionPoly_as_MoveInstructionPoly(instruction)
        waypoint = move.getWaypoint()
        state = language.WaypointPoly_as_StateWaypointPoly(waypoint)
        kept += [instruction, move, waypoint, state]
        rows.append(np.array(state.getPosition(), dtype=float).ravel())
    return np.array(rows)
