"""PLY, binary and text: a header that names its own columns, then the rows.

trimesh's reader is not used here: it takes text rows that are cut short, too long or no integers
without a word, and refuses binary files with triangles beside other polygons, as Blender writes
them. Behind the header, which has to be checked anyway, a table is one numpy type.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from surfaces.meshes.files.ply_header import TYPES, Element, read_header
from surfaces.meshes.files.raw_mesh import (
    MOST_SIDES,
    Polygons,
    RawMesh,
    refuse_sides,
    triangulated,
)
from surfaces.meshes.files.text import Lines
from surfaces.meshes.triangle_mesh import Floats, Ints
from surfaces.surface import SurfaceError


def read_ply(stream: BinaryIO, size: int) -> RawMesh:
    """Read a PLY of `size` bytes; only positions and faces are taken.

    Raises:
        SurfaceError: not a PLY, damaged, or too large.
    """
    header = read_header(stream, size)
    if header.order:
        return _binary(stream.read(), header.order, header.elements)
    return _text(Lines(stream, number=header.lines), header.elements)


def _text(lines: Lines, elements: Sequence[Element]) -> RawMesh:
    """Read rows of words, one a line."""
    numbers, polygons = array("d"), Polygons()
    for element in elements:
        wanted = element.wanted
        for k in range(element.count):
            row = _words(lines, element, k)
            if element.name == "vertex":
                numbers.extend(lines.floats([row[column][0] for column in wanted]))
            elif element.name == "face":
                polygons.add([lines.whole(word) for word in row[wanted[0]]])
    return polygons.mesh(np.array(numbers).reshape(-1, 3))


def _words(lines: Lines, element: Element, k: int) -> list[list[bytes]]:
    """The words of each property of a row, which is the next line."""
    words, place = lines.next(f"row {k} of {element.count} of '{element.name}'"), 0
    row = []
    for item in element.properties:
        count = 1
        if item.count_type:
            count = lines.whole(words[place]) if place < len(words) else -1
            place += 1
        if not 0 <= count <= len(words) - place:
            raise lines.error(f"is too short for '{element.name}'")
        row.append(words[place : place + count])
        place += count
    if place != len(words):
        raise lines.error(f"is too long for '{element.name}'")
    return row


def _binary(data: bytes, order: str, elements: Sequence[Element]) -> RawMesh:
    """Read rows of numbers of one byte order."""
    place, polygons = 0, Polygons()
    vertices: Floats = np.empty((0, 3))
    faces: Ints | None = None
    for element in elements:
        wanted = element.wanted
        row = _uniform(data, place, order, element)
        if row is not None:
            table = np.frombuffer(data, row, element.count, place)
            place += table.nbytes
            columns = [table[f"{column}"] for column in wanted]
            if element.name == "vertex":
                vertices = np.column_stack(columns).astype(float)
            elif element.name == "face":
                faces = columns[0].astype(np.int64)
            continue
        for values, end in _rows(data, place, order, element):
            place = end
            if element.name == "face":
                polygons.add(values)
    if faces is None:
        return polygons.mesh(vertices)
    refuse_sides(0, faces.shape[1])
    return triangulated(vertices, faces.ravel(), np.full(len(faces), faces.shape[1]))


def _uniform(data: bytes, start: int, order: str, element: Element) -> np.dtype | None:
    """The type of all rows where their lists are as long as the first row's; None where not."""
    columns: list[tuple[str, str, tuple[int, ...]]] = []
    counts: dict[str, int] = {}
    for k, item in enumerate(element.properties):
        count = 1
        if item.count_type:
            place = start + np.dtype(columns).itemsize
            width = int(item.count_type[1])
            count = int.from_bytes(data[place : place + width], "big" if order == ">" else "little")
            if count > MOST_SIDES:
                return None
            counts[f"count {k}"] = count
            columns.append((f"count {k}", order + item.count_type, ()))
        columns.append((f"{k}", order + item.type, (count,) if item.count_type else ()))
    row = np.dtype(columns)
    if element.count * row.itemsize > len(data) - start:
        return None
    table = np.frombuffer(data, row, element.count, start)
    return row if all((table[name] == count).all() for name, count in counts.items()) else None


def _rows(
    data: bytes, place: int, order: str, element: Element
) -> Iterator[tuple[Sequence[int], int]]:
    """Row by row, the list of corners in a row of faces, and where the row ends."""
    wanted = element.wanted
    codes = {name: np.dtype(name).char for name in TYPES.values()}
    try:
        for k in range(element.count):
            values: Sequence[int] = ()
            for number, item in enumerate(element.properties):
                count = 1
                if item.count_type:
                    (count,) = struct.unpack_from(order + codes[item.count_type], data, place)
                    place += int(item.count_type[1])
                length = count * int(item.type[1])
                if not 0 <= length <= len(data) - place:
                    raise _cut_short(element)
                if number in wanted:
                    refuse_sides(k, count)
                    values = struct.unpack_from(f"{order}{count}{codes[item.type]}", data, place)
                place += length
            yield values, place
    except struct.error as error:
        raise _cut_short(element) from error


def _cut_short(element: Element) -> SurfaceError:
    return SurfaceError(f"ends within its {element.count:,} of '{element.name}'; it was cut short")
