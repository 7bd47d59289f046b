"""Poses from files: CSV, a toolpath of noether, a point cloud; with caps, and taken for hostile."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from coverable.arrays import Array
from coverable.columns import NUMBER, read_columns
from coverable.errors import CoverableError, Fault
from coverable.files import read_regular, read_text, shown_name
from surfaces.arguments import Checks
from surfaces.surface import SurfaceError
from surfaces.toolpaths.cloud_file import cloud_poses
from surfaces.toolpaths.given import MOST_POSES
from surfaces.toolpaths.noether_file import noether_poses

MOST_BYTES = 16 << 20
UNITS = {"m": 1.0, "mm": 1e-3}
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
        return noether_poses(read_text(path, MOST_BYTES, "a toolpath of noether (.yaml)"))
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
