"""GLB (binary glTF 2.0): a scene of meshes whose numbers all lie in the one file.

Read after the specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Files that
a scene names are never opened; materials, images, cameras and animations are left aside.
"""

from __future__ import annotations

import json
import struct
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfaces.meshes.files.gltf_json import Json
from surfaces.meshes.files.gltf_nodes import Placed, placed_meshes
from surfaces.meshes.files.raw_mesh import RawMesh, joined, no_triangles, refuse_large
from surfaces.surface import SurfaceError

LARGEST_JSON = 8 << 20  # bytes; numbers lie in the other chunk
MOST_PARTS = 10_000
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
# Extensions that a file may insist on without changing the shape.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_mesh_quant")


def read_glb(stream: BinaryIO, size: int) -> RawMesh:
    """Read a GLB of `size` bytes: the triangles of its scene, placed as its nodes say.

    Raises:
        SurfaceError: not a GLB, damaged, too large, or with what we do not read.
    """
    scene, data = _chunks(stream, size)
    for name in scene.strings("extensionsRequired"):
        if not name.startswith(_HARMLESS):
            raise SurfaceError(
                f"needs the glTF extension {name!r}, which is not read; export it without "
                "compression and extensions"
            )
    parts: list[RawMesh] = []
    others = faces = vertices = 0
    for placed in placed_meshes(scene):
        for primitive in placed.mesh.objects("primitives"):
            # A small file can show one mesh many times, so all is counted before it is made.
            if len(parts) + others >= MOST_PARTS:
                raise SurfaceError(f"has more than {MOST_PARTS} meshes; join them before exporting")
            mode = primitive.integer("mode", 0, 6, _TRIANGLES)
            if mode < _TRIANGLES:
                others += 1
                continue
            faces += _count(scene, primitive, mode)
            attributes = primitive.inner("attributes")
            vertices += scene.item("accessors", attributes, "POSITION").integer("count", 0)
            refuse_large(faces, vertices)
            parts.append(_primitive(scene, data, primitive, mode, placed))
    if not faces:
        raise no_triangles()
    mesh = joined(parts)
    notes = ["a GLB's y axis points up; the part is taken as the file has it"]
    if len(parts) > 1:
        notes.append(f"{len(parts)} meshes of the file's scene were joined")
    if others:
        notes.append(f"points and lines ({others} of the scene's meshes) were left out")
    return RawMesh(mesh.vertices, mesh.faces, (*notes, *mesh.notes))


def _chunks(stream: BinaryIO, size: int) -> tuple[Json, bytes]:
    """The scene, and the bytes of the numbers."""
    head = stream.read(20)
    if len(head) < 20:
        raise SurfaceError(f"is {size} bytes long, too short for a GLB; it was cut short")
    magic, version, length, json_length, json_kind = struct.unpack("<4sIIII", head)
    if magic != b"glTF" or version != 2:
        raise SurfaceError(f"is no GLB of version 2 (it starts with {magic!r}, {version})")
    if length != size:
        raise SurfaceError(f"has {size:,} bytes, but says {length:,}; it is damaged or cut short")
    if json_kind != 0x4E4F534A or json_length > size - 20:
        raise SurfaceError("does not start with its scene (a JSON chunk); it is damaged")
    if json_length > LARGEST_JSON:
        raise SurfaceError(
            f"describes its scene in {json_length:,} bytes, where {LARGEST_JSON:,} are read; "
            "export it with fewer parts"
        )
    try:
        content = json.loads(stream.read(json_length).decode("utf-8"))
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError is a ValueError
        raise SurfaceError(f"describes its scene in no valid JSON: {error}"[:200]) from error
    head = stream.read(8)
    if not head:
        return Json(content, "scene"), b""
    if len(head) < 8:
        raise SurfaceError("ends within the head of its second chunk; it is damaged")
    data_length, data_kind = struct.unpack("<II", head)
    if data_kind != 0x004E4942 or data_length > size - 28 - json_length:
        raise SurfaceError("has no whole chunk of numbers (BIN) after its scene; it is damaged")
    return Json(content, "scene"), stream.read(data_length)


