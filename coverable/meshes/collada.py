"""COLLADA files (.dae) of a robot, by trimesh, all in one process of their own."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from coverable.meshes.raw_mesh import MeshError, RawMesh
from coverable.processes import Ended, Limits, folder_of, run_apart

CHILD = Path(__file__).with_name("collada_child.py")
LIBRARIES = ("trimesh", "collada", "numpy")
MOST_TRIANGLES = 1_500_000  # of a robot, and so of a file, each instance counted
MOST_SECONDS = 8  # of processor time, for all files; those of a UR arm take 1
PATIENCE = 300.0  # s, for a machine that is busy with other things
MEMORY = 1 << 30  # bytes of address space; a million triangles take two thirds of it
OUTPUT = 1 << 30  # bytes


def read_collada(
    files: Sequence[bytes], run: Callable[[Path, bytes, float, Limits], Ended] = run_apart
) -> list[list[RawMesh] | MeshError]:
    """The parts of each file, or what is wrong with it.

    A file that takes the whole time ends the process, and those after it are not read.

    Args:
        files: their bytes.
        run: what runs the process that reads them.
    """
    library = sorted({folder for name in LIBRARIES if (folder := folder_of(name))})
    zipped = [zipfile.is_zipfile(io.BytesIO(data)) for data in files]  # which pycollada unpacks
    plain = [data for data, packed in zip(files, zipped, strict=True) if not packed]
    job = {"library": library, "sizes": list(map(len, plain)), "most": MOST_TRIANGLES}
    given = b"".join([json.dumps(job).encode(), b"\n", *plain])
    ended = run(CHILD, given, PATIENCE, Limits(MEMORY, MOST_SECONDS, OUTPUT))
    written, found = io.BytesIO(ended.written), list[list[RawMesh] | MeshError]()
    broken = "takes too long, or too much memory, to read; thin the mesh"
    for packed in zipped:
        if packed:
            found.append(MeshError("is a zip archive; unpack it first"))
            continue
        try:
            found.append(_parts(written))
        except (ValueError, TypeError, KeyError):
            found.append(MeshError(broken))
            broken = "was not read, as another mesh of the robot took all the time"
            written = io.BytesIO()
    return found


def _parts(written: BinaryIO) -> list[RawMesh] | MeshError:
    """What the process wrote about the next file, each number of it checked.

    Raises:
        ValueError: it wrote something else, or nothing; also KeyError and TypeError.
    """
    said = json.loads(written.readline())
    if "fault" in said:
        return MeshError(" ".join(str(said["fault"])[:300].split()))
    parts = []
    for vertices, faces, rgba in said["parts"]:
        corners, indices = (
            np.frombuffer(written.read(24 * max(count, 0)), kind).reshape(count, 3).copy()
            for count, kind in ((vertices, "<f8"), (faces, "<i8"))
        )
        if rgba is not None and not all(0.0 <= value <= 1.0 for value in rgba[:4]):
            raise ValueError("no colour")
        parts.append(RawMesh(corners, indices, (), rgba and tuple(rgba)))
    if all(((one.faces >= 0) & (one.faces < len(one.vertices))).all() for one in parts):
        return parts
    return MeshError("has a triangle of a vertex that is not there")
