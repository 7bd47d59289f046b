"""Stores of studies that somebody tampered with, made from a seed."""

from __future__ import annotations

import json
import os
import random
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
TEXTS = ("{}", "[]", "null", "NaN", "{", "[" * 100_000, '{"a": Infinity}', '{"share": 1e999}', "")

Row = tuple[Any, ...]


def study_with_store(folder: Path) -> Path:
    """Run a study of two cases in a folder, with its store `out.study`; returns the folder."""
    (folder / "study.toml").write_text(STUDY)
    asked = ["study", str(folder / "study.toml"), "--out", str(folder / "out.study")]
    assert main([*asked, "--workers", "0"]) == 0
    return folder


def rows(path: Path) -> list[Row]:
    """All rows of a store."""
    with closing(sqlite3.connect(path)) as base:
        return base.execute("SELECT * FROM tasks ORDER BY key").fetchall()


def put(path: Path, row: Row) -> None:
    """Replace a row."""
    with closing(sqlite3.connect(path)) as base:
        base.execute("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", row)
        base.commit()


def tampered(good: Path, rng: random.Random, folder: Path) -> Path:
    """A copy of a store with a row, a schema or a byte that no study has written."""
    path = folder / "out.study"
    with closing(sqlite3.connect(good)) as base, closing(sqlite3.connect(path)) as copy:
        base.backup(copy)
    kinds = _value, _value, _value, _text, _text, _column, _encoding, _schema, _file
    rng.choice(kinds)(path, rng)
    return path


def allowed(key: str, odd: Any) -> bool:
    """May a result hold this of the odd values?"""
    if key == "message":
        return odd in ("", SCRIPT, "maybe")
    if key in ("margins", "certificate"):
        return odd is None
    if key in ("components", "causes"):
        return bool(odd == ([] if key == "components" else {}))
    if key == "unchecked_links":  # names, which pages escape
        return odd in ([], [SCRIPT])
    counts = "seed", "edges", "pairs", "examined", "fk", "covered"
    return key in counts and odd == 5 and odd is not True


def _value(path: Path, rng: random.Random) -> None:
    """One value of a result."""
    key, parameters, status, text, seconds = rng.choice(rows(path))
    result = json.loads(text)
    name = rng.choice(list(result))
    result[name] = rng.choice([odd for odd in ODD if not allowed(name, odd)])
    put(path, (key, parameters, status, json.dumps(result), seconds))


def _text(path: Path, rng: random.Random) -> None:
    """The whole text of a result or of parameters."""
    row = list(rng.choice(rows(path)))
    row[rng.choice((1, 3))] = rng.choice(TEXTS[1:])
    put(path, tuple(row))


def _column(path: Path, rng: random.Random) -> None:
    """A time that is none, or a value of another type."""
    row = list(rng.choice(rows(path)))
    column, value = rng.choice(
        ((4, float("inf")), (4, -1.0), (4, "soon"), (3, b"\0" * 9), (3, 7), (1, b"{}\xff"))
    )
    row[column] = value
    put(path, tuple(row))


def _encoding(path: Path, rng: random.Random) -> None:
    """Text that is no UTF-8, or longer than any result."""
    with closing(sqlite3.connect(path)) as base:
        value = rng.choice(("x'7bff7d'", "x'eda080'", "printf('%.*c', 80000000, 'x')"))
        base.execute(f"UPDATE tasks SET result = CAST({value} AS TEXT)")
        base.commit()


def _schema(path: Path, rng: random.Random) -> None:
    """A program in the file, another table in place of ours, or another file's marks."""
    with closing(sqlite3.connect(path)) as base:
        base.executescript(
            rng.choice(
                (
                    "CREATE VIEW v AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k FROM n) "
                    "SELECT k FROM n",
                    "CREATE TRIGGER t AFTER INSERT ON tasks BEGIN DELETE FROM tasks; END",
                    "DROP TABLE tasks; CREATE TABLE tasks (key)",
                    "DROP TABLE tasks; CREATE VIEW tasks AS SELECT 1 AS key",
                    "ALTER TABLE tasks RENAME COLUMN result TO outcome",
                    "PRAGMA user_version = 77",
                    "PRAGMA application_id = 77",
                )
            )
        )


def _file(path: Path, rng: random.Random) -> None:
    """The file itself, or one that SQLite keeps beside it."""
    kind = rng.choice(("cut", "bytes", "pipe", "folder", "link"))
    data = path.read_bytes()
    if kind == "cut":
        path.write_bytes(data[: rng.randrange(1, 4000)])
    elif kind == "bytes":
        path.write_bytes(data[:100] + bytes(rng.randrange(256) for _ in range(3000)) + data[3100:])
    elif kind == "pipe":
        os.mkfifo(f"{path}{rng.choice(('-wal', '-shm', '-journal'))}")
    else:
        path.unlink()
        path.mkdir() if kind == "folder" else path.symlink_to("/dev/zero")