def _count(scene: Json, primitive: Json, mode: int) -> int:
    """How many triangles a primitive has."""
    name = "indices" if primitive.has("indices") else None
    holder = primitive if name else primitive.inner("attributes")
    corners = scene.item("accessors", holder, name or "POSITION").integer("count", 0)
    return corners // 3 if mode == _TRIANGLES else max(corners - 2, 0)


def _primitive(scene: Json, data: bytes, primitive: Json, mode: int, placed: Placed) -> RawMesh:
    """The triangles of one primitive, placed."""
    position = scene.item("accessors", primitive.inner("attributes"), "POSITION")
    points = _accessor(scene, data, position, "VEC3")
    if primitive.has("indices"):
        indices = _accessor(scene, data, scene.item("accessors", primitive, "indices"), "SCALAR")
        if indices.dtype.kind != "u":
            raise primitive.error("has indices that are no whole numbers >= 0")
        order = indices[:, 0].astype(np.int64)
    else:
        order = np.arange(len(points), dtype=np.int64)
    notes = []
    if mode == _TRIANGLES:
        if len(order) % 3:
            raise primitive.error(f"has {len(order)} corners, which are no whole triangles")
        faces = order.reshape(-1, 3)
    else:
        k = np.arange(max(len(order) - 2, 0))
        odd = k % 2 if mode == _STRIP else 0 * k
        first = k if mode == _STRIP else 0 * k
        faces = order[np.column_stack([first, k + 1 + odd, k + 2 - odd])]
        # A strip repeats corners to jump; such steps are no faces.
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if primitive.has("targets"):
        notes.append("shapes that the mesh could be morphed into were left out")
    with np.errstate(all="ignore"):  # numbers that are not finite are refused later
        points = points.astype(float) @ placed.matrix[:, :3].T + placed.matrix[:, 3]
    if np.linalg.det(placed.matrix[:, :3]) < 0.0:
        faces = faces[:, ::-1]  # a mirror image keeps its outer side
    return RawMesh(points, faces, tuple(notes))


def _accessor(scene: Json, data: bytes, accessor: Json, kind: str) -> NDArray[Any]:
    """(count, width) numbers."""
    width = {"SCALAR": 1, "VEC3": 3}[kind]
    if accessor.string("type") != kind:
        raise accessor.error(f"must be of type {kind}")
    if accessor.has("sparse"):
        raise accessor.error("is sparse, which is not read; export it without")
    code = accessor.integer("componentType", 0)
    if code not in _COMPONENTS:
        raise accessor.error(f"has no component type of glTF: {code}")
    number = np.dtype(_COMPONENTS[code])
    count = accessor.integer("count", 0)
    view = scene.item("bufferViews", accessor, "bufferView")
    buffer = scene.item("buffers", view, "buffer")
    if buffer.has("uri") or buffer.index != 0:
        raise buffer.error("lies outside the file; export it as one .glb that holds everything")
    start, length = view.integer("byteOffset", 0, default=0), view.integer("byteLength", 0)
    offset = accessor.integer("byteOffset", 0, default=0)
    row = width * number.itemsize
    stride = view.integer("byteStride", row, 252, default=row)
    needed = offset + (count - 1) * stride + row if count else 0
    if needed > length or start + length > len(data):
        raise accessor.error(
            f"needs {needed} bytes, where its view has {length} at {start} of {len(data)}; "
            "the file is damaged"
        )
    if not count:
        return np.empty((0, width), number)
    rows = np.ndarray((count, width), number, data, start + offset, (stride, number.itemsize))
    if accessor.flag("normalized") and number.kind in "iu":
        # Whole numbers that stand for -1 .. 1 or 0 .. 1.
        return np.maximum(rows / float(np.iinfo(number).max), -1.0)
    return np.array(rows)
