"""STL, binary and text: triangles one by one, each with corners of its own."""

from __future__ import annotations

from array import array
from typing import BinaryIO

import numpy as np

from coverable.arrays import Array
from coverable.meshes.raw_mesh import (
    BYTE_ORDER_MARK,
    Lines,
    MeshError,
    RawMesh,
    distinct,
    no_triangles,
    refuse_large,
    shown,
)

_HEADER = 84  # bytes
_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_GRAMMAR = (b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet")


def read_stl(stream: BinaryIO, size: int) -> RawMesh:
    """Read an STL of `size` bytes; which kind it is, its size tells.

    Raises:
        MeshError: neither kind, damaged, or too large.
    """
    head = stream.read(_HEADER)
    count = int.from_bytes(head[80:84], "little")
    if len(head) == _HEADER and size == _HEADER + count * _FACET.itemsize:
        refuse_large(count)
        if not count:
            raise no_triangles()
        data = np.frombuffer(stream.read(count * _FACET.itemsize), _FACET)
        return _soup(data["corners"].reshape(-1, 3), data["normal"])
    if head.removeprefix(BYTE_ORDER_MARK).lstrip()[:5].lower() == b"solid" and 0 not in head:
        stream.seek(0)
        return _read_text(stream)
    if len(head) < _HEADER:
        raise MeshError(
            f"is {size} bytes long, too short for a binary STL, and does not start with 'solid' "
            "as a text STL does"
        )
    raise MeshError(
        f"is no STL: it does not start with 'solid' as a text STL does, and as a binary STL of "
        f"{count:,} faces it would have {_HEADER + count * _FACET.itemsize:,} bytes, but has "
        f"{size:,}; it is damaged or cut short, export it again"
    )


def _read_text(stream: BinaryIO) -> RawMesh:
    """Read solid, facet, outer loop, three vertices, endloop, endfacet, ..., endsolid."""
    numbers, normals, lines = array("d"), array("d"), Lines(stream)
    solids, inside, step = 0, False, 0
    for words in lines:
        word = words[0].lower()
        if step == 0 and word == (b"endsolid" if inside else b"solid"):
            inside = not inside
            solids += inside
            continue
        if not inside or word != _GRAMMAR[step]:
            wanted = _GRAMMAR[step] if inside else b"solid"
            raise lines.error(f"should start with {shown(wanted)}, got {shown(words[0])}")
        if word == b"vertex":
            if len(words) != 4:
                raise lines.error(f"should be 'vertex x y z', got {shown(b' '.join(words))}")
            numbers.extend(lines.floats(words[1:]))
        elif word == b"facet":
            # Stored normals are only looked at; one that is missing counts as unknown.
            normals.extend(lines.floats(words[2:5]) if len(words) == 5 else (0.0, 0.0, 0.0))
            refuse_large(len(normals) // 3)
        step = (step + 1) % len(_GRAMMAR)
    if inside or step:
        raise MeshError(f"ends after line {lines.number} without 'endsolid'; it was cut short")
    if not numbers:
        raise no_triangles()
    mesh = _soup(np.array(numbers).reshape(-1, 3), np.array(normals).reshape(-1, 3))
    notes = (f"{solids} solids of the file were joined",) * (solids > 1) + mesh.notes
    return RawMesh(mesh.vertices, mesh.faces, notes)


def _soup(corners: Array, normals: Array) -> RawMesh:
    """Single triangles; equal corners become one vertex, for an STL has no other way to say so.

    The order of the corners says which side is outside, whatever the stored normals say.
    """
    vertices, number = distinct(corners.astype(float) + 0.0)  # -0.0 is 0.0
    faces = number.reshape(-1, 3)
    with np.errstate(all="ignore"):  # numbers that are not finite are refused later
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        along = np.einsum("fi,fi->f", np.cross(b - a, c - a), normals)
    against = int((along < 0.0).sum())
    note = (
        f"the file's own normals of {against} of {len(faces)} faces contradict the order of their "
        "corners; the order counts"
    )
    return RawMesh(vertices, faces, (note,) * bool(against))
