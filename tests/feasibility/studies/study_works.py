"""Works for the tests of studies: functions of a module, as workers need them."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from contextlib import closing
from pathlib import Path


def double(tables):
    """Twice a number, after a little while."""
    time.sleep(tables.get("wait", 0.0))
    return {"verdict": "feasible", "double": 2 * tables["number"]}


def whoami(tables):
    """The process that works."""
    time.sleep(0.02)
    return {"pid": os.getpid()}


def die_first(tables):
    """Kill the worker the first time that a file is not there yet; for some numbers every time."""
    mark = Path(tables["folder"]) / str(tables["number"])
    if tables["number"] in tables["deadly"] or (tables["number"] in tables["once"] and _new(mark)):
        os.kill(os.getpid(), signal.SIGKILL)
    return {"verdict": "feasible", "double": 2 * tables["number"]}


def _new(mark):
    if mark.exists():
        return False
    mark.touch()
    return True


def die_at_once(*arguments):
    """In the place of what a worker begins with."""
    os._exit(3)


def begin_slowly(leash, word, gate):
    """In the place of what a worker begins with: one that compiles for long."""
    first = gate.acquire(False)
    if first:
        word.send_bytes(b"!")
        time.sleep(0.2)
        gate.release()


LOADED = []


def mark_loaded():
    """In the place of loading the kernels."""
    LOADED.append(1)


def marks():
    """How often this process has loaded them."""
    return LOADED


def kept(path):
    """How many rows a store holds that another process, or thread, writes."""
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        try:
            return int(base.execute("SELECT count(*) FROM tasks").fetchone()[0])
        except sqlite3.OperationalError:  # before the table is there
            return 0


def fail_odd(tables):
    """Refuse odd numbers."""
    if tables["number"] % 2:
        raise ValueError(f"{tables['number']} is odd")
    return {"verdict": "feasible", "number": tables["number"]}


def not_json(tables):
    """A result that cannot be kept."""
    return {"verdict": float("nan")}


def slow_verdict(tables):
    """A verdict that takes its time, so that a run can be interrupted."""
    from feasibility.studies.outcome import evaluate

    time.sleep(0.02)
    return evaluate(tables)


def plates():
    """60 small plates about a ur5: near ones, far ones and some in between."""
    from small_cases import small_case

    from feasibility.cases import as_read
    from feasibility.studies import StudyTask

    base = {title: as_read(table) for title, table in small_case("plate").to_tables().items()}
    tasks = []
    for i in range(10):
        for j in range(6):
            position = [0.09 * i, 0.0, 0.15 * j - 0.1]
            surface = {**base["surface"], "cells": [2, 2], "position": position}
            task = StudyTask({**base, "surface": surface}, {"i": i, "j": j}, slow_verdict)
            tasks.append(task)
    return tasks


STUDY = """
base.robot.name = "ur5"
base.surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [2, 2], side = "outside" }
base.task = { standoff = 0.02, cone_deg = 30 }
[vary]
"surface.position" = { x = { range = [-0.2, 0.7] }, z = { range = [-0.2, 0.7] } }
"surface.rpy_deg" = { yaw = { range = [-90, 90] } }
count = 80
"""  # the same kind of plates, as a file; about a third of them feasible


def run_plates(store_path, count):
    """What the test's own process runs, and others that are killed."""
    from feasibility.studies import Store, open_workers, run_tasks

    with Store(store_path) as store, open_workers(count) as workers:
        return run_tasks(plates(), workers, store)
