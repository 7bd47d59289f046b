"""Overrun that an arm cannot reach, cut off: what passes do beyond the border is to spare."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfaces.passes import Pass, Passes, PassPlaces


def with_reached_overrun(
    laid: Passes, places: PassPlaces, reached: NDArray[np.bool_]
) -> Passes | None:
    """The same passes, their overrun cut to what is reached from the border on.

    Args:
        laid: the passes.
        places: their poses.
        reached: (N,) the poses over which some configuration is known.

    Returns:
        The passes with a note on how much was cut; None where nothing is to be cut.
    """
    found, cut, ends = list[Pass](), 0.0, 0
    for number, each in enumerate(laid.stretches):
        own = reached[places.stretch == number]
        inside = np.flatnonzero(each.on_surface)
        lost = np.flatnonzero(~own)
        before, behind = lost[lost < inside[0]], lost[lost > inside[-1]]
        first = int(before[-1]) + 1 if len(before) else 0
        last = int(behind[0]) if len(behind) else len(own)
        kept = slice(first, last)
        shorter = replace(
            each, points=each.points[kept], normals=each.normals[kept],
            on_surface=each.on_surface[kept],
        )  # fmt: skip
        cut += each.length - shorter.length
        ends += (first > 0) + (last < len(own))
        found.append(shorter)
    if not ends:
        return None
    note = (
        f"the overrun at {ends} of {2 * len(found)} ends is shortened to what can be reached, by "
        f"{1e3 * cut / ends:.3g} mm on average"
    )
    return replace(laid, stretches=tuple(found), notes=(*laid.notes, note))
