"""Where the nodes of a glTF scene put its meshes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from surfaces.meshes.files.gltf_json import Json
from surfaces.meshes.triangle_mesh import Floats


@dataclass(frozen=True, eq=False, slots=True)
class Placed:
    """A mesh of the scene, and the affine map that puts it there."""

    mesh: Json
    matrix: Floats
    """(3, 4)"""


def placed_meshes(scene: Json) -> Iterator[Placed]:
    """Every mesh that the default scene shows, once for each node that names it.

    Without a scene, all nodes are shown; without nodes, all meshes as they are.

    Raises:
        SurfaceError: nodes that form no tree, are damaged, or bend their mesh with a skeleton.
    """
    nodes = scene.values("nodes")
    if not nodes:
        for mesh in scene.objects("meshes"):
            yield Placed(mesh, np.eye(4)[:3])
        return
    waiting = [(k, np.eye(4)) for k in _roots(scene, len(nodes))]
    seen: set[int] = set()
    while waiting:
        k, above = waiting.pop()
        node = Json(nodes[k], f"nodes[{k}]", k)
        if k in seen:
            raise node.error("is reached twice; the nodes of a scene must form a tree")
        seen.add(k)
        matrix = above @ _matrix(node)
        if not np.isfinite(matrix).all() or np.abs(matrix).max() > 1e12:
            raise node.error("is moved or scaled beyond 1e12")
        if node.has("mesh"):
            if node.has("skin"):
                raise node.error("bends its mesh with a skeleton (skin); export the shape itself")
            yield Placed(scene.item("meshes", node, "mesh"), matrix[:3])
        waiting += [(child, matrix) for child in reversed(node.indices("children", len(nodes)))]


def _roots(scene: Json, count: int) -> list[int]:
    """The nodes at which the scene begins."""
    if scene.values("scenes"):
        chosen = scene if scene.has("scene") else Json({"scene": 0}, scene.where)
        return scene.item("scenes", chosen, "scene").indices("nodes", count)[::-1]
    children: set[int] = set()
    for node in scene.objects("nodes"):
        children.update(node.indices("children", count))
    return [k for k in reversed(range(count)) if k not in children]


def _matrix(node: Json) -> Floats:
    """(4, 4) from the frame of a node to that of its parent."""
    if node.has("matrix"):
        matrix = np.array(node.numbers("matrix", [0.0] * 16)).reshape(4, 4).T  # column by column
        if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            raise node.error("has a 'matrix' whose last row is not 0 0 0 1")
        return matrix
    x, y, z, w = node.numbers("rotation", [0.0, 0.0, 0.0, 1.0])
    length = x * x + y * y + z * z + w * w
    if not 0.98 < length < 1.02:
        raise node.error("has a 'rotation' that is no unit quaternion")
    x, y, z, w = np.array([x, y, z, w]) / np.sqrt(length)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.numbers("scale", [1.0, 1.0, 1.0]))
    matrix[:3, 3] = node.numbers("translation", [0.0, 0.0, 0.0])
    return matrix
