"""Stores of studies that somebody tampered with, made from a seed."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from feasibility.cli.main import main

STUDY = """
base.case = "paper/4a"
base.surface = { cells = [2, 3] }
vary."task.cone_deg" = [30, 45]
"""
SCRIPT = "<script>alert(1)</script>"
ODD: tuple[Any, ...] = (5, None, True, "", SCRIPT, "maybe", [], {}, -1, 1e300, 10**30, [[]])

Row = tuple[Any, ...]


def study_with_store(folder: Path) -> Path:
    (folder / "study.toml").write_text(STUDY)
    asked = ["study", str(folder / "study.toml"), "--out", str(folder / "out.study")]
    assert main([*asked, "--workers", "0"]) == 0
    return folder


def rows(path: Path) -> list[Row]:
    with closing(sqlite3.connect(path)) as base:
        return base.execute("SELECT * FROM tasks ORDER BY key").fetchall()


def put(path: Path, row: Row) -> None:
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", row)


def allowed(key: str, odd: Any) -> bool:
    """May a result hold this of the odd values?"""
    if key == "message":
        return odd in ("", SCRIPT, "maybe")
    if key == "margins":
        return odd is None
    if key in ("components", "causes"):
        return bool(odd == ([] if key == "components" else {}))
    if key == "unchecked_links":  # names, which pages escape
        return odd in ([], [SCRIPT])
    counts = "seed", "edges", "pairs", "fk", "covered"
    return key in counts and odd == 5 and odd is not True
