"""Parts of JSON objects that several answers share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from feasibility.results import plain
from feasibility.verdict import Cause, Certificate
from surfaces import Cells


def causes_json(causes: Iterable[Cause], cells: Cells) -> list[dict[str, Any]]:
    """Why each missed cell is missed."""
    return [
        {
            "cell": list(cells.unravel(cause.cell)),
            "cause": str(cause.kind),
            "proved": bool(cause.proved),
            "detail": cause.detail,
        }
        for cause in causes
    ]


def certificate_json(certificate: Certificate) -> dict[str, Any]:
    """What the replay of a motion measured; null where it measured nothing."""
    return {
        "waypoints": int(certificate.waypoints),
        "max_position_error_m": plain(float(certificate.max_position_error)),
        "max_angle_deg": plain(math.degrees(certificate.max_angle)),
    }


def seconds(
    timing: Mapping[str, float], middle: tuple[str, str], before_s: float
) -> dict[str, float]:
    """The times of an answer; what passed before it was asked for counts as loading.

    Args:
        timing: in seconds, by key.
        middle: keys between `load_s` and `total_s`; zero where `timing` has none.
        before_s: seconds of imports and files before.
    """
    found = {key: float(timing.get(key, 0.0)) for key in ("load_s", *middle, "total_s")}
    return found | {key: found[key] + before_s for key in ("load_s", "total_s")}


def rounded(times: Mapping[str, float]) -> dict[str, float]:
    """Times to microseconds."""
    return {key: round(value, 6) for key, value in times.items()}
