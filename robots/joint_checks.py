"""What is to be said about the joints of an arm: kinds, limits, a start, joints of no use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from robots.errors import RobotError

KINDS = ("revolute", "continuous", "prismatic")


def joint_faults(
    names: Sequence[str],
    kinds: Sequence[str],
    lower: Array,
    upper: Array,
    start: Array | None,
) -> list[str]:
    """Joints of unknown kind, empty limit ranges, and a start outside of the limits.

    Args:
        names, kinds: of the joints, base to tip.
        lower, upper: (n,) rad or m.
        start: (n,) rad or m, if there is one.
    """
    faults = []
    if not names or len(kinds) != len(names):
        faults.append(
            f"{len(names)} joint names and {len(kinds)} kinds; "
            "there must be at least one joint, and one kind for each"
        )
    for joint, kind in zip(names, kinds, strict=False):
        if kind not in KINDS:
            faults.append(f"joint {joint!r} is {kind!r}, not one of {', '.join(KINDS)}")
    for joint, low, high in zip(names, lower, upper, strict=True):
        if not (low <= high and low < np.inf and high > -np.inf):
            faults.append(
                f"joint {joint!r} has limits {low:g} .. {high:g}; the lower one must not be "
                "above the upper one (rad or m)"
            )
    if start is not None and not faults:
        faults += [
            f"start puts joint {joint!r} at {value:g}, outside its limits {low:g} .. {high:g}"
            for joint, value, low, high in zip(names, start, lower, upper, strict=True)
            if not low <= value <= high
        ]
    return faults


def moves_both(joint: str, link: str, value: float, slides: bool) -> str:
    """That a joint is held because it moves the surface, which `link` carries, and the tool."""
    return (
        f"joint {joint!r} moves both the surface, on link {link!r}, and the tool, so it does not "
        f"help and is held at {value:g} {'m' if slides else 'rad'}"
    )


def no_limit_set(name: str, known: Iterable[str]) -> str:
    """That there is no limit set of this name, and which there are."""
    return f"there is no limit set {name!r}; it has: {', '.join(sorted(known)) or 'none'}"


def numbers(values: ArrayLike, what: str, shape: tuple[int, ...] | None = None) -> Array:
    """A write-protected copy as an array of floats of that shape; RobotError where it is none."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise RobotError(f"{what} must be an array of numbers, got {values!r}") from error
    if shape is not None and array.shape != shape:
        raise RobotError(f"{what} has shape {array.shape}, not {shape}")
    array.flags.writeable = False
    return array
