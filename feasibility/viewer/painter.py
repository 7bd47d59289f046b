"""A view painted without a browser: the picture that a notebook keeps beside the live one.

The commands of the page are painted into a depth buffer, twice as fine as the picture and averaged:
solid triangles first, lines, then what is half transparent, and last what is seen through all.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import entry
from feasibility.viewer.html_page import Camera
from feasibility.viewer.threejs import Command, numbers_of
from surfaces.meshes.triangle_mesh import doubled_areas

LENS = np.tan(np.radians(37.5))  # half the height of meshcat's picture at a distance of 1
NEAR = 0.02  # [m]: what is nearer to the camera is left out
FINER = 2  # pixels painted for one of the picture, each way
LIGHTS = np.array([[0.5, -0.35, 0.8], [-0.6, 0.5, 0.4]])  # towards them, in the root frame
STRENGTHS = np.array([0.5, 0.25])
AMBIENT = 0.42
BIAS = 2e-3  # [1] of the depth: lines on a surface are seen


@dataclass(frozen=True, eq=False, slots=True)
class _Part:
    """One object of the scene, in the root frame."""

    points: Array
    """(V, 3) m."""
    faces: Ints | None
    """(F, 3); None for line segments, two points each."""
    colours: Array
    """(V, 3), 0..1, with the light that falls on each point."""
    opacity: float
    on_top: bool = False


def painted(commands: Iterable[Command], camera: Camera, width: int, height: int) -> Array:
    """A scene as an image (height, width, 3), 0..1.

    Args:
        commands: of the page.
        camera: where it is seen from.
        width: pixels.
        height: pixels.
    """
    tall, wide = FINER * height, FINER * width
    image = np.ones((tall, wide, 3))
    depth = np.full((tall, wide), np.inf)
    # Solid triangles, lines, then what is half transparent.
    parts = sorted(
        _parts(commands), key=lambda part: (part.on_top, part.opacity < 1.0, part.faces is None)
    )
    for part in parts:
        if part.on_top:
            depth = np.full((tall, wide), np.inf)
        seen = _seen(part.points, camera, wide, tall)
        if part.faces is None:
            _draw_lines(*_clipped(seen, part.colours), depth, image)
        else:
            _draw_faces(seen, part.faces, part.colours, part.opacity, depth, image)
    return np.asarray(image.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3)))


def _seen(points: Array, camera: Camera, width: int, height: int) -> Array:
    """(V, 5): position in the camera's frame (right, up, ahead), m, and the size of the picture."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    frame = np.stack([right, np.cross(right, ahead), ahead])
    local = (points - eye) @ frame.T
    scale = 0.5 * height * camera.zoom / LENS
    middle = np.array([0.5 * width, 0.5 * height])
    far = np.maximum(local[:, 2], NEAR)[:, None]
    pixels = middle + scale * local[:, :2] / far * np.array([1.0, -1.0])
    return np.column_stack([pixels, local[:, 2]])


def _clipped(seen: Array, colours: Array) -> tuple[Array, Array]:
    """The segments that lie entirely before the camera."""
    ahead = (seen[:, 2] > NEAR).reshape(-1, 2).all(axis=1).repeat(2)
    return np.ascontiguousarray(seen[ahead]), np.ascontiguousarray(colours[ahead])


def _parts(commands: Iterable[Command]) -> list[_Part]:
    """The objects that are shown, as the commands leave them."""
    objects: dict[str, Command] = {}
    places: dict[str, Array] = {}
    hidden: set[str] = set()
    for command in commands:
        path = command.get("path", "")
        if command["type"] == "set_object":
            objects[path] = command["object"]
        elif command["type"] == "set_transform":
            places[path] = np.reshape(command["matrix"], (4, 4)).T
        elif command.get("property") == "visible":
            (hidden.discard if command["value"] else hidden.add)(path)
    parts = []
    for path, scene in objects.items():
        names = path.strip("/").split("/")
        above = ["/" + "/".join(names[: k + 1]) for k in range(len(names))]
        if not hidden.intersection(above):
            parts.append(_part(scene, [places[p] for p in above if p in places]))
    return parts


