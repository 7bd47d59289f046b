"""Where the circle of a joint can be cut open: an angle that it never has over the surface.

A joint that turns freely, or through more than a turn, repeats itself: all its windings place the
tool alike. Where it can nowhere be at t + 2 pi k, one turn from t stands for every winding, and a
motion stays inside its own. For that statement the other such joints may be anywhere in one turn,
and the rest inside their limits.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.cuts.gaps import KEPT, NARROWEST, Component
from feasibility.roadmap.cuts.regions import TURN


def openings(
    joint: int, components: list[Component], samples: NDArray[np.float64]
) -> Iterator[float]:
    """Angles (-pi to pi) that no component has, in the middle of the widest gaps first.

    Args:
        joint: which.
        components: what is known.
        samples: (k, n) other points of the motion set.
    """
    starts = [samples[:, joint]]
    widths = [np.zeros(len(samples))]
    for component in components:
        values = component.q[:, joint]
        starts.append(values.min(keepdims=True))
        widths.append(np.ptp(values, keepdims=True))
    start, width = np.mod(np.concatenate(starts), TURN), np.concatenate(widths)
    if not len(start):
        yield 0.0
        return
    order = np.argsort(start, kind="stable")
    start, end = start[order], np.maximum.accumulate((start + width)[order])
    # What reaches past a full turn covers the circle's beginning too.
    end = np.maximum(end, end[-1] - TURN)
    gap = np.append(start[1:], start[0] + TURN) - end
    for k in np.argsort(-gap, kind="stable")[:KEPT]:
        if gap[k] > NARROWEST:
            t = float(end[k] + 0.5 * gap[k])
            yield float(np.mod(t + np.pi, TURN) - np.pi)
