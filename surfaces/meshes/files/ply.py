"""PLY, binary and text: a header that names its own columns, then the rows."""

from __future__ import annotations

import struct
from array import array
from typing import BinaryIO

import numpy as np

from surfaces.meshes.files.ply_header import Element, Header, read_header
from surfaces.meshes.files.raw_mesh import MOST_SIDES, RawMesh, refuse_large, triangulated
from surfaces.meshes.files.text import Lines
from surfaces.meshes.triangle_mesh import Floats, Ints
from surfaces.surface import SurfaceError

_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
_FACE_LISTS = ("vertex_indices", "vertex_index")


class _Polygons:
    """Collects the corners of faces."""

    def __init__(self) -> None:
        self.corners = array("q")
        self.sides = array("q")
        self.triangles = 0

    def add(self, corners: list[int]) -> None:
        """One face more."""
        count = len(corners)
        if not 3 <= count <= MOST_SIDES:
            raise SurfaceError(
                f"face {len(self.sides)} (counted from 0) has {count} corners, where 3 .. "
                f"{MOST_SIDES} are taken; export the mesh as triangles"
            )
        self.triangles += count - 2
        refuse_large(self.triangles)
        self.corners.extend(corners)
        self.sides.append(count)

    def arrays(self) -> tuple[Ints, Ints]:
        """Corners of all faces, and how many each has."""
        return np.array(self.corners, np.int64), np.array(self.sides, np.int64)


def read_ply(stream: BinaryIO, size: int) -> RawMesh:
    """Read a PLY of `size` bytes; only positions and faces are taken.

    Raises:
        SurfaceError: not a PLY, damaged, or too large.
    """
    header = read_header(stream, size)
    lines = Lines(stream, number=header.lines)
    vertices: Floats = np.empty((0, 3))
    corners = sides = np.empty(0, np.int64)
    for element in header.elements:
        if element.name == "vertex":
            _check_vertex(element)
            read = _binary_vertices if header.order else None
            vertices = read(stream, header, element) if read else _text_vertices(lines, element)
        else:
            wanted = _face_list(element) if element.name == "face" else -1
            if header.order:
                found = _binary_lists(stream, header, element, wanted)
            else:
                found = _text_lists(lines, element, wanted)
            corners, sides = found if wanted >= 0 else (corners, sides)
    return triangulated(vertices, corners, sides)


def _check_vertex(element: Element) -> None:
    """Vertices need x, y and z, and no lists."""
    names = [item.name for item in element.properties]
    if any(item.count_type for item in element.properties) or not {"x", "y", "z"} <= set(names):
        raise SurfaceError(f"its vertices need x, y and z, and no lists; they have {names}")


def _face_list(element: Element) -> int:
    """Which property of a face holds its corners."""
    for k, item in enumerate(element.properties):
        if item.name in _FACE_LISTS and item.count_type and item.type[0] != "f":
            return k
    names = [item.name for item in element.properties]
    raise SurfaceError(
        f"its faces need a list 'vertex_indices' of whole numbers; they have {names}"
    )


def _bytes(stream: BinaryIO, count: int, element: Element) -> bytes:
    """The next bytes of the file."""
    data = stream.read(count)
    if len(data) < count:
        raise _cut_short(element)
    return data


def _cut_short(element: Element) -> SurfaceError:
    return SurfaceError(f"ends within its {element.count:,} of '{element.name}'; it was cut short")


def _binary_vertices(stream: BinaryIO, header: Header, element: Element) -> Floats:
    """x, y, z of each row."""
    row = np.dtype([(item.name, header.order + item.type) for item in element.properties])
    table = np.frombuffer(_bytes(stream, element.count * row.itemsize, element), row)
    return np.column_stack([table[name].astype(float) for name in ("x", "y", "z")])


