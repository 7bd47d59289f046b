"""What a path allows of the speed asked for, and how it is entered and left."""

from __future__ import annotations

from typing import Any

import numpy as np

from feasibility.certification.rates import RateReplay
from feasibility.entry import Ends
from feasibility.paths import CoveragePath
from feasibility.results import plain
from feasibility.timing import Trajectory

FEW = 5  # cells that are named
HARDLY_LESS = 0.9  # [1] of the speed asked for


def share_at_speed(trajectory: Trajectory, speed: float) -> float:
    """Share of the tool's way over the surface at the speed asked for, or hardly less.

    The rest is where the joints' accelerations do not allow it, at stops above all.
    """
    over = np.flatnonzero(trajectory.cell >= 0)
    if len(over) < 2:
        return 0.0
    inside = slice(int(over[0]), int(over[-1]) + 1)
    speeds, time = trajectory.tool_speed[inside], trajectory.time[inside]
    way = 0.5 * (speeds[1:] + speeds[:-1]) * np.diff(time)
    fast = np.minimum(speeds[1:], speeds[:-1]) >= HARDLY_LESS * speed
    return float(way[fast].sum() / max(float(way.sum()), 1e-300))


def rates_json(
    path: CoveragePath, rates: RateReplay | None, trajectory: Trajectory | None = None
) -> dict[str, Any]:
    """The judge's figures; no key where nothing was asked."""
    if rates is None:
        return {}
    stops = [{"why": stop.why, "cell": list(path.cells.unravel(stop.cell))} for stop in rates.stops]
    found: dict[str, Any] = {"holds": rates.accepted, "why_not": list(rates.refusals)}
    if path.task.speed is not None:
        found |= {"speed_m_per_s": path.task.speed, "stops": stops, "waiting_s": rates.waiting}
        if trajectory is not None:
            found["share_at_speed"] = share_at_speed(trajectory, path.task.speed)
    if path.task.min_manipulability is not None:
        found["min_singular_value"] = plain(rates.sigma)
    return {"rates": found}


def rates_words(
    path: CoveragePath, rates: RateReplay | None, trajectory: Trajectory | None = None
) -> str:
    """The same in words; empty where nothing was asked."""
    if rates is None:
        return ""
    parts = list(rates.refusals)
    if path.task.speed is not None:
        where = [stop.cell for stop in rates.stops if stop.why == "in place"]
        names = ", ".join(str(list(path.cells.unravel(c))) for c in dict.fromkeys(where[:FEW]))
        at = f" at {names}{', ...' if len(where) > FEW else ''}" if where else ""
        corners = len(rates.stops) - len(where)
        able = "inside the joints' velocities all along" if rates.accepted else "not all along"
        parts.insert(
            0,
            f"{path.task.speed:g} m/s {able}; {len(where)} waits in place{at}, {corners} corners",
        )
        if trajectory is not None:
            share = 100.0 * share_at_speed(trajectory, path.task.speed)
            parts.append(f"with accelerations {share:.0f} % of the way at that speed")
    if path.task.min_manipulability is not None and rates.accepted:
        parts.append(f"singular values of at least {path.task.min_manipulability:g}")
    return "; ".join(parts)


def ends_json(ends: Ends | None) -> dict[str, Any]:
    """Entry and exit; no key where there are none."""
    if ends is None:
        return {}
    rows = {"entry": ends.entry.tolist(), "exit": ends.exit.tolist()}
    return {"ends": {"approach_m": ends.approach, "from_home": ends.from_home, **rows}}


def ends_words(ends: Ends | None) -> str:
    """The same in words; empty where there are none."""
    if ends is None:
        return ""
    words = f"in and out along the approach direction, {1e3 * ends.approach:g} mm each"
    return f"{words}, from and to home" if ends.from_home else words
