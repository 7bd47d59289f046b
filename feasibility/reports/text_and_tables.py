"""Parts that several answers share as text: wrapped lines, tables, what a replay measured."""

from __future__ import annotations

import math
import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array
from coverable.errors import at_least, at_most, counted, listed
from feasibility.task import Task
from feasibility.verdict import Bound, Certificate, Verdict
from robots.robot import Robot
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.certification.collisions.collision_replay import CollisionReplay
    from robots.shapes.link_pairs import LeftOut

WIDTH = 100  # columns
BUILT = ("adjacent", "rigid")  # reasons that lie in how the arm is built
_UNIT = re.compile(r"(?<=\d) (?=(?:deg|mm|m2|m/s|m|s)\b|%)")
_UNBROKEN = "\u00a0"  # textwrap breaks at plain blanks only


def filled(head: str, text: str) -> str:
    """Text behind a head, wrapped and indented, with no number parted from its unit.

    Example:
        >>> print(filled("path  ", "along " * 13 + "0.1234567890123456 deg"))
        path  along along along along along along along along along along along along along
              0.1234567890123456 deg
    """
    wrapped = textwrap.fill(
        _UNIT.sub(_UNBROKEN, text),
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return wrapped.replace(_UNBROKEN, " ")


def smooth_text(surface: Surface) -> str:
    """The same in words; empty for any other surface."""
    return "" if surface.smoothing is None else surface.smoothing.words()


def summary(head: str, rows: Iterable[tuple[str, str]], said: str, width: int = 12) -> list[str]:
    """The answer in one line, an empty line, and named rows; rows without text are left out.

    The last row is what is `said` of collisions. Names have `width` - 1 letters at most.
    """
    rows = [*rows, ("note", said)]
    return [head, "", *(filled(f"  {name:<{width - 1}} ", text) for name, text in rows if text)]


def aligned(table: Sequence[Sequence[str]], justify: str = "<") -> list[str]:
    """Rows with columns of equal width, to the left ("<") or to the right (">")."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join(f"{cell:{justify}{width}}" for cell, width in zip(row, widths, strict=True))
        for row in table
    ]


def percent(share: float) -> str:
    """A share, 0 to 1, in percent."""
    return f"{100.0 * share:.1f} %"


def left_out_text(pairs: Sequence[LeftOut]) -> str:
    """Pairs that are not checked in one line: those of the arm's build counted, others named."""
    built = Counter(one.why for one in pairs if one.why in BUILT)
    parts = [f"{number} {why}" for why, number in built.items()]
    parts += [f"{one.first} and {one.second} ({one.why})" for one in pairs if one.why not in BUILT]
    return "; ".join(parts)


def placement_text(certificate: Certificate | None) -> str:
    """Where the surface may stand, and what leaves least room; empty where that is not known."""
    margin = None if certificate is None else certificate.placement_margin
    if margin is None:
        return ""
    some = margin.bound_by is not Bound.START
    return f"a motion exists wherever the part stands {margin}" if some else str(margin)


def certificate_text(
    robot: Robot,
    certificate: Certificate,
    q: Array | None,
    task: Task,
    tolerance: float | None,
    noun: str = "waypoint",
) -> str:
    """What the replay of a motion q (m, n) measured in one line; empty where it measured nothing.

    Args:
        robot: the arm.
        certificate: of the replay.
        q: the motion; None where it is not stored.
        task: with what is allowed.
        tolerance: m, allowed of the tool point; None where that is not mentioned.
        noun: what a row of the motion is called.
    """
    if not math.isfinite(certificate.max_position_error):
        return ""
    allowed = "" if tolerance is None else f" (allowed {1e3 * tolerance:.3g})"
    angle = math.degrees(certificate.max_angle)
    margin = limit_margin_deg(robot, certificate, q)
    limits = f"joints at least {at_least(margin, 3)} deg from their limits"
    parts = [
        counted(certificate.waypoints, noun),
        f"tool point within {at_most(1e3 * certificate.max_position_error, 3)} mm of its "
        f"surface{allowed}",
        f"tool axis within {_within(angle, task.cone_deg)} deg (allowed {task.cone_deg:g})",
        roll_text(certificate, task),
        limits if 0.0 <= margin < math.inf else "",
        rates_text(certificate, task),
        clearance_text(certificate),
    ]
    return "; ".join(filter(None, parts))


def rates_text(certificate: Certificate, task: Task) -> str:
    """The largest speed, and the smallest singular value; empty where neither is required."""
    parts = []
    if task.speed is not None and certificate.max_speed is not None:
        parts.append(
            f"tool speeds up to {at_least(certificate.max_speed, 3)} m/s (required {task.speed:g})"
        )
    if task.min_manipulability is not None and certificate.min_singular_value is not None:
        least = f"singular values of at least {at_least(certificate.min_singular_value, 3)}"
        parts.append(f"{least} (required {task.min_manipulability:g})")
    return "; ".join(parts)


def roll_text(certificate: Certificate, task: Task) -> str:
    """How far the roll was from the middle of its range, at most; empty where it is free."""
    if task.roll is None or certificate.max_roll is None:
        return ""
    middle, half = math.degrees(task.roll.middle), math.degrees(task.roll.half)
    most = math.degrees(certificate.max_roll)
    return f"roll within {_within(most, half)} deg of {middle:.4g} deg (allowed {half:g})"


def _within(bound: float, allowed: float) -> str:
    """A bound to four digits that still holds, and does not look like more than is allowed."""
    found = at_most(bound, 4)
    return f"{allowed:g}" if bound <= allowed < float(found) else found


def clearance_text(certificate: Certificate | CollisionReplay) -> str:
    """How near which pair came along a motion; empty where that was not looked at."""
    if certificate.min_clearance is None or certificate.nearest_pair is None:
        return ""
    nearest = f"at least {at_least(1e3 * certificate.min_clearance, 3)} mm apart"
    if certificate.measured_clearance is not None:
        measured = f"{1e3 * certificate.measured_clearance:.3g} mm"
        nearest += f", certified, and {measured} where they were measured nearest"
    return f"bodies {nearest} ({' and '.join(certificate.nearest_pair)})"


def bodiless(results: Iterable[Sequence[str]]) -> str:
    """What has no body in some of many answers, to be added to what is said of collisions.

    Example:
        >>> bodiless([[], ["tool0 to TCP"], ["tool0 to TCP"]])
        '; without a body, so not checked: tool0 to TCP ([[collision.tool]] gives a tool its body)'
    """
    names = list(dict.fromkeys(name for unchecked in results for name in unchecked))
    remedy = "([[collision.tool]] gives a tool its body)"
    return f"; without a body, so not checked: {listed(names, 8)} {remedy}" if names else ""


def seconds_text(timing: Mapping[str, float], phases: Mapping[str, str], before_s: float) -> str:
    """The same times in one line, with the names of the phases by their keys."""
    times = seconds(timing, phases, before_s)
    parts = ", ".join(f"{name} {times[key]:.3f}" for key, name in phases.items())
    return f"{times['total_s']:.2f} s (loading {times['load_s']:.2f}, {parts})"


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
