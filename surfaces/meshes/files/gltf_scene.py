"""The scene of an untrusted glTF: its values by their types, and where its nodes put its meshes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from surfaces.meshes.triangle_mesh import Floats
from surfaces.surface import SurfaceError

MOST_ENTRIES = 100_000  # of a list: nodes, accessors
Json = dict[str, Any]
_SHAPE = {"attributes": {"POSITION": int}, "indices": int, "mode": int, "targets": object}
_NUMBERS = dict.fromkeys(("bufferView", "byteOffset", "componentType", "count"), int)
_VIEW = dict.fromkeys(("buffer", "byteOffset", "byteLength", "byteStride"), int)
# What is read of a scene. Whole numbers are indices, counts and sizes, so never negative; one type
# in a list stands for any number of entries.
_SCENE: Json = {
    "extensionsRequired": [str],
    "scene": int,
    "scenes": [{"nodes": [int]}],
    "nodes": [
        {"children": [int], "mesh": int, "skin": object, "matrix": [float] * 16}
        | {"translation": [float] * 3, "rotation": [float] * 4, "scale": [float] * 3}
    ],
    "meshes": [{"primitives": [_SHAPE]}],
    "accessors": [_NUMBERS | {"type": str, "normalized": bool, "sparse": object}],
    "bufferViews": [_VIEW],
    "buffers": [{"uri": object}],
}


@dataclass(frozen=True, eq=False, slots=True)
class Placed:
    """A primitive of the scene, and the affine map that puts it there."""

    primitive: Json
    matrix: Floats
    """(3, 4)"""
    where: str


def checked(value: Any, schema: Any = _SCENE, where: str = "") -> Any:
    """The part of decoded JSON that the schema names.

    Raises:
        SurfaceError: a value is of another type, or a number is out of range.
    """
    fault = ""
    if isinstance(schema, dict):
        if isinstance(value, dict):
            start = where and where + "."
            return {k: checked(value[k], s, start + k) for k, s in schema.items() if k in value}
        fault = "a JSON object"
    elif isinstance(schema, list):
        if isinstance(value, list) and len(schema) in (1, len(value)):
            if len(value) <= MOST_ENTRIES:
                return [checked(item, schema[0], f"{where}[{k}]") for k, item in enumerate(value)]
            raise SurfaceError(
                f"lists {len(value)} {where}, more than {MOST_ENTRIES}; join its parts before "
                "exporting"
            )
        fault = f"a list of {len(schema)} numbers" if len(schema) > 1 else "a list"
    elif schema is int and not (type(value) is int and 0 <= value < 1 << 40):
        fault = f"a whole number in 0 .. {1 << 40}"
    elif schema is float and not (type(value) in (int, float) and abs(value) <= 1e12):
        fault = "a number within 1e12"
    elif schema in (str, bool) and not isinstance(value, schema):
        fault = "a text" if schema is str else "a truth value"
    if fault:
        raise SurfaceError(f"{where or 'its scene'} must be {fault}")
    return value


def item(scene: Json, key: str, k: int | None, owner: str) -> Json:
    """Entry k of a list of the scene, which `owner` names.

    Raises:
        SurfaceError: there is none.
    """
    entries = scene.get(key, [])
    if k is None or k >= len(entries):
        raise SurfaceError(f"{owner} names {key}[{k}], of {len(entries)}; the file is damaged")
    return entries[k]


def placed_primitives(scene: Json) -> Iterator[Placed]:
    """Every primitive that the default scene shows, once for each node that names its mesh.

    Without a scene, all nodes are shown; without nodes, all meshes as they are.

    Raises:
        SurfaceError: nodes that form no tree, are damaged, or bend their mesh with a skeleton.
    """
    nodes = scene.get("nodes") or [{"mesh": k} for k in range(len(scene.get("meshes", [])))]
    if scene.get("nodes") and scene.get("scenes"):
        roots = item(scene, "scenes", scene.get("scene", 0), "the file").get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", ())}
        roots = [k for k in range(len(nodes)) if k not in children]
    waiting = [(k, np.eye(4), "the scene") for k in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        k, above, owner = waiting.pop()
        where = f"nodes[{k}]"
        node = item({"nodes": nodes}, "nodes", k, owner)
        if k in seen:
            raise SurfaceError(f"{where} is reached twice; the nodes of a scene must form a tree")
        seen.add(k)
        matrix = above @ _matrix(node, where)
        if not np.isfinite(matrix).all() or np.abs(matrix).max() > 1e12:
            raise SurfaceError(f"{where} is moved or scaled beyond 1e12")
        if "mesh" in node:
            if "skin" in node:
                raise SurfaceError(
                    f"{where} bends its mesh with a skeleton (skin); export the shape itself"
                )
            mesh = item(scene, "meshes", node["mesh"], where)
            for number, primitive in enumerate(mesh.get("primitives", [])):
                name = f"meshes[{node['mesh']}].primitives[{number}]"
                yield Placed(primitive, matrix[:3], name)
        waiting += [(c, matrix, f"{where}.children") for c in reversed(node.get("children", []))]


def _matrix(node: Json, where: str) -> Floats:
    """(4, 4) from the frame of a node to that of its parent."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], float).reshape(4, 4).T  # written column by column
        if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            raise SurfaceError(f"{where} has a 'matrix' whose last row is not 0 0 0 1")
        return matrix
    quaternion = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    if not 0.98 < sum(part * part for part in quaternion) < 1.02:
        raise SurfaceError(f"{where} has a 'rotation' that is no unit quaternion")
    matrix = np.eye(4)
    if "rotation" in node:
        matrix[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    matrix[:3, :3] *= np.array(node.get("scale", [1.0] * 3), float)
    matrix[:3, 3] = node.get("translation", [0.0] * 3)
    return matrix
