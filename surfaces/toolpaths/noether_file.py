"""Toolpaths as noether writes them (YAML): poses (x, y, z, qw, qx, qy, qz) in nested lists.

A toolpath is a list of segments, each a list of waypoints; all follow one another here. z of a
waypoint is the outward normal, x the direction of travel. Of YAML no more is understood than these
numbers by their names, which is what a file that anybody may have written should be able to say.
"""

from __future__ import annotations

import math
import re

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, number_in, shown
from surfaces.surface import SurfaceError
from surfaces.toolpaths.given import MOST_POSES

KEYS = ("x", "y", "z", "qw", "qx", "qy", "qz")
EXPECTED = "poses of noether, each x, y, z, qw, qx, qy and qz"
_MARKS = re.compile(r"[\s,{}\[\]]+")


def noether_poses(text: str) -> dict[str, Array]:
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
