"""The outcome of a case as a study keeps it: typed, and checked by its types when it is read back.

What a file holds is not trusted: no value of another type or outside its range is taken over.
"""

import json
import math
import re
from collections.abc import Mapping
from enum import StrEnum
from functools import cache, partial
from types import NoneType
from typing import Annotated, Any, Literal, NamedTuple, TypedDict, get_args, get_origin
from typing import get_type_hints as hints_of

import numpy as np

from coverable.arrays import Mask
from coverable.errors import alternatives, is_number, is_whole, printable, shown
from feasibility.verdict import Answer, CauseKind, Evidence

LONGEST_TEXT = 20_000  # characters
_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


class Within(NamedTuple):
    """The least and the largest value of a number."""

    low: float
    high: float = math.inf


Count = Annotated[int, Within(0, 1_000_000_000)]
"""Of cells, edges, waypoints."""
Whole = Annotated[int, Within(0)]
Share = Annotated[float, Within(0.0, 1.0 + 1e-9)]  # sums of areas are rounded
Angle = Annotated[float, Within(0.0, 180.0)]


class Margins(TypedDict):
    """What the covering motion keeps from every bound; None where there is no such bound."""

    limit_deg: float | None
    """Least distance of a revolute joint from its limits."""
    limit_m: float | None
    """Likewise of a prismatic one."""
    cone_deg: float | None
    """By how much the tool axis stays inside the cone."""
    reach_m: float | None
    """By how much the furthest target is nearer than the arm's reach."""
    placement_m: float | None
    """How far the surface may be shifted; None where that is not known."""


class Measured(TypedDict):
    """What the replay measured."""

    waypoints: Count
    max_position_error_m: Annotated[float, Within(0.0)] | None
    max_angle_deg: Angle | None


class Outcome(TypedDict):
    """A verdict as JSON values; no timing, so that the same case always has the same outcome."""

    verdict: Answer
    evidence: Evidence
    message: str
    method: Literal["complete", "greedy"]
    seed: Whole
    cells: Count
    covered: Count
    """Cells of the best motion."""
    share: Share
    """Of the area that these have."""
    edges: Count
    """Neighbouring cells that a motion joins."""
    pairs: Count
    """All neighbouring cells."""
    causes: dict[CauseKind, Count]
    """Missed cells by cause, the most frequent first."""
    components: list[str]
    """What single motions cover, as hexadecimal bits (see `cells_of`), the best first."""
    margins: Margins | None
    """None unless feasible, as for `certificate`."""
    certificate: Measured | None
    unchecked_links: list[str]
    """What has no body, as in `Verdict`."""
    fk: Whole
    """Evaluations of the arm."""


class Divided(Outcome):
    """With how many motions it takes; None where that is not known."""

    patches: Count | None
    patches_share: Share | None


def outcome_fault(result: Mapping[str, Any]) -> str:
    """What is wrong with the outcome of a case; empty where nothing is.

    Example:
        >>> outcome_fault({"more": 1})
        'more is not known'
    """
    fault = _fault("", result, Divided if "patches" in result else Outcome)
    if fault:
        return fault
    if result["covered"] > result["cells"]:
        return "covered is more than cells"
    try:
        for bits in result["components"]:
            cells_of(bits, result["cells"])
    except ValueError as error:
        return f"components: {error}"
    return ""


_types = cache(lambda kind: hints_of(kind, include_extras=True))


def _fault(name: str, value: Any, kind: Any) -> str:
    """What is wrong with a value that should be of a type; empty where nothing is."""
    outer, parts, expected, good = get_origin(kind), get_args(kind), "", False
    if outer is Annotated:
        low, high = parts[1]
        expected = (
            f"a {'whole' if parts[0] is int else 'finite'} number in {low:g} .. {round(high, 6):,}"
        )
        good = (
            is_whole(value, 0) if parts[0] is int else is_number(value)
        ) and low <= value <= high
    elif NoneType in parts:
        return "" if value is None else _fault(name, value, parts[0])
    elif hasattr(kind, "__total__"):
        return _fault_in_table(name, value, _types(kind))
    elif outer in (list, dict):
        if isinstance(value, outer):
            both = [*value, *(value.values() if outer is dict else ())]
            kinds = np.repeat(np.array(parts, dtype=object), len(value))
            return next(filter(None, map(partial(_fault, name), both, kinds)), "")
        expected = "a list of texts" if outer is list else "an object"
    elif outer is Literal or issubclass(kind, StrEnum):
        words = [str(word) for word in parts or kind]
        expected, good = alternatives(words), isinstance(value, str) and value in words
    elif kind is str:
        expected = "a text that can be printed"
        good = isinstance(value, str) and len(value) <= LONGEST_TEXT and not _CONTROL.search(value)
    else:
        expected, good = "a finite number", is_number(value)
    return "" if good else _must(name, expected, value)


def _fault_in_table(name: str, value: Any, types: Mapping[str, Any]) -> str:
    """What is wrong with an object of such values."""
    if not isinstance(value, Mapping):
        return _must(name, f"an object of {alternatives(list(types))}", value)
    unknown = [printable(str(key)) for key in value if key not in types]
    missing = [key for key in types if key not in value]
    if unknown or missing:
        said = f"{unknown[0]} is not known" if unknown else f"{missing[0]} is missing"
        return f"{name}: {said}" if name else said
    inner = (_fault(f"{name}.{key}" if name else key, value[key], types[key]) for key in types)
    return next(filter(None, inner), "")


def _must(name: str, expected: str, value: Any) -> str:
    return f"{name} must be {expected}, got {shown(value)}"


def bits_of(cover: Mask) -> str:
    """Cells (N,) as hexadecimal bits, the first cell first.

    Example:
        >>> bits_of(np.array([True, False, False, True, True]))
        '98'
    """
    return np.packbits(cover).tobytes().hex()


def cells_of(bits: str, n: int) -> Mask:
    """(n,) the cells that `bits_of` wrote.

    Example:
        >>> cells_of("98", 5).tolist()
        [True, False, False, True, True]

    Raises:
        ValueError: they are no bits of n cells.
    """
    data = np.frombuffer(bytes.fromhex(bits), dtype=np.uint8)
    if len(data) != (n + 7) // 8:
        raise ValueError(f"{len(data)} bytes do not hold the bits of {n} cells")
    return np.unpackbits(data, count=n).astype(bool)


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
