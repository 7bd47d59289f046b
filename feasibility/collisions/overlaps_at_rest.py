"""Bodies at rest that overlap from the start, which no motion changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from coverable_arrays import Array
from robots.shapes import Polytope

Pair = tuple[str, str]

NOTED = 5e-3  # [m] of overlap: the base of a ur5, as drawn, ends 4 mm below its frame
DIRECTIONS = 400  # all around, besides the normals of faces


def overlapping(bodies: Sequence[Polytope], pairs: Iterable[Pair]) -> list[str]:
    """A sentence for each pair of owners at rest whose convex bodies overlap.

    Args:
        bodies: convex ones, each in the root frame.
        pairs: of owners.
    """
    of_owner: dict[str, list[Polytope]] = {}
    for body in bodies:
        of_owner.setdefault(body.owner, []).append(body)
    notes = []
    for first, second in pairs:
        both = of_owner.get(first, ()), of_owner.get(second, ())
        deepest = max((overlap(a, b) for a in both[0] for b in both[1]), default=0.0)
        if deepest > NOTED:
            notes.append(
                f"{first} and {second} are rigid to each other, so the pair is not checked, but "
                f"they overlap by {1e3 * deepest:.1f} mm"
            )
    return notes


def overlap(a: Polytope, b: Polytope) -> float:
    """m, how far one of two bodies has to be moved to be free; 0 or less where a plane parts them.

    The least over the normals of their faces and directions all around, so it may be a little more
    than has to be.

    Example:
        >>> ball = Polytope("a", 0, np.zeros((1, 3)), 0.1)
        >>> round(overlap(ball, Polytope("b", 0, np.array([[0.15, 0.0, 0.0]]), 0.1)), 9)
        0.05
    """
    middles = b.vertices.mean(axis=0) - a.vertices.mean(axis=0)
    n = np.concatenate([middles[None], _normals(a), _normals(b), _all_around()])
    n = n[np.linalg.norm(n, axis=1) > 0.0]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n = np.concatenate([n, -n])
    ahead = (a.vertices @ n.T).max(axis=0) + a.radius
    behind = (b.vertices @ n.T).min(axis=0) - b.radius
    return float((ahead - behind).min())


def _normals(body: Polytope) -> Array:
    """(k, 3) of its faces; of a flat body or a line, directions in which it spreads."""
    from scipy.spatial import ConvexHull, QhullError

    apart = body.vertices - body.vertices.mean(axis=0)
    if len(apart) > 3:
        try:
            return np.asarray(ConvexHull(apart).equations[:, :3])
        except QhullError:
            pass
    return np.asarray(np.linalg.svd(apart)[2])


def _all_around() -> Array:
    """Unit vectors evenly in all directions (a Fibonacci lattice)."""
    k = np.arange(DIRECTIONS) + 0.5
    z, turn = 1.0 - 2.0 * k / DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
