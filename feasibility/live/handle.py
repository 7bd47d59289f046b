"""The handle of a live page: what it moves, and where."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coverable.arrays import Array
from feasibility.cases.case import Setup
from feasibility.live.arm import Arm
from feasibility.live.controls import PLACE, SURFACE, TURN, Controls, Values
from feasibility.live.drawing import quaternion, rotation
from surfaces.surface import rotation_from_rpy

SIZE = 0.25  # [1] of the reach
FINEST = {"mm": 0.1, "deg": 0.01}  # by which the handle moves things


class Handle:
    """Arrows, planes and rings that move the surface, or what else is chosen."""

    def __init__(
        self, client: Any, arm: Arm, controls: Controls, setup: Setup, moved: Callable[..., None]
    ) -> None:
        """Add the handle.

        Args:
            client: the window, of viser.
            arm: the picture of the arm.
            controls: what can be moved.
            setup: the case as it was given.
            moved: called with new values.
        """
        self._values, self._moved = controls.values, moved
        self._first = self._painted = _pose(controls.values, SURFACE)
        middle = setup.cells.centres.mean(axis=0) if len(setup.cells) else self._first[:3, 3]
        inwards = np.linalg.inv(self._first)
        self._middle = inwards[:3, :3] @ middle + inwards[:3, 3]
        self.group = SURFACE
        size = SIZE * max(setup.robot.length_unit, 0.2)
        self.gizmo = client.scene.add_transform_controls(
            arm.group + "/handle", size, depth_test=False
        )
        self.gizmo.on_update(self._dragged)
        if len(controls.in_root_frame) > 1:
            choice = client.gui.add_dropdown("the handle moves", tuple(controls.in_root_frame))
            choice.on_update(lambda event: self.choose(event.target.value))

    def painted(self, values: Values) -> None:
        """The cells are drawn anew, where the surface has these values."""
        self._painted = _pose(values, SURFACE)

    def place(self, values: Values) -> tuple[Array, Array]:
        """Show the handle where it belongs.

        Returns:
            (4, 4) each: by how much the surface and the cells have moved since they were drawn.
        """
        self._values = values
        place = _pose(values, self.group)
        self.gizmo.position = place[:3, :3] @ self._centre + place[:3, 3]
        self.gizmo.wxyz = quaternion(place[:3, :3])
        surface = _pose(values, SURFACE)
        return surface @ np.linalg.inv(self._first), surface @ np.linalg.inv(self._painted)

    @property
    def _centre(self) -> Array:
        """(3,) m, where the handle sits in the frame of what it moves."""
        return self._middle if self.group == SURFACE else np.zeros(3)

    def choose(self, group: str) -> None:
        """Move another thing from now on: the surface, the base or an object."""
        self.group = group
        self.place(self._values)

    def _dragged(self, event: Any) -> None:
        """It was moved by hand: what has hardly moved stays as it was."""
        turn = rotation(event.target.wxyz)
        position = 1e3 * (np.asarray(event.target.position) - turn @ self._centre)
        rpy = Rotation.from_matrix(turn).as_euler("xyz", degrees=True)
        new = Values()
        for names, unit, numbers in ((PLACE, "mm", position), (TURN, "deg", rpy)):
            for name, number in zip(names, numbers.tolist(), strict=True):
                old = self._values[self.group, name]
                off = number - old if unit == "mm" else (number - old + 180.0) % 360.0 - 180.0
                if abs(off) > 0.5 * FINEST[unit]:
                    new[self.group, name] = round(number / FINEST[unit]) * FINEST[unit]
        if new:
            self._moved({dial: round(value, 6) for dial, value in new.items()})


def _pose(values: Values, group: str) -> Array:
    """(4, 4) m, a pose of the page."""
    place = np.eye(4)
    place[:3, :3] = rotation_from_rpy(*np.radians([values[group, name] for name in TURN]))
    place[:3, 3] = np.array([values[group, name] for name in PLACE]) / 1e3
    return place
