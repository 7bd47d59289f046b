"""Print the benchmark tables: every `bench_*.py` beside this file that has a function `rows`.

`rows()` returns a title and a list of rows, each a mapping from column name to value. What names
of columns mean is said in `benchmark_files.py`. With --json the figures are written too, with times
in FK calls of Pinocchio, which are measured right before and after each table.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import platform
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracle"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "paper"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmark_files import least, rows_by_name, write
from fk_unit import UNIT, pinocchio_fk_us

HERE = Path(__file__).resolve().parent


def table(rows: Sequence[Mapping[str, object]]) -> str:
    """Rows as a Markdown table, columns as wide as they need."""
    names = list(rows[0])
    lines = [names, *([format_value(row[name]) for name in names] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(names))]
    text = [
        "| " + " | ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) + " |"
        for line in lines
    ]
    text.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
    return "\n".join(text)


def format_value(value: object) -> str:
    """Four significant digits for measurements, everything else as it is."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def loaded(path: Path) -> ModuleType:
    """A benchmark, as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def where() -> dict[str, Any]:
    """What the figures depend on beside our code."""
    libraries = {name: version(name) for name in ("pin", "numba", "numpy")}
    return {"python": platform.python_version(), **libraries, "processors": os.cpu_count()}


def main(arguments: Sequence[str] | None = None, folder: Path = HERE) -> int:
    """Run all modules, or those whose names contain one of the arguments."""
    parser = argparse.ArgumentParser(description="Print the benchmark tables.")
    parser.add_argument("words", nargs="*", help="only tables whose names contain one of these")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there, too")
    parser.add_argument(
        "--rounds", type=int, default=1, metavar="N",
        help="run all tables N times, and write the least of each time (machine not quiet)",
    )  # fmt: skip
    given = parser.parse_args(arguments)
    paths = [
        path
        for path in sorted(folder.glob("bench_*.py"))
        if not given.words or any(word in path.stem for word in given.words)
    ]
    if not paths:
        parser.error(f"no table has a name with {' or '.join(given.words)} in it")
    if given.rounds < 1:
        parser.error(f"--rounds must be at least 1, got {given.rounds}")
    # A run that is interrupted leaves what it has, and the figures of an earlier one as they were.
    unfinished = given.json and given.json.with_name(f"{given.json.name}.unfinished")
    tables: dict[str, Any] = {}
    if unfinished:
        unfinished.parent.mkdir(parents=True, exist_ok=True)
        write(unfinished, UNIT, where(), tables)
    seen: dict[str, list[tuple[Sequence[Mapping[str, object]], float]]] = defaultdict(list)
    for path in paths * given.rounds:
        module = loaded(path)
        before = pinocchio_fk_us()
        title, rows = module.rows()
        name = path.stem.removeprefix("bench_")
        seen[name].append((rows, min(before, pinocchio_fk_us())))
        print(f"\n{title}\n\n{table(rows)}", flush=True)
        fk_us = min(unit for _, unit in seen[name])
        figures = least([rows_by_name(rows, fk_us) for rows, _ in seen[name]])
        tables[name] = {"title": title, "fk_us": fk_us, "rows": figures}
        if unfinished:
            write(unfinished, UNIT, where(), tables)
    if unfinished:
        os.replace(unfinished, given.json)
        print(f"\nFigures with times in Pinocchio FK calls: {given.json}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
