"""The arm and what stands around it on a live page, and the sliders that move its joints."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from coverable.arrays import Array
from feasibility.cases.case import Case, Setup
from feasibility.certification.collisions.nearest import nearest_along
from feasibility.collisions.asked_bodies import gather
from feasibility.live.controls import STEP
from feasibility.live.drawing import Scene
from feasibility.viewer import robot_visuals
from feasibility.viewer.html_page import Entry
from feasibility.viewer.obstacles import HULLS, hull_layers, scene_layers, tool_layers
from feasibility.viewer.playback import distance_and_angle
from feasibility.viewer.stage import GROUP, carried, triads
from feasibility.viewer.threejs import Command, safe_name, transform
from feasibility.viewer.verdict_scene import Layer
from feasibility.viewer.viewer import View
from robots.kinematics import Kinematics
from robots.robot import Robot

NOT_DRAWN = ("/surface/patch", "/cells", "/Background", "/Grid", "/Axes")
"""Parts of a view that a live page has not: each answer paints the cells, which are the surface."""
LENS = math.radians(42.0)  # as that of a view
JOG = "joints: move the arm by hand"
TURN = 360.0  # [deg] that the slider of a joint without limits goes to either side


class Arm:
    """Arm, tool, frames and scene of one page."""

    def __init__(self, client: Any, scene: Scene, first: View, setup: Setup, case: Case) -> None:
        """Draw what stands.

        Args:
            client: the window, of viser.
            scene: its picture.
            first: the case as it was given.
            setup: what it builds.
            case: itself.
        """
        self._client, self._scene, self._first = client, scene, setup.robot
        self.setup = setup
        self.group = "" if setup.robot.surface_link is None else GROUP
        self.q = robot_visuals.home(setup.robot)
        """(n,) rad or m, the configuration that is shown."""
        self._standing = _standing(case)
        self._around = list(_around(setup))
        scene.run(
            one for one in first.commands if not any(part in one["path"] for part in NOT_DRAWN)
        )
        client.camera.up_direction = (0.0, 0.0, 1.0)
        client.camera.fov = LENS
        client.camera.position, client.camera.look_at = first.camera.eye, first.camera.target

    def path(self, entry: Entry) -> str:
        """Where a part of the picture is in the scene tree."""
        path = str(entry.path)
        return path if path.startswith(self.group) else self.group + path

    def grouped(self, commands: Iterable[Command]) -> list[Command]:
        """Commands for what is drawn in the frame of the link that carries the surface."""
        return carried(self.setup.robot, commands, [], self.q)[0]

    def stand(self, case: Case, setup: Setup) -> None:
        """Show arm, tool and scene where a changed case has them."""
        self.setup, standing = setup, _standing(case)
        if standing == self._standing:
            return
        self._standing = standing
        self._scene.clear(self.path(layer.entry) for layer in self._around)
        self._around = list(_around(setup))
        commands = [command for layer in self._around for command in layer.commands]
        moved = list(_moved_links(self._first, setup.robot, self._scene, self.group))
        self._scene.run(self.grouped([*moved, *triads(setup.robot), *commands]))
        self.pose(self.q)

    def pose(self, q: Array | None) -> None:
        """Put the arm into a configuration (n,), and the surface that it carries."""
        if q is None:
            return
        self.q, robot = q, self.setup.robot
        roots = [robot_visuals.ROBOT] + [HULLS] * (self.setup.task.collision is not None)
        commands = [one for root in roots for one in robot_visuals.pose(robot, q, root)]
        self._scene.run(self.grouped(commands))
        for slider, value in zip(self.sliders, self._shown(q), strict=True):
            slider.value = value
        self.words.content = ""

    # -- joints ----------------------------------------------------------------------------------

    sliders: Sequence[Any] = ()

    def add_jog(self) -> None:
        """Add a slider for each joint, between its limits, and what is read at that place."""
        gui, robot = self._client.gui, self.setup.robot
        with gui.add_folder(JOG, expand_by_default=False):
            self.words, self.sliders = gui.add_html(""), []
            ends = np.stack([self._shown(robot.lower), self._shown(robot.upper)])
            for joint, (low, high) in enumerate(np.clip(ends, -np.inf, np.inf).T.tolist()):
                low, high = max(low, -TURN * 3), min(high, TURN * 3)
                unit = "mm" if robot.prismatic[joint] else "deg"
                start = float(np.clip(self._shown(self.q)[joint], low, high))
                name = f"{robot.joint_names[joint]} ({unit})"
                slider = gui.add_slider(name, low, high, STEP / 5, initial_value=start)
                slider.on_update(self._jogged)
                self.sliders.append(slider)

    def _jogged(self, event: Any) -> None:
        """A joint was moved by hand."""
        if event.client_id is None:
            return
        robot = self.setup.robot
        values = np.array([slider.value for slider in self.sliders])
        self.pose(values / np.where(robot.prismatic, 1e3, 180.0 / math.pi))
        self.words.content = (
            f'<div style="font-size:85%;margin:0 1em">{html.escape(self.said())}</div>'
        )

    def said(self) -> str:
        """Where the tool is, how it stands to the surface, and which bodies are nearest."""
        robot, cells, task, _ = self.setup
        point, _ = Kinematics(robot).tools(self.q[None])
        x, y, z = 1e3 * point[0]
        (distance,), (angle,) = distance_and_angle(robot, cells, self.q[None])
        words = f"tool at ({x:.1f}, {y:.1f}, {z:.1f}) mm, {distance:.1f} mm from the surface, "
        words += f"{angle:.1f} deg from its normal"
        bodies = gather(robot, cells.surface, task.collision, task.standoff)
        near = None if bodies is None else nearest_along(robot, bodies, self.q[None])
        if near is None:
            return words
        names = " and ".join(near.pairs[int(near.which[0])].names)
        return f"{words}; nearest: {names}, {1e3 * float(near.distances[0]):.1f} mm"

    def _shown(self, q: Array) -> Array:
        """Joints (n,) in degrees or mm."""
        return np.asarray(q * np.where(self.setup.robot.prismatic, 1e3, 180.0 / math.pi))


def _standing(case: Case) -> tuple[Any, Any]:
    """What the picture of the arm and the scene depends on."""
    return replace(case.robot, limits=None, limits_deg=None, limits_m=None), case.collision


def _around(setup: Setup) -> Iterator[Layer]:
    """The tool, the scene, and the convex bodies of the search."""
    robot, cells, task, _ = setup
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is not None:
        yield from (*tool_layers(bodies, robot), *scene_layers(bodies, robot))
        yield from hull_layers(bodies, robot)


def _moved_links(drawn: Robot, robot: Robot, scene: Scene, group: str) -> Iterator[Command]:
    """Links that stand on their joints otherwise than in the arm that was drawn."""
    paths, body = robot_visuals.joint_paths(robot), pin.FrameType.BODY
    for frame in drawn.model.frames:
        path = f"{paths[frame.parentJoint]}/link {safe_name(frame.name)}"
        if frame.type == body and scene.has(group + path):
            new = robot.model.frames[robot.model.getFrameId(frame.name, body)].placement
            yield transform(path, (new * frame.placement.inverse()).homogeneous)
