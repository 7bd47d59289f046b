"""Drawing commands of a view as nodes of a viser scene."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coverable.arrays import Array
from feasibility.viewer.threejs import Command, numbers_of

THIN = 1.5  # pixels


class Scene:
    """What one page shows, by the paths of the scene tree."""

    def __init__(self, scene: Any) -> None:
        """Draw into the scene of a client."""
        self._scene, self._lock = scene, threading.RLock()
        self.nodes: dict[str, Any] = {}
        self.switched: dict[str, bool] = {}
        """What was shown or hidden, which holds for what is drawn there anew."""

    def run(self, commands: Iterable[Command]) -> None:
        """Put objects, place groups, show and hide, as the commands say; animations are not run."""
        with self._lock:
            for command in commands:
                path = command["path"]
                if command["type"] == "set_object":
                    self.nodes[path] = self._object(path, command["object"])
                    self.nodes[path].visible = self.switched.get(path, True)
                elif command["type"] == "set_transform":
                    self.place(path, np.reshape(command["matrix"], (4, 4)).T)
                elif command.get("property") == "visible":
                    self.show(path, self.switched.get(path, bool(command["value"])))

    def place(self, path: str, place: Array) -> None:
        """Move a group to `place` (4, 4), m."""
        with self._lock:
            node = self._node(path)
            node.position, node.wxyz = place[:3, 3], quaternion(place[:3, :3])

    def show(self, path: str, visible: bool) -> None:
        """Show or hide a part of the scene tree."""
        with self._lock:
            self._node(path).visible = self.switched[path] = visible

    def has(self, path: str) -> bool:
        """Is there anything below a path?"""
        return any(one.startswith(f"{path}/") for one in self.nodes)

    def clear(self, roots: Iterable[str]) -> None:
        """Take away some parts with all that is below them."""
        with self._lock:
            for root in roots:
                below = [one for one in self.nodes if one == root or one.startswith(f"{root}/")]
                for path in below:
                    node = self.nodes.pop(path)
                    if not any(path.startswith(f"{other}/") for other in below):
                        node.remove()  # with what is below it

    def _node(self, path: str) -> Any:
        """The object or the group at a path."""
        if path not in self.nodes:
            self.nodes[path] = self._scene.add_frame(path, show_axes=False)
        return self.nodes[path]

    def _object(self, path: str, scene: dict[str, Any]) -> Any:
        """The node of a mesh or of line segments."""
        data, material = scene["geometries"][0]["data"], scene["materials"][0]
        points = numbers_of(data["attributes"]["position"]).reshape(-1, 3)
        colour: Any = tuple((material["color"] >> shift) & 255 for shift in (16, 8, 0))
        if "index" in data:
            faces = numbers_of(data["index"]).reshape(-1, 3).astype(np.uint32)
            opacity = None if material["opacity"] >= 1.0 else material["opacity"]
            return self._scene.add_mesh_simple(
                path, points, faces, color=colour, opacity=opacity, side="double",
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        if "color" in data["attributes"]:
            colour = 255.0 * numbers_of(data["attributes"]["color"]).reshape(-1, 2, 3)
        return self._scene.add_line_segments(
            path, points.reshape(-1, 2, 3), np.asarray(colour, np.uint8), thickness=THIN,
            thickness_units="screen",
        )  # fmt: skip


def quaternion(rotation: Array) -> Array:
    """A rotation (3, 3) as w, x, y, z."""
    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1)


def rotation(wxyz: Array) -> Array:
    """The rotation (3, 3) of w, x, y, z."""
    return np.asarray(Rotation.from_quat(np.roll(wxyz, -1)).as_matrix())
