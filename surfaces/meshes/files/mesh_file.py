"""Meshes from untrusted files: STL, OBJ, PLY, OFF and GLB, each read by its own strict reader.

Every count is checked against the size of the file and a cap before memory is taken for it, every
number and index before it is used, and only the one file is opened, whatever it names.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np

from coverable_files import FileFault, open_regular, reason
from surfaces.arguments import Checks
from surfaces.meshes.files.glb import GlbPart, read_glb, read_glb_parts
from surfaces.meshes.files.obj_and_off import read_obj, read_off
from surfaces.meshes.files.ply import read_ply
from surfaces.meshes.files.raw_mesh import RawMesh
from surfaces.meshes.files.stl import read_stl
from surfaces.meshes.repair import clean
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import SurfaceError

LARGEST_FILE = 512 << 20  # bytes
# [m] Parts outside are taken only where the scale was given: no arm reaches around them.
LARGEST_PART, SMALLEST_PART = 20.0, 1e-3
WIDE_PART = 5.0  # [m]: worth a note

Found = TypeVar("Found")
Reader = Callable[[BinaryIO, int], Found]

_READERS: dict[str, Reader[RawMesh]] = {
    ".stl": read_stl,
    ".obj": read_obj,
    ".ply": read_ply,
    ".off": read_off,
    ".glb": read_glb,
}
_PART_READERS: dict[str, Reader[RawMesh | list[GlbPart]]] = {**_READERS, ".glb": read_glb_parts}
FORMATS = "STL, OBJ, PLY, OFF or GLB"
# How files begin that are something else than their name says.
_STARTS = {
    b"PK\x03\x04": "a zip archive; unpack it first",
    b"PK\x05\x06": "an empty zip archive",
    b"\x1f\x8b": "packed with gzip; unpack it first",
    b"BZh": "packed with bzip2; unpack it first",
    b"\xfd7zXZ": "packed with xz; unpack it first",
    b"7z\xbc\xaf": "a 7z archive; unpack it first",
    b"\x28\xb5\x2f\xfd": "packed with zstd; unpack it first",
    b"Rar!": "a rar archive; unpack it first",
    b"ISO-10303-21": "a STEP file (CAD); export it as STL",
    b"version https://git-lfs": "only a Git LFS pointer to the mesh; fetch it with 'git lfs pull'",
    b"<": "XML or a web page, not a mesh",
    b"{": "JSON (glTF as text?); export it as one .glb",
    b"%PDF": "a PDF",
}
# With what follows the word, for a binary STL may begin with any text.
_OWN_STARTS = {
    b"glTF\2\0\0\0": ".glb",
    **dict.fromkeys((b"ply\n", b"ply\r"), ".ply"),
    **dict.fromkeys((b"OFF\n", b"OFF\r"), ".off"),
}


def read_mesh(path: str | os.PathLike[str], scale: float | None = None) -> TriangleMesh:
    """Read a mesh file and clean it; see `surfaces.meshes.repair.clean` for what is repaired.

    Args:
        path: a file of one of the formats, at most 512 MB and 2,000,000 faces.
        scale: metres per unit of the file, such as 0.001 for millimetres. Without it the unit is
            taken as the metre, and a part above 20 m or below 1 mm is refused: that is nearly
            always a wrong unit, and the answer would only be that the arm cannot reach. Any given
            scale, 1.0 too, is taken.

    Raises:
        SurfaceError: no such file, not a mesh, damaged, too large, or not a surface; with the
            file's name, the place and what would do.
    """
    name = repr(Path(os.fsdecode(path)).name[:100])
    try:
        unit = metres_per_unit(scale)
        raw = _read(path, _READERS)
        with np.errstate(over="ignore"):  # infinite coordinates are refused next
            vertices = raw.vertices * unit
        mesh = clean(vertices, raw.faces, history=raw.notes)
        if scale is not None:
            return mesh
        return with_likely_unit(mesh)
    except (FileFault, SurfaceError) as error:
        raise SurfaceError(error.faults, name) from error


def read_parts(path: str | os.PathLike[str], largest: int = LARGEST_FILE) -> list[GlbPart]:
    """Read a mesh file as it is, part by part and with colours, to be drawn: nothing is repaired.

    Coordinates may be infinite or NaN; indices are those of vertices.

    Args:
        path: a file of one of the formats.
        largest: bytes that it may have.

    Raises:
        SurfaceError: no such file, not a mesh, damaged, too large, or without triangles.
    """
    try:
        found = _read(path, _PART_READERS, largest)
    except FileFault as error:
        raise SurfaceError(error.faults) from error
    parts = found if isinstance(found, list) else [GlbPart(found, None)]
    for part in parts:
        faces, vertices = part.mesh.faces, part.mesh.vertices
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise SurfaceError("names a vertex that it does not have; it is damaged")
    return parts


def metres_per_unit(scale: float | None, name: str = "") -> float:
    """The scale as a number, 1 where none is given; `name` says of what.

    Raises:
        SurfaceError: it is no number, or not within 1e-9 .. 1e9.
    """
    if scale is None:
        return 1.0
    checks = Checks(name)
    expected = "must be a number in 1e-09 .. 1e+09 (metres per unit; 0.001 for millimetres)"
    unit = checks.number("scale", scale, expected, 1e-9, 1e9)
    checks.done()
    return unit


def _read(
    path: str | os.PathLike[str], readers: Mapping[str, Reader[Found]], largest: int = LARGEST_FILE
) -> Found:
    """Open a regular file, look at how it begins, and read it."""
    advice = "thin the mesh, or save it as binary STL"
    with open_regular(path, largest, f"a mesh as {FORMATS}", advice) as stream:
        suffix = Path(os.fsdecode(path)).suffix.lower()
        try:
            _check_start(stream.read(80), suffix)
            stream.seek(0)
            return readers[suffix](stream, os.fstat(stream.fileno()).st_size)
        except OSError as error:
            raise SurfaceError(f"cannot be read: {reason(error)}") from error


def _check_start(head: bytes, suffix: str) -> None:
    """The file's name and its first bytes must agree."""
    if not head:
        raise SurfaceError(f"is empty; expected a mesh as {FORMATS}")
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    for start, what in _STARTS.items():
        if head.startswith(start) or (start[0] < 0x7F and text.startswith(start)):
            if start in (b"<", b"{") and b"\0" in head:
                continue  # the free text at the head of a binary STL
            raise SurfaceError(f"is {what}")
    if suffix not in _READERS:
        raise SurfaceError(
            f"{'ends in ' + repr(suffix[:20]) if suffix else 'has no extension'}, where a mesh as "
            f"{FORMATS} is expected; export the surface in one of these"
        )
    for start, own in _OWN_STARTS.items():
        if head.startswith(start) and suffix != own:
            raise SurfaceError(f"is {own[1:].upper()} by its first bytes; name it {own}")


