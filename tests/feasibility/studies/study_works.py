"""Works for the tests of studies: functions of a module, as workers need them."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from contextlib import closing
from pathlib import Path


def double(tables):
    """Twice a number."""
    return {"verdict": "feasible", "double": 2 * tables["number"]}


def double_but_the_first_is_last(tables):
    """Twice a number; number 0 waits until the last number is done by another worker."""
    mark = Path(tables["mark"])
    if tables["number"] == tables["last"]:
        mark.touch()
    while tables["number"] == 0 and not mark.exists():
        time.sleep(0.001)
    return double(tables)


def whoami(tables):
    """The process that works."""
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


def begin_slowly(parent, notices, lock):
    """In the place of what a worker begins with: the first compiles, and says so."""
    if lock.acquire(False):
        notices.send_bytes(b"!")


LOADED = []


def mark_loaded(rarely_used):
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


def plates():
    """24 small plates about a ur5: near ones, far ones and some in between."""
    from small_cases import small_case

    from feasibility.cases import as_read
    from feasibility.studies import StudyTask

    base = {title: as_read(table) for title, table in small_case("plate").to_tables().items()}
    tasks = []
    for i in range(6):
        for j in range(4):
            position = [0.16 * i, 0.0, 0.2 * j - 0.1]
            surface = {**base["surface"], "cells": [2, 2], "position": position}
            tasks.append(StudyTask({**base, "surface": surface}, {"i": i, "j": j}))
    return tasks


STUDY = """
base.robot.name = "ur5"
base.surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [2, 2], side = "outside" }
base.task = { standoff = 0.02, cone_deg = 30 }
[vary]
"surface.position" = { x = { range = [-0.2, 0.7] }, z = { range = [-0.2, 0.7] } }
"surface.rpy_deg" = { yaw = { range = [-90, 90] } }
count = 24
"""  # the same kind of plates, as a file; about a third of them feasible


def stop_after_keeping():
    """From now on this process stops, and says so on stdout, as soon as it has kept something."""
    from feasibility.studies import Store

    keep = Store.keep

    def keep_and_stop(self, records):
        keep(self, records)
        print("kept", flush=True)
        signal.pause()

    Store.keep = keep_and_stop


def run_plates(store_path, count):
    """What the test's own process runs, and others that are killed."""
    from feasibility.studies import Store, open_workers, run_tasks

    with Store(store_path) as store, open_workers(count) as workers:
        return run_tasks(plates(), workers, store)
