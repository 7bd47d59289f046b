"""PLY, binary and text: a header that names its own columns, then the rows.

trimesh's reader is not used here: it takes text rows that are cut short, too long or no integers
without a word, and refuses binary files with triangles beside other polygons, as Blender writes
them. Behind the header, which has to be checked anyway, a table is one numpy type.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from coverable.arrays import Array, Ints
from coverable.meshes.raw_mesh import (
    MOST_SIDES,
    MOST_VERTICES,
    Lines,
    MeshError,
    Polygons,
    RawMesh,
    no_triangles,
    refuse_large,
    refuse_sides,
    shown,
    triangulated,
)

TYPES = {
    **dict.fromkeys((b"char", b"int8"), "i1"),
    **dict.fromkeys((b"uchar", b"uint8"), "u1"),
    **dict.fromkeys((b"short", b"int16"), "i2"),
    **dict.fromkeys((b"ushort", b"uint16"), "u2"),
    **dict.fromkeys((b"int", b"int32"), "i4"),
    **dict.fromkeys((b"uint", b"uint32"), "u4"),
    **dict.fromkeys((b"float", b"float32"), "f4"),
    **dict.fromkeys((b"double", b"float64"), "f8"),
}
_FORMATS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_MOST_LINES = 1000
_FACE_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, slots=True)
class Property:
    """One number of a row, or a list of numbers with its count before it."""

    name: str
    type: str
    """numpy's name of the type, without byte order: of the number, or of each in the list."""
    count_type: str = ""
    """Of the count; empty for a single number."""


@dataclass(frozen=True, slots=True)
class Element:
    """A table: `count` rows with these properties."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def wanted(self) -> tuple[int, ...]:
        """Which properties are read: x, y and z of a vertex, the list of corners of a face.

        Raises:
            MeshError: they are missing, or of a type that they cannot have.
        """
        names = [item.name for item in self.properties]
        if self.name == "vertex":
            if {"x", "y", "z"} <= set(names) and not any(i.count_type for i in self.properties):
                return tuple(names.index(name) for name in ("x", "y", "z"))
            raise MeshError(f"its vertices need x, y and z, and no lists; they have {names}")
        if self.name != "face":
            return ()
        for k, item in enumerate(self.properties):
            if item.name in _FACE_LISTS and item.count_type and item.type[0] != "f":
                return (k,)
        raise MeshError(
            f"its faces need a list 'vertex_indices' of whole numbers; they have {names}"
        )


def read_ply(stream: BinaryIO, size: int) -> RawMesh:
    """Read a PLY of `size` bytes; only positions and faces are taken.

    Raises:
        MeshError: not a PLY, damaged, or too large.
    """
    lines = Lines(stream)
    order, elements = _header(lines, size)
    return _binary(stream.read(), order, elements) if order else _text(lines, elements)


def _header(lines: Lines, size: int) -> tuple[str, tuple[Element, ...]]:
    """Read the header of a PLY of `size` bytes, and leave the stream behind it.

    Returns:
        '<' or '>' for the byte order of binary rows, '' for text; and the elements up to the later
        one of 'vertex' and 'face': what follows is not read.
    """
    if lines.next("'ply'") != [b"ply"]:
        raise lines.error("should be 'ply'")
    tables: list[tuple[str, int, list[Property]]] = []
    words = lines.next("'format'")
    if len(words) != 3 or words[0] != b"format" or words[1] not in _FORMATS:
        raise lines.error(f"should be 'format ascii 1.0' or alike, got {shown(b' '.join(words))}")
    order = _FORMATS[words[1]]
    for words in lines:
        if lines.number > _MOST_LINES:
            raise lines.error(f"is still in the header; at most {_MOST_LINES} lines are read")
        if words == [b"end_header"]:
            break
        if words[0] in (b"comment", b"obj_info"):
            continue
        if words[0] == b"element" and len(words) == 3:
            tables.append((words[1].decode("utf-8", "replace"), lines.whole(words[2]), []))
        elif words[0] == b"property" and tables:
            tables[-1][2].append(_property(lines, words))
        else:
            raise lines.error(f"belongs in no PLY header: {shown(b' '.join(words))}")
    else:
        raise MeshError(f"ends after line {lines.number}, inside the header; it was cut short")
    elements = tuple(Element(name, count, tuple(items)) for name, count, items in tables)
    return order, _checked(elements, order, size - lines.stream.tell())


def _property(lines: Lines, words: list[bytes]) -> Property:
    """Read 'property type name' or 'property list type type name'."""
    name = words[-1].decode("utf-8", "replace")
    if len(words) == 3 and words[1] in TYPES:
        return Property(name, TYPES[words[1]])
    if len(words) == 5 and words[1] == b"list" and words[2] in TYPES and words[3] in TYPES:
        count_type = TYPES[words[2]]
        if count_type[0] != "f":
            return Property(name, TYPES[words[3]], count_type)
    raise lines.error(f"is no property of a PLY: {shown(b' '.join(words))}")


def _checked(elements: tuple[Element, ...], order: str, left: int) -> tuple[Element, ...]:
    """The elements that are to be read, with counts that `left` bytes can hold."""
    names = [element.name for element in elements]
    for name in ("vertex", "face"):
        if names.count(name) > 1:
            raise MeshError(f"its header announces '{name}' twice")
    if "face" not in names or "vertex" not in names:
        if "tristrips" in names:
            raise MeshError("holds strips of triangles; export it with single faces")
        raise no_triangles()
    elements = elements[: max(names.index("vertex"), names.index("face")) + 1]
    for element in elements:
        repeated = len({item.name for item in element.properties}) < len(element.properties)
        if repeated or not element.properties:
            raise MeshError(f"its header gives '{element.name}' no properties, or one twice")
        if element.count < 0:
            raise MeshError(f"its header announces {element.count} of '{element.name}'")
        if element.name == "face":
            refuse_large(element.count)
        elif element.name == "vertex":
            refuse_large(0, element.count)
        elif element.count > MOST_VERTICES:
            raise MeshError(f"its header announces {element.count:,} of '{element.name}'")
    for element in elements:
        # Text needs a digit and a space or the line's end for each number.
        binary = sum(int((item.count_type or item.type)[1]) for item in element.properties)
        row = binary if order else 2 * len(element.properties)
        if element.count * row > left + 2:
            raise MeshError(
                f"its header announces {element.count:,} of '{element.name}', which the "
                f"{left:,} bytes after it cannot hold; it was cut short"
            )
    return elements


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
    vertices: Array = np.empty((0, 3))
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


def _cut_short(element: Element) -> MeshError:
    return MeshError(f"ends within its {element.count:,} of '{element.name}'; it was cut short")
