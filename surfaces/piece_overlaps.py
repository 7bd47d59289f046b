"""Pieces that lie on each other, where they should only share borders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfaces.patch import Patch

PARTS = 8  # of u and of v, with a place in the middle of each
TOGETHER = 2  # places; pieces that cut through each other may share one by chance


def on_each_other(patches: Sequence[Patch], gap: float) -> tuple[int, ...]:
    """The first two pieces of which one lies on the other in part; empty where none do.

    Places inside each piece are looked at, an eighth of its width apart.

    Args:
        patches: in one frame.
        gap: m, how far two sheets may be apart that are one.
    """
    places = [_places(patch) for patch in patches]
    low = np.array([part.min(axis=0) for part in places]).reshape(-1, 3)
    high = np.array([part.max(axis=0) for part in places]).reshape(-1, 3)
    # The places end half a part before the borders; bent ones may leave their box between them.
    margin = gap + 0.5 * np.linalg.norm(high - low, axis=1, keepdims=True)
    for a, points in enumerate(places):
        near = ((low - margin <= high[a]) & (low[a] <= high + margin)).all(axis=1)
        near[a] = False
        for b in np.flatnonzero(near).tolist():
            foot = patches[b].closest(points)
            if (foot.inside & (np.abs(foot.height) <= gap)).sum() >= TOGETHER:
                return (min(a, b), max(a, b))
    return ()


def _places(patch: Patch) -> NDArray[np.float64]:
    """(PARTS^2, 3) m, inside the patch."""
    share = (np.arange(PARTS) + 0.5) / PARTS
    u, v = (low + share * (high - low) for low, high in (patch.u_range, patch.v_range))
    return patch.point(u[:, None], v[None, :]).reshape(-1, 3)