def _part(scene: dict[str, Any], places: Sequence[Array]) -> _Part:
    """One object, moved by the frames that it belongs to."""
    place = np.eye(4)
    for matrix in places:
        place = place @ matrix
    data, material = scene["geometries"][0]["data"], scene["materials"][0]
    attributes = data["attributes"]
    points = numbers_of(attributes["position"]).reshape(-1, 3)
    points = np.ascontiguousarray(points @ place[:3, :3].T + place[:3, 3])
    colour = np.array([(material["color"] >> shift) & 255 for shift in (16, 8, 0)]) / 255.0
    colours = np.tile(colour, (len(points), 1))
    if "color" in attributes:
        colours = numbers_of(attributes["color"]).reshape(-1, 3)
    if "index" not in data:
        return _Part(points, None, colours, 1.0)
    faces = numbers_of(data["index"]).reshape(-1, 3).astype(np.int64)
    if material["type"] != "MeshBasicMaterial":
        colours = colours * _light(_normals(points, faces))[:, None]
    on_top = not material.get("depthTest", True)
    return _Part(points, faces, np.minimum(colours, 1.0), float(material["opacity"]), on_top)


def _normals(points: Array, faces: Ints) -> Array:
    """(V, 3) the mean normal of the faces at each point."""
    across = doubled_areas(points, faces)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    return normals


def _light(normals: Array) -> Array:
    """(V,) how bright a point is; either side of a face is lit."""
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    toward = LIGHTS / np.linalg.norm(LIGHTS, axis=1)[:, None]
    return np.asarray(AMBIENT + np.abs((normals / length) @ toward.T) @ STRENGTHS)


@entry
def _draw_faces(seen, faces, colours, opacity, depth, image):  # noqa: ANN001, ANN202
    """Paint triangles; half transparent ones hide nothing."""
    height, width = depth.shape
    for face in range(faces.shape[0]):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        if min(seen[a, 2], seen[b, 2], seen[c, 2]) < NEAR:
            continue
        bx, by = seen[b, 0] - seen[a, 0], seen[b, 1] - seen[a, 1]
        cx, cy = seen[c, 0] - seen[a, 0], seen[c, 1] - seen[a, 1]
        area = bx * cy - by * cx
        if area == 0.0:
            continue
        left = max(int(np.floor(min(seen[a, 0], seen[b, 0], seen[c, 0]))), 0)
        right = min(int(np.ceil(max(seen[a, 0], seen[b, 0], seen[c, 0]))), width - 1)
        top = max(int(np.floor(min(seen[a, 1], seen[b, 1], seen[c, 1]))), 0)
        bottom = min(int(np.ceil(max(seen[a, 1], seen[b, 1], seen[c, 1]))), height - 1)
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                px, py = x + 0.5 - seen[a, 0], y + 0.5 - seen[a, 1]
                v = (px * cy - py * cx) / area
                w = (bx * py - by * px) / area
                u = 1.0 - v - w
                if u < 0.0 or v < 0.0 or w < 0.0:
                    continue
                far = 1.0 / (u / seen[a, 2] + v / seen[b, 2] + w / seen[c, 2])
                if far >= depth[y, x]:
                    continue
                if opacity >= 1.0:
                    depth[y, x] = far
                for k in range(3):
                    colour = u * colours[a, k] + v * colours[b, k] + w * colours[c, k]
                    image[y, x, k] += opacity * (colour - image[y, x, k])


@entry
def _draw_lines(seen, colours, depth, image):  # noqa: ANN001, ANN202
    """Paint segments, as wide as one pixel of the picture."""
    height, width = depth.shape
    for line in range(0, seen.shape[0] - 1, 2):
        dx, dy = seen[line + 1, 0] - seen[line, 0], seen[line + 1, 1] - seen[line, 1]
        steps = int(min(max(abs(dx), abs(dy)), 4.0 * (height + width))) + 1
        for step in range(steps + 1):
            share = step / steps
            far = 1.0 / ((1.0 - share) / seen[line, 2] + share / seen[line + 1, 2])
            x = int(np.floor(seen[line, 0] + share * dx))
            y = int(np.floor(seen[line, 1] + share * dy))
            for row in range(max(y, 0), min(y + FINER, height)):
                for column in range(max(x, 0), min(x + FINER, width)):
                    if far * (1.0 - BIAS) < depth[row, column]:
                        for k in range(3):
                            image[row, column, k] = colours[line, k]
