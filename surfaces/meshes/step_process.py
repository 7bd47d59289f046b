"""A STEP file through Open CASCADE, of the extra `coverable[step]`, in a process of its own."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.files import FileFault, read_regular
from coverable.processes import Ended, Limits, folder_of, run_apart
from surfaces.surface import SurfaceError

EXTRA = "needs the extra: pip install 'coverable[step]'"
CHILD = Path(__file__).with_name("child.py")
HEADER, END = b"ISO-10303-21;", b"END-ISO-10303-21;"
MOST_FACES = 1_000_000  # of a file; a line of its description takes some 200 bytes
LINE = 300  # bytes, of such a line at most


class Caps(NamedTuple):
    """What reading one file may use; a part of 20 MB takes some 20 s and 1 GB."""

    file: int = 200 * 2**20
    """bytes, of the largest file that is read"""
    seconds: int = 120
    """Of processor time."""
    waiting: float = 900.0
    """s, for a machine that is busy with other things."""
    memory: int = 6 * 2**30
    """bytes of address space; Open CASCADE itself takes 0.6 GB"""
    triangles: int = 2_000_000
    """The most that are taken, as of a mesh file."""
    run: Callable[[Path, bytes, float, Limits], Ended] = run_apart
    """What runs the process that reads it."""


CAPS = Caps()


class Read(NamedTuple):
    """What a STEP file holds."""

    faces: list[dict[str, Any]]
    """Of each, the first being number 1: `kind`, `area` (m^2), `colour` ("#rrggbb" or ""), a place
    near its middle, `centre` (m), and the outward `normal` there."""
    taken: list[int]
    """Numbers of the faces with triangles here."""
    vertices: Array
    """(V, 3) m."""
    triangles: Ints
    """(F, 3) corners, counterclockwise seen from outside."""
    deviation: float
    """m, the largest measured between the faces and their triangles."""
    counts: list[int]
    """How many triangles each of the faces taken has, in order."""


def read_step(path: str | os.PathLike[str], job: Mapping[str, Any], caps: Caps = CAPS) -> Read:
    """Read a file, and cut faces of it into triangles.

    Args:
        path: the file.
        job: `numbers` of faces or "all", or a `colour`; the `deviation` (m) and `angle` (rad) of
            triangles.
        caps: of the process.

    Raises:
        SurfaceError: the extra is missing; the file is none, or cannot be read within the caps.
    """
    data = _checked(path, caps)
    library = [folder_of("OCP"), folder_of("numpy")]
    if None in library:
        raise SurfaceError(EXTRA)
    limits = Limits(caps.memory, caps.seconds, MOST_FACES * LINE + 36 * caps.triangles)
    line = json.dumps({"library": library, **job}).encode() + b"\n"
    ended = caps.run(CHILD, line + data, caps.waiting, limits)
    less = "export fewer faces, or ask for a larger deviation"
    if ended.too_late:
        raise SurfaceError(f"could not be read within {caps.waiting:g} s; {less}")
    if ended.too_slow:
        raise SurfaceError(f"takes more than {caps.seconds} s of processor time to read; {less}")
    try:
        return _taken(ended.written, caps)
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, SurfaceError):
            raise
        raise SurfaceError(
            "cannot be read: Open CASCADE broke off over it; is it damaged, or does it take more "
            f"than {caps.memory / 2**30:g} GB of memory?"
        ) from error


def _checked(path: str | os.PathLike[str], caps: Caps) -> bytes:
    """The bytes of what at least begins and ends as a STEP file does.

    Raises:
        SurfaceError: it does not, or there is no such file.
    """
    try:
        data = read_regular(path, caps.file, "a STEP file", "export only the faces to be covered")
    except FileFault as error:
        raise SurfaceError(error.faults) from error
    start, end = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n"), data[-4096:].rstrip(b"\0 \t\r\n")
    if not data.strip():
        raise SurfaceError("is empty; expected a STEP file (ISO 10303-21)")
    if not start.startswith(HEADER):
        raise SurfaceError(
            f'starts with {start[:20]!r}; a STEP file starts with "{HEADER.decode()}": export the '
            "part as STEP, not compressed"
        )
    if not end.endswith(END):
        raise SurfaceError(f'does not end with "{END.decode()}"; it is cut short, export it again')
    return data


def _taken(written: bytes, caps: Caps) -> Read:
    """What the process wrote, each number of it checked.

    Raises:
        SurfaceError: the process found a fault, or the triangles are too many.
        ValueError: it wrote something else; also KeyError and TypeError.
    """
    line, _, arrays = written.partition(b"\n")
    said = json.loads(line)
    if "fault" in said:
        raise SurfaceError(str(said["fault"])[:300])
    faces = [
        {
            "kind": str(one["kind"]), "area": float(one["area"]), "colour": str(one["colour"]),
            **{key: _vector(one[key]) for key in ("centre", "normal")},
        }
        for one in said["faces"]
    ]  # fmt: skip
    vertices, triangles = int(said.get("vertices", 0)), int(said.get("triangles", 0))
    if triangles > caps.triangles:
        raise SurfaceError(
            f"makes {triangles:,} triangles, more than {caps.triangles:,}; take fewer faces, or "
            "ask for a larger deviation"
        )
    counts = [int(count) for count in said.get("counts", [])]
    taken = [int(number) for number in said.get("taken", [])]
    if len(counts) != len(taken) or sum(counts) != triangles or min(counts, default=0) < 0:
        raise ValueError("triangles of other faces")
    if min(vertices, triangles) < 0 or len(arrays) != 24 * vertices + 12 * triangles:
        raise ValueError("arrays of another size")
    return Read(
        faces,
        taken,
        np.frombuffer(arrays[: 24 * vertices], "<f8").reshape(-1, 3).copy(),
        np.frombuffer(arrays[24 * vertices :], "<i4").reshape(-1, 3).astype(np.int64),
        float(said.get("deviation", 0.0)),
        counts,
    )


def _vector(given: Any) -> tuple[float, float, float]:
    """Three finite numbers; 0 where one is not."""
    x, y, z = (float(part) if math.isfinite(float(part)) else 0.0 for part in given)
    return x, y, z