def _text_vertices(lines: Lines, element: Element) -> Floats:
    """x, y, z of each line."""
    names = [item.name for item in element.properties]
    x, y, z = (names.index(name) for name in ("x", "y", "z"))
    numbers = array("d")
    for k in range(element.count):
        words = lines.next(f"vertex {k} of {element.count}")
        if len(words) != len(names):
            raise lines.error(f"should hold the {len(names)} numbers of a vertex, got {len(words)}")
        numbers.extend(lines.floats([words[x], words[y], words[z]]))
    return np.array(numbers).reshape(-1, 3)


def _binary_lists(
    stream: BinaryIO, header: Header, element: Element, wanted: int
) -> tuple[Ints, Ints]:
    """The wanted list of each row (none for -1), and how long each is."""
    start = stream.tell()
    uniform = _uniform_lists(stream, header, element, wanted) if wanted >= 0 else None
    if uniform is not None:
        return uniform
    stream.seek(start)
    data, offset, polygons = stream.read(), 0, _Polygons()
    try:
        for _ in range(element.count):
            for k, item in enumerate(element.properties):
                count = 1
                if item.count_type:
                    (count,) = struct.unpack_from(
                        header.order + _CODES[item.count_type], data, offset
                    )
                    offset += int(item.count_type[1])
                length = count * int(item.type[1])
                if not 0 <= length <= len(data) - offset:
                    raise _cut_short(element)
                if k == wanted:
                    if count > MOST_SIDES:
                        polygons.add([0] * (MOST_SIDES + 1))
                    code = f"{header.order}{count}{_CODES[item.type]}"
                    polygons.add(list(struct.unpack_from(code, data, offset)))
                offset += length
    except struct.error as error:
        raise _cut_short(element) from error
    stream.seek(start + offset)
    return polygons.arrays()


def _uniform_lists(
    stream: BinaryIO, header: Header, element: Element, wanted: int
) -> tuple[Ints, Ints] | None:
    """All rows at once where the lists of all are as long as the first; None where they are not."""
    lists = [k for k, item in enumerate(element.properties) if item.count_type]
    if lists != [wanted] or not element.count:
        return None
    start = stream.tell()
    before = element.properties[:wanted]
    item = element.properties[wanted]
    stream.seek(start + sum(int(entry.type[1]) for entry in before))
    order = "little" if header.order == "<" else "big"
    count = int.from_bytes(stream.read(int(item.count_type[1])), order)  # type: ignore[arg-type]
    stream.seek(start)
    if not 3 <= count <= MOST_SIDES:
        return None
    columns: list[tuple[str, ...] | tuple[str, str, tuple[int]]] = []
    for k, entry in enumerate(element.properties):
        if k == wanted:
            columns.append(("count", header.order + item.count_type))
            columns.append(("corners", header.order + item.type, (count,)))
        else:
            columns.append((f"other {k}", header.order + entry.type))
    row = np.dtype(columns)
    data = stream.read(element.count * row.itemsize)
    if len(data) < element.count * row.itemsize:
        return None
    table = np.frombuffer(data, row)
    if (table["count"] != count).any():
        return None
    return table["corners"].astype(np.int64).ravel(), np.full(element.count, count, np.int64)


def _text_lists(lines: Lines, element: Element, wanted: int) -> tuple[Ints, Ints]:
    """The wanted list of each line (none for -1), and how long each is."""
    polygons = _Polygons()
    for k in range(element.count):
        words = lines.next(f"row {k} of {element.count} of '{element.name}'")
        place = 0
        for number, item in enumerate(element.properties):
            count = 1
            if item.count_type:
                count = lines.whole(words[place]) if place < len(words) else -1
                place += 1
            if not 0 <= count <= len(words) - place:
                raise lines.error(f"is too short for '{element.name}'")
            if number == wanted:
                polygons.add([lines.whole(word) for word in words[place : place + count]])
            place += count
        if place != len(words):
            raise lines.error(f"is too long for '{element.name}'")
    return polygons.arrays()
