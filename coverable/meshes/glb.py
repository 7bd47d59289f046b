"""GLB (binary glTF 2.0): a scene of meshes whose numbers all lie in the one file.

Read after the specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Files that
a scene names are never opened; materials, images, cameras and animations are left aside.

trimesh was tried and is not used here. It takes sparse numbers, skeletons, nodes in a circle and
negative offsets without a word, reads no fans and no normalized positions, and copies each view of
a buffer however many overlap: the scene had to be checked and written anew for it, which took more
code than reading the numbers does.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array
from coverable.meshes.raw_mesh import MeshError, RawMesh, joined, no_triangles, refuse_large

LARGEST_JSON = 8 << 20  # bytes; numbers lie in the other chunk
MOST_PARTS = 10_000
_JSON, _BIN = 0x4E4F534A, 0x004E4942  # kinds of chunks
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of a primitive; lower ones are points and lines
# Extensions that a file may insist on without changing the shape.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_mesh_quant")
MOST_ENTRIES = 100_000  # of a list: nodes, accessors
Json = dict[str, Any]
_SHAPE = {"attributes": {"POSITION": int}, "indices": int, "mode": int, "targets": object}
_SHAPE["material"] = object
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
    "materials": object,
}


class _Placed(NamedTuple):
    """A primitive of the scene, and the affine map (3, 4) that puts it there."""

    primitive: Json
    matrix: Array
    where: str


def read_glb(stream: BinaryIO, size: int) -> RawMesh:
    """Read a GLB of `size` bytes: the triangles of its scene, placed as its nodes say.

    Raises:
        MeshError: not a GLB, damaged, too large, or with what we do not read.
    """
    scene, data = _scene(stream, size)
    parts, others = _parts(scene, data)
    mesh = joined(parts)
    notes = ["a GLB's y axis points up; the part is taken as the file has it"]
    if len(parts) > 1:
        notes.append(f"{len(parts)} meshes of the file's scene were joined")
    if others:
        notes.append(f"points and lines ({others} of the scene's meshes) were left out")
    return RawMesh(mesh.vertices, mesh.faces, (*notes, *mesh.notes))


def read_glb_parts(stream: BinaryIO, size: int) -> list[RawMesh]:
    """Read a GLB as `read_glb` does, mesh by mesh with their colours."""
    return _parts(*_scene(stream, size))[0]


def _scene(stream: BinaryIO, size: int) -> tuple[Json, bytes]:
    """What is read of a scene, and the bytes of its numbers."""
    content, data = _chunks(stream, size)
    scene = _checked(content)
    for name in scene.get("extensionsRequired", []):
        if not name.startswith(_HARMLESS):
            raise MeshError(
                f"needs the glTF extension {name!r}, which is not read; export it without "
                "compression and extensions"
            )
    return scene, data


def _parts(scene: Json, data: bytes) -> tuple[list[RawMesh], int]:
    """The meshes of triangles that a scene shows, and how many others it has."""
    parts: list[RawMesh] = []
    others = faces = vertices = 0
    for placed in _placed_primitives(scene):
        # A small file can show one mesh many times, so all is counted before it is made.
        if len(parts) + others >= MOST_PARTS:
            raise MeshError(f"has more than {MOST_PARTS} meshes; join them before exporting")
        mode = placed.primitive.get("mode", _TRIANGLES)
        if mode < _TRIANGLES:
            others += 1
            continue
        attributes, where = placed.primitive.get("attributes", {}), placed.where
        if "POSITION" not in attributes:
            raise MeshError(f"{where} has no 'POSITION'")
        position = _item(scene, "accessors", attributes["POSITION"], where)
        listed = placed.primitive.get("indices", attributes["POSITION"])
        corners = _item(scene, "accessors", listed, where).get("count", 0)
        faces += corners // 3 if mode == _TRIANGLES else max(corners - 2, 0)
        vertices += position.get("count", 0)
        refuse_large(faces, vertices)
        parts.append(_primitive(scene, data, placed, mode))
    if not faces:
        raise no_triangles()
    return parts, others


def _rgba(scene: Json, primitive: Json) -> tuple[float, ...] | None:
    """The plain colour of a primitive's material; None where there is none that can be read."""
    try:
        material = scene["materials"][primitive["material"]]
        factors = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", [1.0] * 4)
        rgba = tuple(_checked(factors, [float] * 4))
    except (KeyError, IndexError, TypeError, AttributeError, MeshError):
        return None
    return tuple(min(max(part, 0.0), 1.0) for part in rgba)


