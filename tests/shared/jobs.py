"""Small questions that are answered at once, the command in this process, a clock that runs out."""

import contextlib
import io
import math
import os
import re
import sys
import time
import traceback
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from coverable import Case, Verdict, check
from feasibility.cli.main import main
from feasibility.clock import Clock, OutOfTime

PLATE = """
robot.name = "ur5"
surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [3, 4], \
position = [0, 0, 0.3], side = "outside" }
task = { standoff = 0.02, cone_deg = 30 }
"""
TEXTS = {
    "plate": PLATE,  # feasible
    # begins within reach and ends outside: proved infeasible
    "long plate": PLATE.replace("0.6]", "2.4]").replace("[3, 4]", "[4, 2]"),
    "greedy dome": """
robot = { name = "puma560", limits = "set-1" }
surface = { kind = "sphere", radius = 1, u_deg = [40, 60], v_deg = [60, 90], cells = [2, 3] }
task = { standoff = 0.005, cone_deg = 45 }
search = { method = "greedy", step_deg = 0.05 }
""",
}
"""One for each kind of answer."""


@cache
def case_named(name: str) -> Case:
    return Case.from_toml(TEXTS[name], name=name)


@cache
def verdict_named(name: str) -> Verdict:
    return check(*case_named(name).build())


class Said(NamedTuple):
    status: int
    out: str
    err: str

    @property
    def words(self) -> str:
        """stdout in one line."""
        return " ".join(self.out.split())


def run_coverable(*args: object, clock: Any = None) -> Said:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([str(arg) for arg in args], clock)
    assert "Traceback" not in err.getvalue(), err.getvalue()
    assert "bug in coverable" not in err.getvalue(), err.getvalue()
    # A machine that compiles kernels says so; that it does has its own test.
    return Said(
        status, out.getvalue(), re.sub(r"compiling .*first run only.*\n", "", err.getvalue())
    )


class EndingClock(Clock):
    """A clock whose time is up at the n-th look at it, wherever in the work that is.

    A block that is `enforced` ends at once then, as it would when its work never ended. Clocks that
    are made of it (`part`) count with it.
    """

    def __init__(self, limit: float | None = 3600.0, progress: Any = None, at: float = math.inf):
        super().__init__(limit, progress)
        self.at, self.looks = at, [0]

    def _look(self) -> bool:
        self.looks[0] += 1
        return self.looks[0] > self.at

    @property
    def deadline(self) -> float:
        """Long ago, from the n-th look on."""
        return time.monotonic() - 1e6 if self._look() else super().deadline

    @property
    def out_of_time(self) -> bool:
        """From the n-th look on."""
        return self._look()

    def part(self, share: float, progress: Any = None) -> Clock:
        """Another one, which counts the same looks."""
        made = EndingClock(self.limit, progress, self.at)
        made.looks = self.looks
        return made.begin(time.monotonic())

    @contextlib.contextmanager
    def enforced(self) -> Iterator[None]:
        """The time may be up in this block, or later."""
        if self._look():
            raise OutOfTime
        yield


def ends_at(look: float, made: list[EndingClock] | None = None) -> Any:
    """Makes such clocks, for a command; they are added to a list."""

    def make(limit: float | None, progress: Any) -> EndingClock:
        clock = EndingClock(limit, progress, look)
        if made is not None:
            made.append(clock)
        return clock

    return partial(make)


def said_without_ours(code: str, folder: Path, changes: dict[str, str]) -> str:
    """What code prints in a folder, in a fork of this process that forgets our modules alone."""
    ours, theirs = os.pipe()
    if not (child := os.fork()):
        sys.stdout = sys.stderr = os.fdopen(theirs, "w")
        for name in list(sys.modules):
            if name.partition(".")[0] in ("coverable", "robots", "surfaces", "feasibility"):
                del sys.modules[name]
        try:
            os.environ |= changes
            os.chdir(folder)
            sys.path.insert(0, str(folder))
            exec(code, {})
        except BaseException:  # noqa: BLE001 - the process ends here
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(0)
    os.close(theirs)
    with open(ours) as out:
        said = out.read()
    os.waitpid(child, 0)
    return said
