"""OBJ and OFF: vertices and polygons as text. Materials that an OBJ names are never opened."""

from __future__ import annotations

from array import array
from typing import BinaryIO

import numpy as np

from coverable.meshes.raw_mesh import (
    MOST_SIDES,
    Lines,
    MeshError,
    Polygons,
    RawMesh,
    refuse_large,
    shown,
)

_FREEFORM = {b"cstype", b"deg", b"surf", b"curv", b"curv2", b"parm", b"trim", b"hole", b"end"}
_IGNORED = {
    *(b"vt", b"vn", b"vp", b"g", b"s", b"l", b"p", b"usemtl", b"mtllib", b"lod", b"usemap"),
    *(b"maplib", b"bevel", b"c_interp", b"d_interp", b"shadow_obj", b"trace_obj", b"mg"),
}  # fmt: skip
_OFF_KINDS = (b"OFF", b"COFF", b"NOFF", b"CNOFF")  # with colours, with normals


def read_obj(stream: BinaryIO, size: int) -> RawMesh:
    """Read an OBJ; its objects and groups are joined.

    Raises:
        MeshError: not an OBJ, damaged, too large, or of curved patches.
    """
    lines = Lines(stream, b"#")
    numbers, polygons = array("d"), Polygons()
    objects: set[bytes] = set()
    name = b""
    for words in lines:
        word = words[0]
        if words[-1].endswith(b"\\"):
            raise lines.error("goes on in the next line (\\); export the mesh as triangles")
        if word == b"v":
            if len(words) < 4:
                raise lines.error("should be 'v x y z'")
            numbers.extend(lines.floats(words[1:4]))
            refuse_large(0, len(numbers) // 3)
        elif word in (b"f", b"fo"):
            if not 4 <= len(words) <= 1 + MOST_SIDES:
                raise lines.error(
                    f"should be a face of 3 .. {MOST_SIDES} corners, got {len(words) - 1}"
                )
            polygons.add(_corners(lines, words[1:], len(numbers) // 3))
            objects.add(name)
        elif word == b"o":
            name = b" ".join(words[1:])
        elif word in _FREEFORM:
            raise lines.error(f"starts a curved patch ({shown(word)}); export it as triangles")
        elif word not in _IGNORED:
            raise lines.error(f"starts with {shown(word)}, which no OBJ line does")
    mesh = polygons.mesh(np.array(numbers).reshape(-1, 3))
    several = (f"{len(objects)} objects of the file were joined",) * (len(objects) > 1)
    return RawMesh(mesh.vertices, mesh.faces, several + mesh.notes)


def _corners(lines: Lines, words: list[bytes], so_far: int) -> list[int]:
    """Indices from 0 out of 'v', 'v/vt', 'v//vn' or 'v/vt/vn'.

    A file counts from 1, or backwards from the vertex read last as -1.
    """
    indices = []
    for word in words:
        index = lines.whole(word.split(b"/", 1)[0])
        if index == 0 or index < -so_far:
            raise lines.error(
                f"names vertex {index}; an OBJ counts from 1, or from -1 back to -{so_far} here"
            )
        indices.append(index - 1 if index > 0 else so_far + index)
    return indices


def read_off(stream: BinaryIO, size: int) -> RawMesh:
    """Read an OFF of `size` bytes.

    Raises:
        MeshError: not an OFF, damaged, or too large.
    """
    lines = Lines(stream, b"#")
    words = lines.next("'OFF'")
    if words[0].upper() not in _OFF_KINDS:
        raise lines.error(f"should be 'OFF', got {shown(b' '.join(words))}")
    counts = words[1:] or lines.next("the counts")
    if len(counts) < 2:
        raise lines.error("should hold the counts of vertices, faces and edges")
    vertex_count, face_count = lines.whole(counts[0]), lines.whole(counts[1])
    if vertex_count < 0 or face_count < 0:
        raise lines.error(f"holds negative counts: {vertex_count} vertices, {face_count} faces")
    refuse_large(face_count, vertex_count)
    if 6 * vertex_count + 4 * face_count > size + 2:  # "0 0 0" and "1 0", each with its line's end
        raise MeshError(
            f"announces {vertex_count} vertices and {face_count} faces, which {size} bytes cannot "
            "hold; it was cut short"
        )
    numbers, polygons = array("d"), Polygons()
    for k in range(vertex_count):
        words = lines.next(f"vertex {k} of {vertex_count}")
        if len(words) < 3:
            raise lines.error("should hold the three coordinates of a vertex")
        numbers.extend(lines.floats(words[:3]))
    for k in range(face_count):
        words = lines.next(f"face {k} of {face_count}")
        count = lines.whole(words[0])
        if not 3 <= count <= MOST_SIDES or len(words) < 1 + count:
            raise lines.error(
                f"should be a face: a count of 3 .. {MOST_SIDES} corners and as many indices, "
                f"got {shown(b' '.join(words))}"
            )
        polygons.add([lines.whole(word) for word in words[1 : 1 + count]])
    return polygons.mesh(np.array(numbers).reshape(-1, 3))
