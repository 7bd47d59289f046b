"""A timed motion with its entry and its exit, from rest to rest each.

The trajectory of the path itself stays as it is, sample by sample. Entry and exit have curves and
times of their own, and are judged with the samples that they share with the path.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from coverable_arrays import Array
from feasibility.entry.ends import Ends
from feasibility.paths import CoveragePath, PathError
from feasibility.timing import MotionLimits, Trajectory, move_refusal, timed_moves, used

SHARES = 0.5 ** np.arange(1, 9)  # [1] of lines that turns may use, one after the other
SLOWER = (1.0, 1.05, 1.2, 1.5, 2.0)  # [1] times, where the shared sample needs too much


def entered(
    path: CoveragePath, run: Trajectory, ends: Ends, limits: MotionLimits, period: float
) -> Trajectory:
    """The trajectory of a path with its entry before it and its exit behind it.

    Args:
        path, run, ends: the path, its trajectory, its entry and exit.
        limits: that these keep to, too.
        period: s between samples.

    Raises:
        PathError: no timing of them was found that keeps to the limits, and clear.
    """
    before = _timed(path, ends.entry, run, 0, limits, period, "entry")
    after = _timed(path, ends.exit, run, -1, limits, period, "exit")
    first = before.duration - run.time[0]
    last = run.time[-1] + first - after.time[0]
    parts = [
        replace(before, time=before.time - before.time[0]),
        replace(run, time=run.time + first),
        replace(after, time=after.time + last),
    ]
    kept = [slice(0, -1), slice(None), slice(1, None)]
    own = np.ones(len(run), dtype=bool) if run.working is None else run.working
    working = np.pad(own, (len(before) - 1, len(after) - 1))

    def joined(name: str) -> Any:
        return np.concatenate(
            [getattr(part, name)[rows] for part, rows in zip(parts, kept, strict=True)]
        )

    return replace(
        run, time=np.round(joined("time"), 9), q=joined("q"), dq=joined("dq"), ddq=joined("ddq"),
        tool_speed=joined("tool_speed"), cell=joined("cell"), working=working,
    )  # fmt: skip


def _timed(
    path: CoveragePath, rows: Array, run: Trajectory, shared: int, limits: MotionLimits,
    period: float, what: str,
) -> Trajectory:  # fmt: skip
    """One of the moves with times; its end at the path has the path's own sample.

    Raises:
        PathError: no timing was found.
    """
    fault = "no timing was found"
    own = -1 if shared == 0 else 0
    rows = rows.copy()
    rows[own] = run.q[shared]
    for share in SHARES:
        for slower in SLOWER:
            made = timed_moves(path.robot, rows, float(share), limits, period, slower)
            ddq = made.ddq.copy()
            ddq[own] = run.ddq[shared]
            made = replace(made, ddq=ddq)
            if used(path.robot, made, limits).too_fast <= 1.0:
                break
        else:
            fault = "no timing was found that keeps to the limits where it joins the path"
            continue
        fault = move_refusal(path, made)
        if not fault:
            return made
    raise PathError(f"{what}: {fault}")