def _chunks(stream: BinaryIO, size: int) -> tuple[Any, bytes]:
    """The scene as decoded JSON, and the bytes of the numbers."""
    head = stream.read(20)
    if len(head) < 20:
        raise MeshError(f"is {size} bytes long, too short for a GLB; it was cut short")
    magic, version, length, json_length, kind = struct.unpack("<4sIIII", head)
    if magic != b"glTF" or version != 2:
        raise MeshError(f"is no GLB of version 2 (it starts with {magic!r}, {version})")
    if length != size:
        raise MeshError(
            f"has {size:,} bytes, but its header gives {length:,}; it is damaged or cut short"
        )
    if kind != _JSON or json_length > size - 20:
        raise MeshError("does not start with its scene (a JSON chunk); it is damaged")
    if json_length > LARGEST_JSON:
        raise MeshError(
            f"describes its scene in {json_length:,} bytes, where {LARGEST_JSON:,} are read; "
            "export it with fewer parts"
        )
    try:
        content = json.loads(stream.read(json_length).decode("utf-8"))
    except RecursionError as error:
        raise MeshError("describes its scene in no valid JSON: it is nested too deeply") from error
    except ValueError as error:  # UnicodeDecodeError is one
        raise MeshError(f"describes its scene in no valid JSON: {error}"[:200]) from error
    head = stream.read(8)
    if not head:
        return content, b""
    data_length, kind = struct.unpack("<II", head.ljust(8, b"\0"))
    if kind != _BIN or data_length > size - 28 - json_length:
        raise MeshError("has no complete chunk of numbers (BIN) after its scene; it is damaged")
    return content, stream.read(data_length)


