"""A study that is killed again and again, beside one that is left in peace: the same table.

The whole command runs, as typed: with 1, 2 and 4 processes; killed (SIGKILL) five times at random
moments and run again; and on Dask, where a worker is killed in the middle. Tables are compared byte
by byte, and so is everything that the stores hold of each case.
"""

from __future__ import annotations

import hashlib
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from bench_study import COUNT, ROOT, STUDY

KILLS = 5
SEED = int(os.environ.get("COVERABLE_BENCH_SEED", "1"))


def command(folder: Path, name: str, how: Sequence[str]) -> subprocess.Popen[bytes]:
    """`coverable study`, started."""
    files = ["--out", f"{name}.study", "--csv", f"{name}.csv"]
    return subprocess.Popen(
        [sys.executable, "-m", "feasibility.cli", "study", "study.toml", *files, *how],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
    )


def kept(path: Path) -> int:
    """Cases in a store that another process writes."""
    if not path.exists():
        return 0
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        try:
            return int(base.execute("SELECT count(*) FROM tasks").fetchone()[0])
        except sqlite3.OperationalError:  # before the table is there
            return 0


def outcomes(path: Path) -> str:
    """All that a store holds but the time that it took, in short."""
    with closing(sqlite3.connect(path)) as base:
        text = repr(base.execute("SELECT key, parameters, status, result FROM tasks").fetchall())
    return hashlib.sha256(text.encode()).hexdigest()


def finish(process: subprocess.Popen[bytes]) -> None:
    """Wait for a command that has to succeed."""
    if process.wait() != 0:
        raise RuntimeError(f"the study ended with {process.returncode}")


def left_in_peace(folder: Path, count: int) -> dict[str, Any]:
    """One run."""
    began = time.perf_counter()
    finish(command(folder, f"{count}", ["--workers", f"{count}"]))
    wall = time.perf_counter() - began
    return {"run": f"{count} processes", "killed": 0, "kept when killed": "", "wall s": wall}


def killed(folder: Path, wall: float) -> dict[str, Any]:
    """Killed five times within about the time of an undisturbed run, and run again each time."""
    rng, began, held = random.Random(SEED), time.perf_counter(), []
    for _ in range(KILLS):
        process = command(folder, "killed", ["--workers", "2"])
        time.sleep(rng.uniform(0.02, 0.4) * wall)
        if process.poll() is None:
            process.kill()
            held.append(kept(folder / "killed.study"))
        process.wait()
    finish(command(folder, "killed", ["--workers", "2"]))
    spent = time.perf_counter() - began
    return {"run": "killed, 2 processes", "killed": len(held), "kept when killed": f"{held}",
            "wall s": spent}  # fmt: skip


def on_dask(folder: Path) -> dict[str, Any]:
    """One of two workers is killed when a third is done; Dask starts another."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        began = time.perf_counter()
        process = command(folder, "dask", ["--dask", cluster.scheduler_address])
        while kept(folder / "dask.study") < COUNT // 3:
            if process.poll() is not None:
                raise RuntimeError("the study ended before the blow")
            time.sleep(0.05)
        os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
        held = kept(folder / "dask.study")
        finish(process)
        wall = time.perf_counter() - began
    return {"run": "2 Dask workers, one killed", "killed": 1, "kept when killed": f"[{held}]",
            "wall s": wall}  # fmt: skip


def rows() -> tuple[str, list[dict[str, Any]]]:
    """One row for each run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(STUDY, encoding="utf-8")
        found = [left_in_peace(folder, count) for count in (1, 2, 4)]
        found += [killed(folder, found[1]["wall s"]), on_dask(folder)]
        first = (folder / "1.csv").read_bytes()
        for row, stem in zip(found, ("1", "2", "4", "killed", "dask"), strict=True):
            row["rows"] = kept(folder / f"{stem}.study")
            row["same table"] = (folder / f"{stem}.csv").read_bytes() == first
            row["same outcomes"] = outcomes(folder / f"{stem}.study") == outcomes(
                folder / "1.study"
            )
    return f"A study of {COUNT} placements, left in peace and killed", found


if __name__ == "__main__":
    from run import table

    title, made = rows()
    sys.stdout.write(f"{title}\n\n{table(made)}\n")
