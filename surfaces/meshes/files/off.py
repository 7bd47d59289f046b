"""OFF: counts, vertices, then polygons, as text."""

from __future__ import annotations

from array import array
from typing import BinaryIO

import numpy as np

from surfaces.meshes.files.raw_mesh import MOST_SIDES, Polygons, RawMesh, refuse_large
from surfaces.meshes.files.text import Lines, shown
from surfaces.surface import SurfaceError

_KINDS = (b"OFF", b"COFF", b"NOFF", b"CNOFF")  # with colours, with normals


def read_off(stream: BinaryIO, size: int) -> RawMesh:
    """Read an OFF of `size` bytes.

    Raises:
        SurfaceError: not an OFF, damaged, or too large.
    """
    lines = Lines(stream, b"#")
    words = lines.next("'OFF'")
    if words[0].upper() not in _KINDS:
        raise lines.error(f"should be 'OFF', got {shown(b' '.join(words))}")
    counts = words[1:] or lines.next("the counts")
    if len(counts) < 2:
        raise lines.error("should hold the counts of vertices, faces and edges")
    vertex_count, face_count = lines.whole(counts[0]), lines.whole(counts[1])
    if vertex_count < 0 or face_count < 0:
        raise lines.error(f"holds negative counts: {vertex_count} vertices, {face_count} faces")
    refuse_large(face_count, vertex_count)
    if 6 * vertex_count + 4 * face_count > size + 2:  # "0 0 0" and "1 0", each with its line's end
        raise SurfaceError(
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
