"""Control nets from files: JSON or CSV text, read with a cap and taken for hostile."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

from coverable.errors import number_in
from coverable.files import read_text, shown_name
from surfaces.patches.nurbs.nurbs_checks import MOST_POINTS
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
    except (ValueError, csv.Error) as error:
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
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    header = [name.strip().lower() for name in next(lines, [])]
    rational = header == [*_COLUMNS, "weight"]
    if not rational and header != _COLUMNS:
        raise ValueError(f"must begin with the header {','.join(_COLUMNS)} or ...,z,weight")
    points: dict[tuple[int, int], list[float]] = {}
    for line in lines:
        if not line:
            continue
        where = f"line {lines.line_num}"
        if len(line) != len(header):
            raise ValueError(f"{where} must hold {len(header)} numbers, got {len(line)}")
        place = (_index(line[0], where), _index(line[1], where))
        if place in points:
            raise ValueError(f"{where} gives the point of row {place[0]}, column {place[1]} again")
        points[place] = [_number(word, where) for word in line[2:]]
        if len(points) > MOST_POINTS:
            raise ValueError(f"holds more than {MOST_POINTS:,} points; use a coarser net")
    rows = 1 + max((i for i, _ in points), default=-1)
    columns = 1 + max((j for _, j in points), default=-1)
    if len(points) < rows * columns:
        i, j = next((i, j) for i in range(rows) for j in range(columns) if (i, j) not in points)
        raise ValueError(
            f"must hold all {rows} x {columns} points, but row {i}, column {j} is missing"
        )
    grid = [[points[i, j] for j in range(columns)] for i in range(rows)]
    return NetFile(
        points=[[point[:3] for point in row] for row in grid],
        weights=[[point[3] for point in row] for row in grid] if rational else None,
    )


def _index(word: str, where: str) -> int:
    """A row or a column."""
    word = word.strip()
    if not (word.isascii() and word.isdigit() and len(word) <= 6):
        raise ValueError(f"{where}: a row or column must be a whole number >= 0, got {word[:40]!r}")
    return int(word)


def _number(word: str, where: str) -> float:
    """A finite number."""
    number = number_in(word)
    if not math.isfinite(number):
        raise ValueError(f"{where}: {word[:40]!r} is not a finite number")
    return number