def with_likely_unit(mesh: TriangleMesh, what: str = "the file", unit: float = 1.0) -> TriangleMesh:
    """Refuse a part of unlikely size, and note one that is wider than most arms reach.

    Args:
        mesh: in metres, if the unit is right.
        what: has the triangles, for the message.
        unit: metres per unit that was assumed.

    Raises:
        SurfaceError: the part is wider than 20 m, or narrower than 1 mm.
    """
    wide = float(mesh.extent.max())
    if wide > LARGEST_PART:
        others = (
            f"if {what} is in millimetres give scale = 0.001 ({wide * 0.001:.3g} m), if in inches "
            f"scale = 0.0254 ({wide * 0.0254:.3g} m), and "
        )
        advice = f"{others if unit == 1.0 else ''}if it is that wide scale = {unit}"
        raise SurfaceError(f"the part is {wide:.4g} m wide; {advice}")
    if wide < SMALLEST_PART:
        reason, larger = "it was scaled from millimetres to metres twice", 1000.0
        if unit < 1.0:
            reason, larger = f"{what} is in metres", 1.0
        raise SurfaceError(
            f"the part is {wide:.3g} m wide; if {reason} give scale = {larger:g} "
            f"({wide / unit * larger:.3g} m), and if it is that small scale = {unit}"
        )
    if wide <= WIDE_PART:
        return mesh
    note = (
        f"the part is {wide:.4g} m wide, wider than most arms reach; if its unit is not the metre, "
        "give scale"
    )
    return TriangleMesh(mesh.vertices, mesh.faces, (*mesh.history, note))
