"""Works for the tests of studies: functions of a module, as workers need them."""

import os
import signal
import time
from pathlib import Path


def double(tables):
    return {"verdict": "feasible", "double": 2 * tables["number"]}


def double_slowly(tables):
    time.sleep(0.01)
    return double(tables)


def double_but_the_first_is_last(tables):
    """Twice a number; number 0 waits until the last number is done by another worker."""
    mark = Path(tables["mark"])
    if tables["number"] == tables["last"]:
        mark.touch()
    while tables["number"] == 0 and not mark.exists():
        time.sleep(0.001)
    return double(tables)


def whoami(tables):
    return {"pid": os.getpid()}


def die_first(tables):
    """Kill the worker the first time that a file is not there yet; for some numbers every time."""
    mark = Path(tables["folder"]) / str(tables["number"])
    once = tables["number"] in tables["once"] and not mark.exists()
    if once:
        mark.touch()
    if tables["number"] in tables["deadly"] or once:
        os.kill(os.getpid(), signal.SIGKILL)
    return double(tables)


def fail_odd(tables):
    """Refuse odd numbers; 99 gives a result that cannot be kept."""
    if tables["number"] == 99:
        return {"verdict": float("nan")}
    if tables["number"] % 2:
        raise ValueError(f"{tables['number']} is odd")
    return {"verdict": "feasible", "number": tables["number"]}


def fail_once(tables):
    """Refuse what was not tried before."""
    mark = Path(tables["folder"]) / f"tried {tables['number']}"
    if not mark.exists():
        mark.touch()
        raise ValueError("not yet")
    return double(tables)


STUDY = """
base.robot.name = "ur5"
base.surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [2, 2], side = "outside" }
base.task = { standoff = 0.02, cone_deg = 30 }
[vary]
"surface.position" = { x = { range = [-0.2, 0.7] }, z = { range = [-0.2, 0.7] } }
"surface.rpy_deg" = { yaw = { range = [-90, 90] } }
count = 12
"""  # small plates about an arm, about a third of them feasible


def stop_after_keeping():
    """From now on this process stops, and says so on stdout, as soon as it has kept something."""
    from coverable import Store

    keep = Store.keep

    def keep_and_stop(self, records):
        keep(self, records)
        print("kept", flush=True)
        signal.pause()

    Store.keep = keep_and_stop
