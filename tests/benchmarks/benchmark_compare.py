"""What changed between two runs of `make bench`: python benchmark_compare.py OLD.json NEW.json.

Exit status: 1 where something became slower by more than 10 %, 2 where a file is of no use, else 0.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmark_files import BadBenchmarks, Row, Rows, Run, read

MORE = 1.1  # slower, or faster, by more than this is reported

# What a line of the report is about, in the order of the report.
SLOWER, CHANGED, GONE, NEW, FASTER = (
    "slower by more than 10 %",
    "counts that changed",
    "no longer there",
    "new",
    "faster by more than 10 %",
)
Line = tuple[str, str]


def differences(old: Run, new: Run) -> list[Line]:
    """Kind and words of each difference.

    Raises:
        BadBenchmarks: no table is in both.
    """
    if not old.tables.keys() & new.tables.keys():
        raise BadBenchmarks("the two files have no table in common")
    return [
        *_of_keys(old.tables, new.tables, "table "),
        *chain.from_iterable(
            _of_rows(name, old.tables[name], new.tables[name])
            for name in old.tables
            if name in new.tables
        ),
    ]


def _of_keys(old: dict[str, Any], new: dict[str, Any], before: str) -> Iterator[Line]:
    """What only one of them has."""
    yield from ((GONE, f"{before}{key}") for key in old if key not in new)
    yield from ((NEW, f"{before}{key}") for key in new if key not in old)


def _of_rows(table: str, old: Rows, new: Rows) -> Iterator[Line]:
    """What changed in a table."""
    yield from _of_keys(old, new, f"{table}: ")
    for name, row in old.items():
        if name in new:
            yield from _of_row(f"{table}: {name}: ", row, new[name])


def _of_row(before: str, old: Row, new: Row) -> Iterator[Line]:
    """What changed in a row."""
    was, now = _numbers(old["times"]), _numbers(new["times"])
    yield from _of_keys(was, now, before)
    for name in (name for name in was if name in now):
        a, b = was[name], now[name]
        if b > MORE * a or a > MORE * b:
            share = f" ({100.0 * (b / a - 1.0):+.1f} %)" if a else ""
            words = f"{before}{name} {_shown(a)} -> {_shown(b)} FK calls{share}"
            yield SLOWER if b > a else FASTER, words
    counted, counts = old["counts"], new["counts"]
    yield from _of_keys(counted, counts, before)
    for name in (name for name in counted if name in counts):
        if counted[name] != counts[name]:
            yield CHANGED, f"{before}{name} {counted[name]} -> {counts[name]}"


def _shown(calls: float) -> str:
    """A number of calls, as one reads it."""
    return f"{calls:,.0f}" if calls >= 100.0 else f"{calls:.3g}"


def _numbers(times: dict[str, Any]) -> dict[str, float]:
    """Those that are numbers."""
    return {k: v for k, v in times.items() if v is not None and math.isfinite(v)}


def report(old: Run, new: Run) -> tuple[str, bool]:
    """All differences in words, and whether something became slower."""
    lines = differences(old, new)
    text = [
        f"{key}: {old.where.get(key)} -> {new.where.get(key)}"
        for key in {**old.where, **new.where}
        if old.where.get(key) != new.where.get(key)
    ]
    for kind in (SLOWER, CHANGED, GONE, NEW, FASTER):
        found = [words for what, words in lines if what == kind]
        text += [f"{kind}: {len(found)}", *(f"  {words}" for words in found)]
    return "\n".join(text), any(what == SLOWER for what, _ in lines)


def main(arguments: Sequence[str]) -> int:
    """Compare two files."""
    if len(arguments) != 2 or not all(arguments):
        sys.stderr.write("two files are needed: make bench-compare OLD=old.json NEW=new.json\n")
        return 2
    try:
        text, slower = report(*(read(Path(name)) for name in arguments))
    except BadBenchmarks as error:
        sys.stderr.write(f"{error}\n")
        return 2
    print(text)
    return int(slower)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