def _checked(value: Any, schema: Any = _SCENE, where: str = "") -> Any:
    """The part of decoded JSON that the schema names; refuses other types and ranges."""
    fault = ""
    if isinstance(schema, dict):
        if isinstance(value, dict):
            start = where and where + "."
            return {k: _checked(value[k], s, start + k) for k, s in schema.items() if k in value}
        fault = "a JSON object"
    elif isinstance(schema, list):
        if isinstance(value, list) and len(schema) in (1, len(value)):
            if len(value) <= MOST_ENTRIES:
                return [_checked(item, schema[0], f"{where}[{k}]") for k, item in enumerate(value)]
            raise MeshError(
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
        raise MeshError(f"{where or 'its scene'} must be {fault}")
    return value


def _item(scene: Json, key: str, k: int | None, owner: str) -> Json:
    """Entry k of a list of the scene, which `owner` names; refuses one that is not there."""
    entries = scene.get(key, [])
    if k is None or k >= len(entries):
        raise MeshError(f"{owner} names {key}[{k}], of {len(entries)}; the file is damaged")
    return entries[k]


def _placed_primitives(scene: Json) -> Iterator[_Placed]:
    """Every primitive that the default scene shows, once for each node that names its mesh.

    Without a scene, all nodes are shown; without nodes, all meshes as they are.

    Raises:
        MeshError: nodes that form no tree, are damaged, or deform their mesh with a skeleton.
    """
    nodes = scene.get("nodes") or [{"mesh": k} for k in range(len(scene.get("meshes", [])))]
    if scene.get("nodes") and scene.get("scenes"):
        roots = _item(scene, "scenes", scene.get("scene", 0), "the file").get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", ())}
        roots = [k for k in range(len(nodes)) if k not in children]
    waiting = [(k, np.eye(4), "the scene") for k in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        k, above, owner = waiting.pop()
        where = f"nodes[{k}]"
        node = _item({"nodes": nodes}, "nodes", k, owner)
        if k in seen:
            raise MeshError(f"{where} is reached twice; the nodes of a scene must form a tree")
        seen.add(k)
        matrix = above @ _matrix(node, where)
        if not np.isfinite(matrix).all() or np.abs(matrix).max() > 1e12:
            raise MeshError(f"{where} is moved or scaled beyond 1e12")
        if "mesh" in node:
            if "skin" in node:
                raise MeshError(
                    f"{where} deforms its mesh with a skeleton (skin); export the shape itself"
                )
            mesh = _item(scene, "meshes", node["mesh"], where)
            for number, primitive in enumerate(mesh.get("primitives", [])):
                name = f"meshes[{node['mesh']}].primitives[{number}]"
                yield _Placed(primitive, matrix[:3], name)
        waiting += [(c, matrix, f"{where}.children") for c in reversed(node.get("children", []))]


def _matrix(node: Json, where: str) -> Array:
    """(4, 4) from the frame of a node to that of its parent."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], float).reshape(4, 4).T  # written column by column
        if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            raise MeshError(f"{where} has a 'matrix' whose last row is not 0 0 0 1")
        return matrix
    quaternion = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    if not 0.98 < sum(part * part for part in quaternion) < 1.02:
        raise MeshError(f"{where} has a 'rotation' that is no unit quaternion")
    matrix = np.eye(4)
    if "rotation" in node:
        from scipy.spatial.transform import Rotation

        matrix[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    matrix[:3, :3] *= np.array(node.get("scale", [1.0] * 3), float)
    matrix[:3, 3] = node.get("translation", [0.0] * 3)
    return matrix


def _primitive(scene: Json, data: bytes, placed: _Placed, mode: int) -> RawMesh:
    """The triangles of one primitive, placed."""
    primitive, matrix = placed.primitive, placed.matrix
    points = _numbers(scene, data, primitive["attributes"]["POSITION"], "VEC3")
    if "indices" in primitive:
        indices = _numbers(scene, data, primitive["indices"], "SCALAR")
        if indices.dtype.kind != "u":
            raise MeshError(f"{placed.where} has indices that are not whole numbers >= 0")
        order = indices[:, 0].astype(np.int64)
    else:
        order = np.arange(len(points), dtype=np.int64)
    if mode == _TRIANGLES:
        if len(order) % 3:
            raise MeshError(f"{placed.where} has {len(order)} corners, which is no multiple of 3")
        faces = order.reshape(-1, 3)
    elif mode in (_STRIP, _FAN):
        k = np.arange(max(len(order) - 2, 0))
        odd, first = (k % 2, k) if mode == _STRIP else (0 * k, 0 * k)
        faces = order[np.column_stack([first, k + 1 + odd, k + 2 - odd])]
        # A strip repeats corners to jump; such steps are no faces.
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    else:
        raise MeshError(f"{placed.where}.mode must be in 0 .. {_FAN}, got {mode}")
    notes = ("shapes that the mesh could be morphed into were left out",)
    with np.errstate(all="ignore"):  # numbers that are not finite are refused later
        points = points.astype(float) @ matrix[:, :3].T + matrix[:, 3]
    if np.linalg.det(matrix[:, :3]) < 0.0:
        faces = faces[:, ::-1]  # a mirror image keeps its outer side
    return RawMesh(points, faces, notes * ("targets" in primitive), _rgba(scene, primitive))


def _numbers(scene: Json, data: bytes, k: int, kind: str) -> NDArray[Any]:
    """(count, 1) or (count, 3) numbers of accessor k, for a kind of SCALAR or VEC3."""
    accessor, where = scene["accessors"][k], f"accessors[{k}]"
    width = {"SCALAR": 1, "VEC3": 3}[kind]
    if accessor.get("type") != kind:
        raise MeshError(f"{where} must be of type {kind}")
    if "sparse" in accessor:
        raise MeshError(f"{where} is sparse, which is not read; export it without")
    if accessor.get("componentType") not in _TYPES:
        raise MeshError(f"{where} has no component type of glTF")
    number = np.dtype(_TYPES[accessor["componentType"]])
    view = _item(scene, "bufferViews", accessor.get("bufferView"), where)
    buffer = view.get("buffer", 0)
    if "uri" in _item(scene, "buffers", buffer, where) or buffer != 0:
        raise MeshError(
            f"buffers[{buffer}] lies outside the file; export it as one .glb that holds everything"
        )
    count, row = accessor.get("count", 0), width * number.itemsize
    start, offset = view.get("byteOffset", 0), accessor.get("byteOffset", 0)
    stride = view.get("byteStride", row)
    needed = offset + (count - 1) * stride + row if count else 0
    length = view.get("byteLength", 0)
    if needed > length or start + length > len(data) or not row <= stride <= 252:
        raise MeshError(
            f"{where} needs {needed} bytes in steps of {stride}, where its view has {length} at "
            f"{start} of {len(data)}; the file is damaged"
        )
    if not count:
        return np.empty((0, width), number)
    rows = np.ndarray((count, width), number, data, start + offset, (stride, number.itemsize))
    if accessor.get("normalized", False) and number.kind in "iu":
        # Whole numbers that stand for -1 .. 1 or 0 .. 1.
        return np.maximum(rows / float(np.iinfo(number).max), -1.0)
    return np.array(rows)
