"""Studies: 1,000 placements of a 90-cell sphere patch, on one and two processes and on Dask.

Beside the wall clock stands the processor time, which other work on the machine does not change.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
COUNT = int(os.environ.get("COVERABLE_BENCH_PLACEMENTS", "1000"))

STUDY = f"""
base.case = "paper/4a"
[vary]
"surface.position" = {{ x = {{ range = [-0.1, 0.1] }}, y = {{ range = [-0.1, 0.1] }},
    z = {{ range = [-0.1, 0.1] }} }}
"surface.rpy_deg" = {{ yaw = {{ range = [-20, 20] }} }}
count = {COUNT}
""".replace(",\n    z", ", z")


def nothing(tables: dict[str, Any]) -> dict[str, Any]:
    """A task that costs nothing: what is left is the way there and back."""
    return {"verdict": "feasible"}


def memory(tables: dict[str, Any]) -> dict[str, Any]:
    """Largest memory of this worker so far, MB."""
    return {"pid": os.getpid(), "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def run(kind: str, count: int) -> dict[str, Any]:
    """One study in this process's workers."""
    import tempfile

    from feasibility.studies import Store, StudyTask, open_workers, run_tasks
    from feasibility.studies.file import read_study

    began = time.perf_counter()
    tasks = read_study(STUDY).tasks
    read = time.perf_counter() - began
    cluster = None
    if kind == "dask":
        from distributed import LocalCluster

        cluster = LocalCluster(
            n_workers=count, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        )
    there = (None, cluster.scheduler_address) if cluster else (count, None)
    with (
        tempfile.TemporaryDirectory() as folder,
        Store(f"{folder}/a.study") as store,
        open_workers(*there) as workers,
    ):
        run_tasks(tasks[: 4 * count], workers)  # the workers have started and are warm
        began, before = time.perf_counter(), time.process_time()
        rows = run_tasks(tasks, workers, store)
        wall, own = time.perf_counter() - began, time.process_time() - before
        seen = run_tasks([StudyTask({"k": k}, {}, memory) for k in range(64)], workers)
        idle = [StudyTask({"k": k}, {}, nothing) for k in range(2000)]
        began = time.perf_counter()
        run_tasks(idle, workers, store)
        way = (time.perf_counter() - began) / len(idle)
    if cluster is not None:
        cluster.close()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "workers": f"{count} {kind}",
        "placements": len(rows),
        "feasible": sum(row.result["verdict"] == "feasible" for row in rows),
        "read s": read,
        "wall s": wall,
        "work s": sum(row.seconds for row in rows),
        "efficiency": sum(row.seconds for row in rows) / (wall * count),
        "workers' CPU s": used.ru_utime + used.ru_stime,
        "parent CPU of a task ms": 1e3 * own / len(rows),
        "empty task ms": 1e3 * way,
        "MB/worker": max(row.result["mb"] for row in seen),
    }


def rows() -> tuple[str, list[dict[str, Any]]]:
    """Each in a process of its own."""
    found = []
    for kind, count in (("processes", 1), ("processes", 2), ("dask", 2)):
        done = subprocess.run(
            [sys.executable, __file__, kind, str(count)],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        )
        found.append(json.loads(done.stdout.splitlines()[-1]))
    first = found[0]
    for row in found:
        row["speed-up"] = first["wall s"] / row["wall s"]
    return f"{COUNT} placements of a 90-cell sphere patch", found


if __name__ == "__main__":
    sys.stdout.write(json.dumps(run(sys.argv[1], int(sys.argv[2]))) + "\n")
