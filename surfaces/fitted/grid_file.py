"""Grids of points from NPY or CSV files, read with caps and taken for hostile."""

from __future__ import annotations

import io
import os
import tokenize
from pathlib import Path
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import CoverableError
from coverable.files import read_regular, shown_name
from surfaces.arguments import Checks
from surfaces.fitted.control_net_file import read_net
from surfaces.surface import SurfaceError

MOST_BYTES = 16 << 20
WHAT = "a grid of points (.npy or .csv)"
UNITS = {"m": 1.0, "mm": 1e-3}
DAMAGED = (
    ValueError, EOFError, OSError, MemoryError, SyntaxError, TypeError, tokenize.TokenError,
)  # fmt: skip
"""What numpy raises for a file that is none; it reads headers token by token."""


def read_grid(path: str | os.PathLike[str], units: str = "m") -> Array:
    """Read a grid of points.

    A `.npy` file holds an array (m, n, 3), no pickle. A `.csv` file has the columns row, column, x,
    y, z with a line for each point, in any order; rows and columns count from 0.

    Args:
        path: the file, at most 16 MB.
        units: of the coordinates, "m" or "mm".

    Returns:
        (m, n, 3) m; not yet checked by `grid`.

    Raises:
        SurfaceError: the file cannot be read, or is not such a file.
    """
    checks = Checks("grid")
    scale = UNITS[checks.choice("units", units, tuple(UNITS))]
    checks.done()
    name, suffix = shown_name(path), Path(path).suffix.lower()
    if suffix not in (".npy", ".csv"):
        raise SurfaceError("a grid of points must be a .npy or a .csv file", name)
    if suffix == ".npy":
        try:
            data = read_regular(path, MOST_BYTES, WHAT)
        except CoverableError as error:
            raise SurfaceError(error.faults, name) from error
        return scale * _from_npy(data, name)
    net = read_net(path, WHAT)
    if net.weights is not None:
        raise SurfaceError("has a column weight, which a grid of points has not", name)
    return scale * np.array(net.points, dtype=float).reshape(len(net.points), -1, 3)


def _from_npy(data: bytes, name: str) -> Array:
    """The array of a .npy file."""
    try:
        found: Any = np.load(io.BytesIO(data), allow_pickle=False)
    except DAMAGED as error:
        raise SurfaceError(f"is no .npy file that can be read: {str(error)[:120]}", name) from error
    known = isinstance(found, np.ndarray) and found.dtype.kind in "fiu"
    if not known or found.ndim != 3 or found.shape[2] != 3:
        kind = isinstance(found, np.ndarray)
        got = f"an array of shape {found.shape} and type {found.dtype}" if kind else "several"
        raise SurfaceError(f"must hold numbers of shape (m, n, 3), got {got}", name)
    return np.array(found, dtype=float)
