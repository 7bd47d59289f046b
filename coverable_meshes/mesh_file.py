"""A mesh file of any format into triangles as the file has them: nothing is repaired."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO, TypeVar

from coverable_files import FileFault, open_regular, reason
from coverable_meshes.errors import MeshError
from coverable_meshes.glb import GlbPart, read_glb, read_glb_parts
from coverable_meshes.obj_and_off import read_obj, read_off
from coverable_meshes.ply import read_ply
from coverable_meshes.raw_mesh import RawMesh
from coverable_meshes.stl import read_stl

LARGEST_FILE = 512 << 20  # bytes

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


def read_raw(path: str | os.PathLike[str]) -> RawMesh:
    """Read a mesh file as one mesh; indices may be out of range and numbers not finite.

    Args:
        path: a file of one of the formats, at most 512 MB and 2,000,000 faces.

    Raises:
        MeshError: no such file, not a mesh, damaged, or too large.
    """
    return _read(path, _READERS, LARGEST_FILE)


def read_parts(path: str | os.PathLike[str], largest: int = LARGEST_FILE) -> list[GlbPart]:
    """Read a mesh file part by part and with colours.

    Coordinates may be infinite or NaN; indices are those of vertices.

    Args:
        path: a file of one of the formats.
        largest: bytes that it may have.

    Raises:
        MeshError: no such file, not a mesh, damaged, too large, or without triangles.
    """
    found = _read(path, _PART_READERS, largest)
    parts = found if isinstance(found, list) else [GlbPart(found, None)]
    for part in parts:
        faces, vertices = part.mesh.faces, part.mesh.vertices
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise MeshError("names a vertex that it does not have; it is damaged")
    return parts


def _read(
    path: str | os.PathLike[str], readers: Mapping[str, Reader[Found]], largest: int
) -> Found:
    """Open a regular file, look at how it begins, and read it."""
    advice = "thin the mesh, or save it as binary STL"
    suffix = Path(os.fsdecode(path)).suffix.lower()
    try:
        with open_regular(path, largest, f"a mesh as {FORMATS}", advice) as stream:
            _check_start(stream.read(80), suffix)
            stream.seek(0)
            return readers[suffix](stream, os.fstat(stream.fileno()).st_size)
    except FileFault as error:
        raise MeshError(error.faults) from error
    except OSError as error:
        raise MeshError(f"cannot be read: {reason(error)}") from error


def _check_start(head: bytes, suffix: str) -> None:
    """The file's name and its first bytes must agree."""
    if not head:
        raise MeshError(f"is empty; expected a mesh as {FORMATS}")
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    for start, what in _STARTS.items():
        if head.startswith(start) or (start[0] < 0x7F and text.startswith(start)):
            if start in (b"<", b"{") and b"\0" in head:
                continue  # the free text at the head of a binary STL
            raise MeshError(f"is {what}")
    if suffix not in _READERS:
        raise MeshError(
            f"{'ends in ' + repr(suffix[:20]) if suffix else 'has no extension'}, where a mesh as "
            f"{FORMATS} is expected; export the surface in one of these"
        )
    for start, own in _OWN_STARTS.items():
        if head.startswith(start) and suffix != own:
            raise MeshError(f"is {own[1:].upper()} by its first bytes; name it {own}")
