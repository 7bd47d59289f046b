"""What the results of a store must look like: files are not trusted, so they are checked."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from coverable.errors import alternatives, is_number, is_whole, printable, shown
from feasibility.studies.outcome import cells_of
from feasibility.verdict import Answer, CauseKind, Evidence

MOST = 1_000_000_000  # of anything that is counted: cells, edges, waypoints
LONGEST_TEXT = 20_000  # characters
_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


class Part(NamedTuple):
    """One value of a result."""

    holds: Callable[[Any], bool]
    expected: str


Shape = Mapping[str, Part]


def number(low: float = -math.inf, high: float = math.inf) -> Part:
    """A finite number in a range."""
    return Part(lambda value: is_number(value) and low <= value <= high, "a finite number in range")


def word(options: type[Answer] | type[Evidence] | tuple[str, ...]) -> Part:
    """One of some words."""
    words = [str(option) for option in options]
    return Part(lambda v: isinstance(v, str) and v in words, alternatives(words))


def optional(part: Part) -> Part:
    """The same, or nothing."""
    return Part(lambda value: value is None or part.holds(value), f"{part.expected}, or null")


def table(shape: Shape) -> Part:
    """An object of such values."""
    return Part(
        lambda value: isinstance(value, dict) and not fault_in(value, shape),
        f"an object of {alternatives(list(shape))}",
    )


COUNT = Part(lambda value: is_whole(value, 0, MOST), f"a whole number in 0 .. {MOST:,}")
WHOLE = Part(lambda value: is_whole(value, 0), "a whole number >= 0")
SHARE = Part(number(0.0, 1.0 + 1e-9).holds, "a number in 0 .. 1")  # sums of areas are rounded
TEXT = Part(
    lambda v: isinstance(v, str) and len(v) <= LONGEST_TEXT and not _CONTROL.search(v),
    "a text that can be printed",
)
NAMES = Part(
    lambda value: isinstance(value, list) and all(map(TEXT.holds, value)), "a list of names"
)
VERDICT = word(Answer)
EVIDENCE = word(Evidence)
CAUSE = Part(lambda value: value in [str(kind) for kind in CauseKind], "a cause")
CAUSES = Part(
    lambda value: (
        isinstance(value, dict)
        and all(map(CAUSE.holds, value))
        and all(map(COUNT.holds, value.values()))
    ),
    "numbers of cells by cause",
)
BITS = Part(
    lambda value: isinstance(value, list) and all(isinstance(bits, str) for bits in value),
    "a list of hexadecimal bits",
)
MARGINS = optional(
    table(
        {
            key: optional(number())
            for key in ("limit_deg", "limit_m", "cone_deg", "reach_m", "placement_m")
        }
    )
)

OUTCOME: Shape = {
    "verdict": VERDICT,
    "evidence": EVIDENCE,
    "message": TEXT,
    "method": word(("complete", "greedy")),
    "seed": WHOLE,
    "cells": COUNT,
    "covered": COUNT,
    "share": SHARE,
    "edges": COUNT,
    "pairs": COUNT,
    "causes": CAUSES,
    "examined": COUNT,
    "components": BITS,
    "margins": MARGINS,
    "certificate": optional(
        table(
            {
                "waypoints": COUNT,
                "max_position_error_m": optional(number(0.0)),
                "max_angle_deg": optional(number(0.0, 180.0)),
            }
        )
    ),
    "unchecked_links": NAMES,
    "fk": WHOLE,
}
"""Of one case: see `outcome_of`."""

FURTHER: Shape = {
    "patches": optional(COUNT),
    "patches_share": optional(SHARE),
    "critical_cone_deg": optional(number(0.0, 180.0)),
}
"""Where it is wanted: see `further_figures`."""


def outcome_fault(result: Mapping[str, Any]) -> str:
    """What is wrong with the result of a case; empty where nothing is."""
    return fault_in(result, {**OUTCOME, **FURTHER} if "patches" in result else OUTCOME)


def fault_in(result: Mapping[str, Any], shape: Shape) -> str:
    """What is wrong with a result; empty where nothing is.

    Example:
        >>> fault_in({"share": 2}, {"share": SHARE})
        'share must be a number in 0 .. 1, got 2'
    """
    unknown = [printable(str(key)) for key in result if key not in shape]
    if unknown:
        return f"{unknown[0]} is not known"
    for key, part in shape.items():
        if key not in result:
            return f"{key} is missing"
        if not part.holds(result[key]):
            return f"{key} must be {part.expected}, got {shown(result[key])}"
    if result.get("covered", 0) > result.get("cells", MOST):
        return "covered is more than cells"
    try:
        for bits in result.get("components", ()):
            cells_of(bits, result["cells"])
    except ValueError as error:
        return f"components: {error}"
    return ""


def json_object(text: Any) -> dict[str, Any]:
    """A JSON object of finite numbers.

    Raises:
        ValueError: the text is anything else.
    """
    try:
        value = json.loads(text, parse_constant=_refused, parse_float=_finite)
    except (TypeError, RecursionError) as error:
        raise ValueError("is no JSON, or nested too deeply") from error
    if not isinstance(value, dict):
        raise ValueError("is no JSON object")
    return value


def _refused(word_: str) -> float:
    raise ValueError(f"holds {word_}")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _refused(text[:20])
