"""The header of a PLY: which elements follow, how many, and what each holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import BinaryIO

from surfaces.meshes.files.raw_mesh import MOST_VERTICES, no_triangles, refuse_large
from surfaces.meshes.files.text import Lines, shown
from surfaces.surface import SurfaceError

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
    def least_row(self) -> int:
        """Bytes of the shortest binary row."""
        return sum(int((item.count_type or item.type)[1]) for item in self.properties)

    @property
    def wanted(self) -> tuple[int, ...]:
        """Which properties are read: x, y and z of a vertex, the list of corners of a face.

        Raises:
            SurfaceError: they are missing, or of a type that they cannot have.
        """
        names = [item.name for item in self.properties]
        if self.name == "vertex":
            if {"x", "y", "z"} <= set(names) and not any(i.count_type for i in self.properties):
                return tuple(names.index(name) for name in ("x", "y", "z"))
            raise SurfaceError(f"its vertices need x, y and z, and no lists; they have {names}")
        if self.name != "face":
            return ()
        for k, item in enumerate(self.properties):
            if item.name in _FACE_LISTS and item.count_type and item.type[0] != "f":
                return (k,)
        raise SurfaceError(
            f"its faces need a list 'vertex_indices' of whole numbers; they have {names}"
        )


@dataclass(frozen=True, slots=True)
class Header:
    """What a PLY announces."""

    order: str
    """'<' or '>' for the byte order of binary rows, '' for text."""
    elements: tuple[Element, ...]
    """Up to the later one of 'vertex' and 'face'; what follows is not read."""
    lines: int
    """How many lines the header takes."""


def read_header(stream: BinaryIO, size: int) -> Header:
    """Read the header of a PLY of `size` bytes, and leave the stream behind it.

    Raises:
        SurfaceError: not a PLY, damaged, counts that the file cannot hold, or too large.
    """
    lines = Lines(stream)
    if lines.next("'ply'") != [b"ply"]:
        raise lines.error("should be 'ply'")
    order = ""
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
        raise SurfaceError(f"ends after line {lines.number}, inside the header; it was cut short")
    elements = tuple(Element(name, count, tuple(items)) for name, count, items in tables)
    return Header(order, _checked(elements, order, size - stream.tell()), lines.number)


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
            raise SurfaceError(f"its header announces '{name}' twice")
    if "face" not in names or "vertex" not in names:
        if "tristrips" in names:
            raise SurfaceError("holds strips of triangles; export it with single faces")
        raise no_triangles()
    elements = elements[: max(names.index("vertex"), names.index("face")) + 1]
    for element in elements:
        repeated = len({item.name for item in element.properties}) < len(element.properties)
        if repeated or not element.properties:
            raise SurfaceError(f"its header gives '{element.name}' no properties, or one twice")
        if element.count < 0:
            raise SurfaceError(f"its header announces {element.count} of '{element.name}'")
        if element.name == "face":
            refuse_large(element.count)
        elif element.name == "vertex":
            refuse_large(0, element.count)
        elif element.count > MOST_VERTICES:
            raise SurfaceError(f"its header announces {element.count:,} of '{element.name}'")
    for element in elements:
        # Text needs a digit and a space or the line's end for each number.
        row = element.least_row if order else 2 * len(element.properties)
        if element.count * row > left + 2:
            raise SurfaceError(
                f"its header announces {element.count:,} of '{element.name}', which the "
                f"{left:,} bytes after it cannot hold; it was cut short"
            )
    return elements
