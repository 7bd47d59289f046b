"""Which pieces hang together, and which to turn over so that they share one outside."""

from __future__ import annotations

from collections.abc import Sequence

from surfaces.seams import Seam
from surfaces.surface import SurfaceError


def groups_of(count: int, seams: Sequence[Seam]) -> tuple[tuple[int, ...], ...]:
    """Which of `count` pieces hang together."""
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
