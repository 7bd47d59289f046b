"""The tables of a run as JSON, in a form in which two runs compare.

The name of a column says what it holds; goals in brackets do not belong to it.

- With `s`, `ms` or `us` as a word ("cut s", "least ms"): a time that something took. In the file
  it is in calls of Pinocchio's FK (`fk_unit.py`), and stands under its name without the unit.
- Goals, peaks of memory, durations of motions, what depends on chance, and times that are in FK
  calls already: for the reader alone (`NOT_COMPARED`).
- Of the others, whole numbers and texts (evaluations, edges, boxes, verdicts) are counts, which are
  the same in every run; fractions are for the reader alone.

A row is called by as many of its first columns as tell all rows of the table apart.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from coverable_errors import CoverableError
from coverable_files import FileFault, read_regular

FORM = "coverable benchmarks 1"
LARGEST_FILE = 50_000_000  # bytes
IN_US = {"s": 1e6, "ms": 1e3, "us": 1.0}
TIME = re.compile(r"(?<![\w'])(s|ms|us)(?!\w)")
NOT_COMPARED = re.compile(
    r"(target|goal|allowed|duration|killed|kept|in .*FK)\b|(.*\W)?MB\b", re.IGNORECASE
)

Row = dict[str, dict[str, Any]]
Rows = dict[str, Row]


class BadBenchmarks(CoverableError):
    """A file that is not what `make bench` writes."""


class Run(NamedTuple):
    """One run, as its file holds it."""

    where: dict[str, Any]
    """Versions and processors."""
    tables: dict[str, Rows]
    """Of each table its rows by name; each has "times" [FK calls], "counts" and "others"."""


def rows_by_name(rows: Sequence[Mapping[str, object]], fk_us: float) -> Rows:
    """The rows of a table, sorted into times, counts and others.

    Args:
        rows: from column name to value, as `rows()` of a benchmark returns them.
        fk_us: one FK call of Pinocchio [us].
    """
    columns = list(rows[0])
    for known in range(1, len(columns) + 1):
        names = [", ".join(str(row[key]) for key in columns[:known]) for row in rows]
        if len(set(names)) == len(names):
            break
    return {name: _sorted(row, fk_us) for name, row in zip(names, rows, strict=True)}


def _sorted(row: Mapping[str, object], fk_us: float) -> Row:
    """One row; no figure where a time is empty or no number."""
    found: Row = {"times": {}, "counts": {}, "others": {}}
    for column, given in row.items():
        value = given.item() if hasattr(given, "item") else given  # numpy's numbers
        name = re.sub(r"\s*\([^)]*\)", "", column).strip()
        unit = TIME.search(name)
        if NOT_COMPARED.match(name):
            found["others"][name] = _plain(value)
        elif unit:
            words = f"{name[: unit.start()]} {name[unit.end() :]}".replace(", ", " ").split()
            calls = None
            if isinstance(value, (int, float)) and math.isfinite(value):
                calls = float(f"{value * IN_US[unit[1]] / fk_us:.6g}")
            found["times"][" ".join(words) or "time"] = calls
        else:
            kind = "others" if isinstance(value, float) else "counts"
            found[kind][name] = _plain(value)
    return found


def least(rounds: Sequence[Rows]) -> Rows:
    """The rows of the last round, with the least time of all rounds for each figure."""
    found = rounds[-1]
    for name, row in found.items():
        for column in row["times"]:
            taken = [rows[name]["times"].get(column) for rows in rounds if name in rows]
            row["times"][column] = min((t for t in taken if t is not None), default=None)
    return found


def _plain(value: object) -> object:
    """A value as JSON has it."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, int) else str(value)


def write(path: Path, unit: str, where: Mapping[str, Any], tables: Mapping[str, Any]) -> None:
    """Write what a run has found so far.

    Args:
        path: the file; what was there is replaced.
        unit: what one FK call is, in words.
        where: versions and processors.
        tables: of each benchmark its "title", "fk_us" and "rows" (`rows_by_name`).
    """
    text = json.dumps(
        {"form": FORM, "unit": unit, "where": where, "tables": tables},
        indent=1, ensure_ascii=False, allow_nan=False,
    )  # fmt: skip
    path.write_text(f"{text}\n", encoding="utf-8")


def read(path: Path) -> Run:
    """Read what a run wrote.

    Raises:
        BadBenchmarks: it is no such file; one sentence says why.
    """
    try:
        data = read_regular(path, LARGEST_FILE, "figures that make bench has written")
        whole = json.loads(data)
    except FileFault as error:
        raise BadBenchmarks(str(error), str(path)) from error
    except (ValueError, RecursionError) as error:
        raise BadBenchmarks(f"is not JSON: {error}", str(path)) from error
    if not isinstance(whole, dict) or whole.get("form") != FORM:
        raise BadBenchmarks(f'was not written by make bench; expected "form": "{FORM}"', str(path))
    try:
        where = _mapping(whole.get("where"), "where")
        tables = {
            name: _rows(_mapping(table, f"tables.{name}"), f"tables.{name}")
            for name, table in _mapping(whole.get("tables"), "tables").items()
        }
    except BadBenchmarks as error:
        raise BadBenchmarks(error.faults, str(path)) from error
    return Run(where, tables)


def _rows(table: dict[str, Any], at: str) -> Rows:
    """The rows of one table, checked."""
    rows = _mapping(table.get("rows"), f"{at}.rows")
    for name, row in rows.items():
        for kind in ("times", "counts"):
            values = _mapping(_mapping(row, f"{at}.rows.{name}").get(kind), f"{name}.{kind}")
            for column, value in values.items():
                key = f"{at}.rows.{name}.{kind}.{column}"
                if kind == "times" and not _is_time(value):
                    raise BadBenchmarks(f"{key} must be a number of at least 0, got {value!r}")
                if isinstance(value, (dict, list)):
                    raise BadBenchmarks(f"{key} must be a number or a text")
    return rows


def _is_time(value: object) -> bool:
    """A number that can be a time, or none (NaN, too: what was measured was no number)."""
    if value is None:
        return True
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return value != value or 0 <= value < 1e30


def _mapping(value: object, key: str) -> dict[str, Any]:
    """A table of JSON."""
    if not isinstance(value, dict):
        raise BadBenchmarks(f"{key} must be a table of JSON, got {type(value).__name__}")
    return value
