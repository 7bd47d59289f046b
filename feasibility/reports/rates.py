"""Largest speed and smallest singular value of an explained case, as text and as JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from feasibility.results import plain
from feasibility.sensitivity import Explanation
from robots import Kinematics


def rates_sentence(explanation: Explanation) -> str:
    """How fast the tool may be, and how near singularities the motion comes; empty if not known."""
    rates, asked = explanation.rates, explanation.asked
    if rates is None:
        return ""
    text = ""
    if math.isfinite(rates.largest):
        text = (
            f"Inside the joints' velocities a motion over all cells may have up to "
            f"{rates.largest:.3g} m/s all along, but for stops in place and at corners"
        )
        if asked is not None and asked.speed is not None:
            enough = "enough" if rates.largest >= asked.speed else "too little"
            text += f" ({asked.speed:g} m/s is required: {enough}; no threshold above requires it)"
        if rates.witness.speed < rates.largest:
            text += f"; the covering motion above {rates.witness.speed:.3g} m/s"
        text += ". "
    least = f"smallest singular value is at least {rates.witness.sigma:.3g}, near cell"
    return f"{text}The covering motion's {least} {_nearest_singular(explanation)}."


def _nearest_singular(explanation: Explanation) -> str:
    """The cell at which the covering motion is nearest to a singularity."""
    verdict, rates = explanation.verdict, explanation.rates
    if verdict.witness is None or rates is None or not len(rates.witness.segment.sampled_sigma):
        return str(list(verdict.cells.unravel(0)))
    row = int(np.argmin(rates.witness.segment.sampled_sigma))
    point, _ = Kinematics(verdict.robot).tool(verdict.witness.q[row])
    off = np.linalg.norm(verdict.task.targets(verdict.cells).points - point, axis=1)
    return str(list(verdict.cells.unravel(int(off.argmin()))))


def rates_object(explanation: Explanation) -> dict[str, Any] | None:
    """The same figures as an object; null where they are not known."""
    rates = explanation.rates
    if rates is None:
        return None
    places = [stop.why for stop in rates.witness.stops]
    return {
        "largest_speed_m_per_s": plain(rates.largest),
        "witness_speed_m_per_s": plain(rates.witness.speed),
        "min_singular_value": plain(rates.witness.sigma),
        "stops_in_place": places.count("in place"),
        "corners": places.count("corner"),
    }
