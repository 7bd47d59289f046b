"""What the readers of mesh files share: lines of words, polygons, and how much is taken.

Lines are counted for messages; polygons are cut into triangles, which are not checked yet.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import CoverableError

MOST_FACES = 2_000_000
MOST_VERTICES = 3 * MOST_FACES
MOST_SIDES = 64  # of a polygon
LONGEST_LINE = 65536  # bytes
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # which some editors put at the start of a text


class MeshError(CoverableError):
    """A mesh file that cannot be read, and why."""


@dataclass(frozen=True, eq=False, slots=True)
class RawMesh:
    """Triangles as a file has them; indices may be out of range and numbers not finite."""

    vertices: Array
    """(V, 3) in the file's unit."""
    faces: Ints
    """(F, 3)"""
    notes: tuple[str, ...] = ()
    rgba: tuple[float, ...] | None = None
    """Red, green, blue, opacity in 0 .. 1; None where the file gives it no colour of its own."""


def refuse_large(faces: int, vertices: int = 0) -> None:
    """Refuse counts above what is taken.

    Raises:
        MeshError: more than `MOST_FACES` faces, or thrice as many vertices.
    """
    caps = ((faces, MOST_FACES, "faces"), (vertices, MOST_VERTICES, "vertices"))
    for count, most, what in caps:
        if count > most:
            raise MeshError(
                f"has {count:,} {what}, more than the {most:,} that are taken; thin it first, "
                "for instance with MeshLab's Quadric Edge Collapse Decimation or Blender's "
                "Decimate: a cell of the surface needs about a hundred faces, not thousands"
            )


def no_triangles() -> MeshError:
    """The error for a file that is well formed, but empty."""
    return MeshError(
        "holds no faces (points and lines alone are no surface); export it as triangles"
    )


class Polygons:
    """Collects the corners of faces, and refuses too many before there is memory for them."""

    def __init__(self) -> None:
        """Begin without faces."""
        self.corners = array("q")
        self.sides = array("q")
        self.triangles = 0

    def add(self, corners: Sequence[int]) -> None:
        """One face more.

        Raises:
            MeshError: its corners are too few or too many, or the faces are too many.
        """
        refuse_sides(len(self.sides), len(corners))
        self.triangles += len(corners) - 2
        refuse_large(self.triangles)
        self.corners.extend(corners)
        self.sides.append(len(corners))

    def mesh(self, vertices: Array) -> RawMesh:
        """The faces cut into triangles, see `triangulated`."""
        corners, sides = np.array(self.corners, np.int64), np.array(self.sides, np.int64)
        return triangulated(vertices, corners, sides)


def refuse_sides(face: int, count: int) -> None:
    """Refuse a face that is no polygon, or one of too many corners.

    Raises:
        MeshError: `count` is not in 3 .. `MOST_SIDES`.
    """
    if not 3 <= count <= MOST_SIDES:
        raise MeshError(
            f"face {face} (counted from 0) has {count} corners, where 3 .. {MOST_SIDES} are "
            "taken; export the mesh as triangles"
        )


def triangulated(vertices: Array, corners: Ints, sides: Ints) -> RawMesh:
    """Cut polygons into triangles.

    Each becomes a fan about one of its corners, the first from which all triangles face the same
    way as the polygon; a convex polygon has one at once.

    Args:
        vertices: (V, 3).
        corners: the polygons' vertices, one polygon after the other.
        sides: (N,) how many corners each polygon has, 3 .. `MOST_SIDES`.

    Raises:
        MeshError: no polygon at all, too many, or one without such a fan.
    """
    if not len(sides):
        raise no_triangles()
    refuse_large(int((sides - 2).sum()))
    begins = np.cumsum(sides) - sides
    places = np.cumsum(sides - 2) - (sides - 2)
    faces = np.empty((int((sides - 2).sum()), 3), np.int64)
    for count in np.unique(sides).tolist():
        chosen = np.flatnonzero(sides == count)
        polygons = corners[begins[chosen, None] + np.arange(count)]
        if count > 3:
            polygons = _turned_to_fan(vertices, polygons, chosen)
        for k in range(count - 2):
            faces[places[chosen] + k] = polygons[:, [0, k + 1, k + 2]]
    cut = int((sides > 3).sum())
    several = f"{cut} faces with more than three corners were" if cut > 1 else "1 face was"
    return RawMesh(vertices, faces, (f"{several} cut into triangles",) * bool(cut))


