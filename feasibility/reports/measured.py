"""Figures of an answer that its text and its JSON both state."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from coverable.arrays import Array
from feasibility.verdict import Certificate, Verdict
from robots.robot import Robot


def limit_margin_deg(robot: Robot, certificate: Certificate, q: Array | None) -> float:
    """Least distance of a revolute joint from its limits, degrees; inf without such limits.

    The certificate's own margin mixes radians and metres where an arm has prismatic joints. Limits
    are convex, so the waypoints q (m, n) decide.
    """
    if not robot.prismatic.any() and not math.isnan(certificate.min_limit_margin):
        return math.degrees(certificate.min_limit_margin)
    if q is None or q.ndim != 2 or q.shape[1] != robot.n:
        return math.inf
    margins = np.minimum(q - robot.lower, robot.upper - q)[:, ~robot.prismatic]
    return math.degrees(float(margins.min(initial=np.inf)))


def seconds(
    timing: Mapping[str, float], middle: Iterable[str], before_s: float
) -> dict[str, float]:
    """The times of an answer to microseconds; what passed before it began is loading.

    Args:
        timing: in seconds, by key.
        middle: keys between `load_s` and `total_s`; zero where `timing` has none.
        before_s: seconds of imports and files before.
    """
    found = {key: float(timing.get(key, 0.0)) for key in ("load_s", *middle, "total_s")}
    found |= {key: found[key] + before_s for key in ("load_s", "total_s")}
    return {key: round(value, 6) for key, value in found.items()}


def message_of(verdict: Verdict) -> str:
    """What was found, and whether the time ran out before the causes were looked into."""
    missed = len(verdict.cells) - verdict.n_covered
    if len(verdict.causes) == missed:
        return verdict.message
    why = "a cell is" if missed == 1 else f"{missed:,} cells are"
    return f"{verdict.message} Why {why} missed was not looked into: the time limit ran out."
