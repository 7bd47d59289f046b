"""Poses from files: CSV, a toolpath of noether, a point cloud; with caps, and taken for hostile.

Toolpaths as noether writes them (YAML) have poses (x, y, z, qw, qx, qy, qz) in nested lists: lists
of segments, each a list of waypoints; all follow one another here. z of a waypoint is the outward
normal, x the direction of travel. Of YAML no more is understood than these numbers by their names,
which is what a file that anybody may have written should be able to say.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.columns import NUMBER, read_columns
from coverable.errors import CoverableError, Fault, number_in, shown
from coverable.files import read_regular, read_text, shown_name
from surfaces.arguments import Checks
from surfaces.surface import SurfaceError
from surfaces.toolpaths.cloud_file import cloud_poses
from surfaces.toolpaths.given import MOST_POSES

MOST_BYTES = 16 << 20
UNITS = {"m": 1.0, "mm": 1e-3}
KEYS = ("x", "y", "z", "qw", "qx", "qy", "qz")
EXPECTED = "poses of noether, each x, y, z, qw, qx, qy and qz"
_MARKS = re.compile(r"[\s,{}\[\]]+")
GROUPS = {"points": "xyz", "normals": "nx ny nz", "approaches": "ax ay az", "tangents": "tx ty tz"}


class PoseFile(NamedTuple):
    """The arguments of `poses` as a file gives them; not yet checked."""

    points: Array
    """(N, 3) m."""
    normals: Array
    approaches: Array | None = None
    tangents: Array | None = None


def read_poses(path: str | os.PathLike[str], units: str = "m") -> PoseFile:
    """Read poses from a CSV file with a header, a toolpath of noether or a point cloud.

    The columns of CSV are x, y, z, nx, ny, nz, and perhaps ax, ay, az (tool axis) and tx, ty, tz
    (tangent), in any order; a line for each pose. The waypoints of a toolpath that noether wrote
    (.yaml) have their normals along z and their tangents along x. A cloud (.pcd, not compressed)
    has normals as PCL and REACH have them.

    Args:
        path: the file, at most 16 MB and 20,000 poses; its ending says what it is.
        units: of x, y and z: "m" or "mm".

    Returns:
        The arguments: `poses(**read_poses("toolpath.csv", "mm")._asdict())`.

    Raises:
        SurfaceError: the file cannot be read, or is not such a file; several faults are named.
    """
    name = shown_name(path)
    checks = Checks("poses")
    scale = UNITS[checks.choice("units", units, tuple(UNITS))]
    checks.done()
    try:
        found = _read(path, Path(os.fsdecode(path)).suffix.lower())
    except CoverableError as error:
        raise SurfaceError(error.faults, name) from error
    found["points"] = scale * found["points"]
    return PoseFile(**found)


def _read(path: str | os.PathLike[str], ending: str) -> dict[str, Array]:
    """Points and directions (N, 3) by their names."""
    if ending == ".pcd":
        return cloud_poses(read_regular(path, MOST_BYTES, "a point cloud (.pcd)"))
    if ending in (".yaml", ".yml"):
        return _noether_poses(read_text(path, MOST_BYTES, "a toolpath of noether (.yaml)"))
    text = read_text(path, MOST_BYTES, "a list of poses (.csv)")
    lines = read_columns(text, MOST_POSES, "x,y,z,nx,ny,nz")
    columns = _columns([word.lower() for word in lines.head])
    values = lines.numbers({at: NUMBER for group in columns.values() for at in group})
    return {group: values[:, 3 * k : 3 * k + 3] for k, group in enumerate(columns)}


def _columns(header: list[str]) -> dict[str, list[int]]:
    """Where the columns of each group are.

    Raises:
        SurfaceError: there are others, or one is missing.
    """
    wanted = {group: words.split() if " " in words else list(words)
              for group, words in GROUPS.items()}  # fmt: skip
    faults = []
    known = {word for words in wanted.values() for word in words}
    foreign = [word for word in header if word not in known]
    if foreign or len(set(header)) < len(header) or not header:
        got = ", ".join(repr(word[:20]) for word in header[:12]) or "nothing"
        faults.append(
            f"must begin with a header of the columns x,y,z,nx,ny,nz, then perhaps ax,ay,az and "
            f"tx,ty,tz, each once; got {got}"
        )
    for group, words in wanted.items():
        missing = [word for word in words if word not in header]
        needed = group in ("points", "normals")
        if header and not foreign and missing and (needed or len(missing) < len(words)):
            faults.append(f"lacks the column{'s' * (len(missing) > 1)} {', '.join(missing)}")
    if faults:
        raise SurfaceError([Fault("", text) for text in faults])
    return {
        group: [header.index(word) for word in words]
        for group, words in wanted.items()
        if words[0] in header
    }


def _noether_poses(text: str) -> dict[str, Array]:
    """Points, normals and tangents (N, 3) of a toolpath, in the unit of the file.

    Raises:
        SurfaceError: it is something else; the first line that is wrong is named.
    """
    from scipy.spatial.transform import Rotation

    rows: list[dict[str, float]] = [{}]
    for place, line in enumerate(text.splitlines(), start=1):
        words = [word for word in _MARKS.split(line.partition("#")[0]) if word not in ("", "-")]
        for key, word in zip(words[::2], [*words[1::2], ""], strict=False):
            name, value = key.removesuffix(":"), number_in(word)
            row = rows[-1]
            if name not in KEYS or name in row or not key.endswith(":"):
                raise _fault(place, f"has {shown(key[:20])}; expected {EXPECTED}")
            if not math.isfinite(value):
                raise _fault(place, f"{name} is {shown(word[:20])}, no finite number")
            row[name] = value
            if len(row) == len(KEYS):
                rows.append({})
        if len(rows) > MOST_POSES + 1:
            raise SurfaceError(f"holds more than {MOST_POSES:,} poses; split the toolpath")
    if rows.pop():
        raise SurfaceError(f"ends within a pose; expected {EXPECTED}")
    table = np.array([[row[key] for key in KEYS] for row in rows]).reshape(len(rows), len(KEYS))
    turns = table[:, 3:]
    largest = np.abs(turns).max(axis=1, keepdims=True)
    if not (largest > 0.0).all():
        raise SurfaceError("holds a quaternion of zeros, which is no direction")
    axes = Rotation.from_quat(np.roll(turns / largest, -1, axis=1)).as_matrix()
    return {"points": table[:, :3], "normals": axes[:, :, 2], "tangents": axes[:, :, 0]}


def _fault(line: int, text: str) -> SurfaceError:
    return SurfaceError([Fault(f"line {line}", text)])
