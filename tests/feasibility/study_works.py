"""Works for the tests of studies: functions of a module, as workers need them."""

from __future__ import annotations

import os
import signal
import time
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


def fail_odd(tables):
    """Refuse odd numbers."""
    if tables["number"] % 2:
        raise ValueError(f"{tables['number']} is odd")
    return {"verdict": "feasible", "number": tables["number"]}


def not_json(tables):
    """A result that cannot be kept."""
    return {"verdict": float("nan")}
