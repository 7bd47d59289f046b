"""A mesh file of any format into triangles as the file has them: nothing is repaired."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from coverable.files import FileFault, open_regular, reason
from coverable.meshes.glb import read_glb, read_glb_parts
from coverable.meshes.obj_and_off import read_obj, read_off
from coverable.meshes.ply import read_ply
from coverable.meshes.raw_mesh import MeshError, RawMesh
from coverable.meshes.stl import read_stl

LARGEST_FILE = 512 << 20  # bytes

_READERS: dict[str, Callable[[BinaryIO, int], RawMesh]] = {
    ".stl": read_stl,
    ".obj": read_obj,
    ".ply": read_ply,
    ".off": read_off,
    ".glb": read_glb,
}
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
    with _opened(path, LARGEST_FILE) as file:
        return _READERS[file.suffix](file.stream, file.size)


def read_parts(path: str | os.PathLike[str], largest: int) -> list[RawMesh]:
    """Read a mesh file part by part and with colours; numbers may be infinite or NaN.

    Args:
        path: a file of one of the formats.
        largest: bytes that it may have.

    Raises:
        MeshError: no such file, not a mesh, damaged, too large, or without triangles.
    """
    with _opened(path, largest) as file:
        if file.suffix == ".glb":
            parts = read_glb_parts(file.stream, file.size)
        else:
            parts = [_READERS[file.suffix](file.stream, file.size)]
    for mesh in parts:
        if len(mesh.faces) and not 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices):
            raise MeshError("names a vertex that it does not have; it is damaged")
    return parts


class _File(NamedTuple):
    """An open mesh file."""

    stream: BinaryIO
    size: int
    """bytes"""
    suffix: str
    """One of `_READERS`."""


@contextmanager
def _opened(path: str | os.PathLike[str], largest: int) -> Generator[_File]:
    """Open a regular file that begins as its name says."""
    advice = "thin the mesh, or save it as binary STL"
    suffix = Path(os.fsdecode(path)).suffix.lower()
    try:
        with open_regular(path, largest, f"a mesh as {FORMATS}", advice) as stream:
            _check_start(stream.read(80), suffix)
            stream.seek(0)
            yield _File(stream, os.fstat(stream.fileno()).st_size, suffix)
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
