"""Control nets from files: JSON or CSV text, read with a cap and taken for hostile."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coverable.columns import NUMBER, WHOLE, read_columns
from coverable.errors import CoverableError, Fault
from coverable.files import read_text, shown_name
from surfaces.fitted.nurbs_checks import MOST_POINTS
from surfaces.surface import SurfaceError

MOST_BYTES = 16 << 20
_KEYS = ("points", "degree", "knots", "weights")
_COLUMNS = ["row", "column", "x", "y", "z"]


class NetFile(NamedTuple):
    """The arguments of `bspline` as a file gives them; not yet checked."""

    points: Any
    degree: Any = (3, 3)
    knots: Any = None
    weights: Any = None


def read_net(path: str | os.PathLike[str], what: str = "a control net (.json or .csv)") -> NetFile:
    """Read a control net, in metres.

    A `.json` file holds one object: `points` as rows of [x, y, z], and where wanted `degree`
    ([p, q]), `knots` ([of u, of v]) and `weights` (rows of numbers). A `.csv` file has the columns
    row, column, x, y, z and perhaps weight, with a line for each point, in any order; rows and
    columns count from 0.

    Args:
        path: the file, at most 16 MB.
        what: the file should be, for messages.

    Returns:
        The arguments: `bspline(**read_net("hood.json")._asdict())`.

    Raises:
        SurfaceError: the file cannot be read, or is not such a file.
    """
    name, suffix = shown_name(path), Path(path).suffix.lower()
    if suffix not in (".json", ".csv"):
        raise SurfaceError("a control net must be a .json or a .csv file", name)
    try:
        text = read_text(path, MOST_BYTES, what)
        return _from_json(text) if suffix == ".json" else _from_csv(text)
    except RecursionError as error:
        raise SurfaceError("is nested too deep for a control net", name) from error
    except CoverableError as error:
        raise SurfaceError(error.faults, name) from error
    except ValueError as error:
        raise SurfaceError(str(error), name) from error


def _from_json(text: str) -> NetFile:
    """The object of a JSON file."""
    value = json.loads(text, object_pairs_hook=_once, parse_constant=_refused)
    if not isinstance(value, dict):
        raise ValueError('must hold one object, {"points": [...], ...}')
    foreign = sorted(set(value) - set(_KEYS))
    if foreign:
        shown = ", ".join(repr(key[:40]) for key in foreign[:5])
        raise ValueError(f"has keys that are not known: {shown}; known are {', '.join(_KEYS)}")
    if "points" not in value:
        raise ValueError('has no key "points", the rows of control points')
    return NetFile(**value)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("has a key twice in one object; keep one of them")
    return found


def _refused(constant: str) -> float:
    raise ValueError(f"holds {constant}; every number must be finite")


def _from_csv(text: str) -> NetFile:
    """The grid of a CSV file."""
    lines = read_columns(text, MOST_POINTS, ",".join(_COLUMNS))
    header = [name.lower() for name in lines.head]
    rational = header == [*_COLUMNS, "weight"]
    if not rational and header != _COLUMNS:
        raise ValueError(f"must begin with the header {','.join(_COLUMNS)} or ...,z,weight")
    values = lines.numbers({k: WHOLE if k < 2 else NUMBER for k in range(len(header))})
    rows: dict[tuple[int, int], int] = {}
    faults = []
    for k, (i, j) in enumerate(values[:, :2].astype(np.int64).tolist()):
        if rows.setdefault((i, j), k) != k:
            text = f"gives the point of row {i}, column {j} again"
            faults.append(Fault("", text, f"line {lines.lines[k]}"))
    m, n = 1 + max(i for i, _ in rows), 1 + max(j for _, j in rows)
    if not faults and len(rows) < m * n:
        i, j = next((i, j) for i in range(m) for j in range(n) if (i, j) not in rows)
        faults = [Fault("", f"must hold all {m} x {n} points, but row {i}, column {j} is missing")]
    if faults:
        raise CoverableError(faults)
    grid = values[[[rows[i, j] for j in range(n)] for i in range(m)]]
    return NetFile(grid[..., 2:5].tolist(), weights=grid[..., 5].tolist() if rational else None)