def _turned_to_fan(vertices: Array, polygons: Ints, names: Ints) -> Ints:
    """Turn each polygon (n, k) so that the fan about its first corner covers it."""
    inside = ((polygons >= 0) & (polygons < len(vertices))).all(axis=1)  # others fail later
    result = polygons.copy()
    open_ones = np.flatnonzero(inside)
    for turn in range(polygons.shape[1]):
        rolled = np.roll(polygons[open_ones], -turn, axis=1)
        spokes = vertices[rolled[:, 1:]] - vertices[rolled[:, :1]]
        with np.errstate(all="ignore"):  # numbers that are not finite are refused later
            normals = np.cross(spokes[:, :-1], spokes[:, 1:])
            total = normals.sum(axis=1)  # the same about any corner
            along = np.einsum("nkc,nc->nk", normals, total)
            backwards = (along < -1e-9 * np.einsum("nc,nc->n", total, total)[:, None]).any(axis=1)
        result[open_ones] = rolled
        open_ones = open_ones[backwards]
        if not len(open_ones):
            return result
    raise MeshError(
        f"{len(open_ones)} faces with {polygons.shape[1]} corners are not convex, the first is "
        f"face {names[open_ones[0]]} (counted from 0); export the mesh as triangles"
    )


def distinct(points: Array) -> tuple[Array, Ints]:
    """Each of some points (k, 3) once, and (k,) which of these each is; faster than `np.unique`."""
    order = np.lexsort(points.T)
    ordered = points[order]
    is_new = np.ones(len(points), dtype=bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(points), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return ordered[is_new], number


def joined(parts: Sequence[RawMesh]) -> RawMesh:
    """Several meshes as one."""
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return RawMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, offsets, strict=False)]),
        tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


class Lines:
    """The lines of a text file that say something, split into words."""

    def __init__(self, stream: BinaryIO, comment: bytes = b"") -> None:
        """Read on from where the stream is; what follows `comment` in a line is left out."""
        self.stream = stream
        self.comment = comment
        self.number = 0
        """The line read last, counted from 1."""

    def __iter__(self) -> Iterator[list[bytes]]:
        """The words of each line that has any."""
        while line := self.stream.readline(LONGEST_LINE + 1):
            self.number += 1
            if len(line) > LONGEST_LINE:
                raise self.error(f"is longer than {LONGEST_LINE} bytes; this is not a mesh as text")
            if self.number == 1:
                line = line.removeprefix(BYTE_ORDER_MARK)
            if self.comment and self.comment in line:
                line = line[: line.index(self.comment)]
            words = line.split()
            if words:
                yield words

    def next(self, expected: str) -> list[bytes]:
        """The words of the next line.

        Raises:
            MeshError: the file ends; `expected` says before what.
        """
        for words in self:
            return words
        raise MeshError(f"ends after line {self.number}, before {expected}; it was cut short")

    def error(self, fault: str) -> MeshError:
        """What is wrong with the line read last."""
        return MeshError(f"line {self.number} {fault}")

    def floats(self, words: list[bytes]) -> list[float]:
        """Numbers; NaN and infinities are let through; what uses them checks.

        Raises:
            MeshError: a word is not a number.
        """
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = [math.nan]
        if len(values) != len(words) or b"_" in b"".join(words):
            raise self.error(f"should hold numbers, got {shown(b' '.join(words))}")
        return values

    def whole(self, word: bytes) -> int:
        """A whole number of at most 18 digits.

        Raises:
            MeshError: the word is something else.
        """
        if len(word) <= 19 and word.removeprefix(b"-").isdigit():
            value = int(word)
            if abs(value) < 10**18:
                return value
        raise self.error(f"should hold a whole number, got {shown(word)}")


def shown(data: bytes) -> str:
    """A piece of a file for a message."""
    return repr(data[:60].decode("utf-8", "replace")) + ("..." if len(data) > 60 else "")
