"""Print the benchmark tables: every `bench_*.py` beside this file that has a function `rows`.

`rows()` returns a title and a list of rows, each a mapping from column name to value.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "paper"), str(HERE.parent / "oracle")]


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


def main() -> int:
    """Run all modules, or those whose names contain one of the arguments."""
    wanted = sys.argv[1:]
    for path in sorted(HERE.glob("bench_*.py")):
        if wanted and not any(word in path.stem for word in wanted):
            continue
        spec = importlib.util.spec_from_file_location(path.stem, path)
        if spec is None or spec.loader is None:
            continue
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        title, rows = module.rows()
        print(f"\n{title}\n\n{table(rows)}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
