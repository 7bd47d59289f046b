"""Which pieces are connected, and which to turn over so that they share one outside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfaces.patches import Patch
from surfaces.piecewise.seams import Seam
from surfaces.surface import SurfaceError


def groups_of(count: int, seams: Sequence[Seam]) -> tuple[tuple[int, ...], ...]:
    """The connected groups of `count` pieces."""
    group = list(range(count))
    for seam in seams:
        a, b = (group[k] for k in seam.pieces)
        group = [min(a, b) if g in (a, b) else g for g in group]
    return tuple(tuple(k for k in range(count) if group[k] == g) for g in sorted(set(group)))


def turned_pieces(count: int, seams: Sequence[Seam]) -> tuple[bool, ...]:
    """Which pieces to turn over, so that all agree with the first of their group.

    Raises:
        SurfaceError: there is no such choice.
    """
    turned: dict[int, bool] = {}
    for first in range(count):
        if first in turned:
            continue
        turned[first] = False
        waiting = [first]
        while waiting:
            k = waiting.pop()
            for seam in seams:
                if k not in seam.pieces:
                    continue
                other = seam.pieces[1] if seam.pieces[0] == k else seam.pieces[0]
                wanted = turned[k] if seam.agree else not turned[k]
                if other not in turned:
                    turned[other] = wanted
                    waiting.append(other)
                elif turned[other] != wanted:
                    raise SurfaceError(
                        f"piecewise: pieces[{min(k, other)}] and pieces[{max(k, other)}] cannot be "
                        "joined: going around the pieces, outward becomes inward, as on a Moebius "
                        "strip; leave one piece out, or cut the strip open"
                    )
    return tuple(turned[k] for k in range(count))


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
            closest_point = patches[b].closest(points)
            if (closest_point.inside & (np.abs(closest_point.height) <= gap)).sum() >= TOGETHER:
                return (min(a, b), max(a, b))
    return ()


def _places(patch: Patch) -> NDArray[np.float64]:
    """(PARTS^2, 3) m, inside the patch."""
    share = (np.arange(PARTS) + 0.5) / PARTS
    u, v = (low + share * (high - low) for low, high in (patch.u_range, patch.v_range))
    return patch.point(u[:, None], v[None, :]).reshape(-1, 3)
