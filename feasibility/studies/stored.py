"""The outcome of a case as a study keeps it: typed, and checked when it is read back.

What a file holds is not trusted: no value of another type or outside its range is taken over.
"""

import json
import math
import re
from collections.abc import Mapping
from typing import Any, Literal, TypedDict

import numpy as np

from coverable.arrays import Mask
from coverable.errors import LARGEST_WHOLE, MISSING, Checks, Fault, printable, worded
from feasibility.search_settings import METHODS
from feasibility.verdict import Answer, CauseKind, Evidence

LONGEST_TEXT = 20_000  # characters
MOST_SHARE = 1.0 + 1e-9  # sums of areas are rounded
_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


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


class Outcome(TypedDict):
    """A verdict as JSON values; no timing, so that the same case always has the same outcome."""

    verdict: Answer
    evidence: Evidence
    message: str
    method: Literal["complete", "greedy"]
    seed: int
    cells: int
    covered: int
    """Cells of the best motion."""
    share: float
    """Of the area that these have."""
    edges: int
    """Neighbouring cells that a motion joins."""
    pairs: int
    """All neighbouring cells."""
    causes: dict[CauseKind, int]
    """Missed cells by cause, the most frequent first."""
    components: list[str]
    """What single motions cover, as hexadecimal bits (see `cells_of`), the best first."""
    margins: Margins | None
    """None unless feasible."""
    unchecked_links: list[str]
    """What has no body, as in `Verdict`."""
    fk: int
    """Evaluations of the arm."""


class Divided(Outcome):
    """With what `compare` wants, which no store holds; None where that is not known."""

    patches: int | None
    patches_share: float | None
    critical_cone_deg: float | None


WORDS = {"verdict": [*Answer], "evidence": [*Evidence], "method": [*METHODS]}
COUNTS = ("cells", "covered", "edges", "pairs")
MOST = 1_000_000_000  # of any of these


def outcome_fault(result: Mapping[str, Any]) -> str:
    """What is wrong with the outcome of a case; empty where nothing is.

    Example:
        >>> outcome_fault({"more": 1})
        'more is not known'
    """
    checks, keys = Checks(), Outcome.__annotations__
    for key in result:
        if key not in keys:
            checks.keep(Fault(printable(str(key)), "is not known"))
    values = {key: result.get(key, MISSING) for key in keys}
    for key, words in WORDS.items():
        checks.choice(key, values[key], words)
    for key in (*COUNTS, "seed", "fk"):
        checks.whole(key, values[key], 0, MOST if key in COUNTS else LARGEST_WHOLE)
    checks.number("share", values["share"], "must be a number in 0 .. 1", 0.0, MOST_SHARE)
    margins, names = values["margins"], Margins.__annotations__.keys()
    if isinstance(margins, Mapping) and margins.keys() == names:
        for key in names:
            if margins[key] is not None:
                checks.number(f"margins.{key}", margins[key], "must be a finite number")
    elif margins is not None:
        checks.wrong("margins", margins, f"must be an object of {', '.join(names)}")
    for key in ("message", "components", "unchecked_links"):
        texts = [values[key]] if key == "message" else values[key]
        for text in texts if isinstance(texts, list) else [None]:
            if not isinstance(text, str) or len(text) > LONGEST_TEXT or _CONTROL.search(text):
                checks.wrong(key, texts, "must be a text that can be printed, or a list of such")
    causes = values["causes"] if isinstance(values["causes"], dict) else {"": values["causes"]}
    for kind, number in causes.items():
        checks.choice("causes", kind, [*CauseKind])
        checks.whole("causes", number, 0, MOST)
    if checks.faults:
        return worded(checks.faults[0])
    if result["covered"] > result["cells"]:
        return "covered is more than cells"
    try:
        for bits in result["components"]:
            cells_of(bits, result["cells"])
    except ValueError as error:
        return f"components: {error}"
    return ""


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
        value = json.loads(text, parse_constant=_finite, parse_float=_finite)
    except (TypeError, RecursionError) as error:
        raise ValueError("is no JSON, or nested too deeply") from error
    if not isinstance(value, dict):
        raise ValueError("is no JSON object")
    return value


def _finite(text: str) -> float:
    if not math.isfinite(value := float(text)):
        raise ValueError(f"holds {text[:20]}")
    return value
