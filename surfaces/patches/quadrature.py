"""Area of parameter rectangles of any smooth patch: Gauss-Legendre, halved where that is needed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.surface import SurfaceError

TOLERANCE = 1e-10  # of a piece's area: the two rules differ by no more
_ROUNDING = 1e-15  # of all of the rectangle's, likewise
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(9)
_MOST_HALVINGS = 60
_MOST_PIECES = 200_000  # rectangles held at a time
_WHOLE = np.array([-np.inf, np.inf])


def rectangle_areas(
    element: Callable[[Array, Array], Array],
    u0: ArrayLike,
    u1: ArrayLike,
    v0: ArrayLike,
    v1: ArrayLike,
    u_breaks: Array = _WHOLE,
    v_breaks: Array = _WHOLE,
) -> Array:
    """The integral of `element` over u0..u1 by v0..v1, for many rectangles; relative 1e-10.

    A rectangle is cut at the breaks it crosses. On each piece 9 x 9 samples are summed by Gauss
    and Legendre's rule, exact up to degree 17, and again with only 7 of the 9 used along u, and
    along v, exact up to degree 7. Where these differ by more than `TOLERANCE` of the area, the
    piece is halved across the worse direction. The first sum is better than they show, by several
    digits. Areas are positive, so the errors add up to no more than that share of the sum.

    Args:
        element: (u, v) of one shape -> area element |du x dv|, of that shape.
        u0: lower ends in u; these four broadcast. A rectangle with swapped ends counts negative.
        u1: upper ends in u.
        v0: lower ends in v.
        v1: upper ends in v.
        u_breaks: rising values of u between which the element is smooth.
        v_breaks: rising values of v, likewise.

    Raises:
        SurfaceError: the element is not finite, or too rough to integrate.

    Example:
        >>> float(rectangle_areas(lambda u, v: np.sin(u), 0.0, np.pi / 2, 0.0, 2.0).round(12))
        2.0
    """
    sides = np.broadcast_arrays(*(np.asarray(side, float) for side in (u0, u1, v0, v1)))
    shape = sides[0].shape
    u0, u1, v0, v1 = (side.reshape(-1) for side in sides)
    sign = np.sign(u1 - u0) * np.sign(v1 - v0)
    low_u, high_u = np.minimum(u0, u1), np.maximum(u0, u1)
    low_v, high_v = np.minimum(v0, v1), np.maximum(v0, v1)
    u_breaks, v_breaks = _open_ended(u_breaks), _open_ended(v_breaks)
    total = np.zeros(len(sign))
    chunk = max(1, _MOST_PIECES // ((len(u_breaks) - 1) * (len(v_breaks) - 1)))
    for first in range(0, len(sign), chunk):
        part = slice(first, first + chunk)
        pieces_u = _clipped(low_u[part], high_u[part], u_breaks)
        pieces_v = _clipped(low_v[part], high_v[part], v_breaks)
        filled = (pieces_u[1] > pieces_u[0])[:, :, None] & (pieces_v[1] > pieces_v[0])[:, None, :]
        owner, i, j = np.nonzero(filled)
        pieces = np.vstack([pieces_u[:, owner, i], pieces_v[:, owner, j]]).T
        total[part] = _integrated(element, pieces, owner, count=len(sign[part]))
    return (sign * total).reshape(shape)


def _open_ended(breaks: Array) -> Array:
    """Breaks from -inf to inf, so that what lies beyond the last one counts too."""
    inner = breaks[np.isfinite(breaks)]
    return np.concatenate([[-np.inf], inner[1:-1], [np.inf]])


def _clipped(low: Array, high: Array, breaks: Array) -> Array:
    """(2, n, spans) ends of low..high within each span of the breaks."""
    begin, end = np.maximum(low[:, None], breaks[:-1]), np.minimum(high[:, None], breaks[1:])
    return np.stack([begin, end])


def _integrated(
    element: Callable[[Array, Array], Array], pieces: Array, owner: Ints, count: int
) -> Array:
    """Sum (count,) of the integrals over `pieces` (n, 4), each added to its owner."""
    done = np.zeros(count)
    for _ in range(_MOST_HALVINGS):
        if not len(pieces):
            return done
        area, error_u, error_v = _ruled(element, pieces)
        total = done + np.bincount(owner, area, count)
        rough = np.maximum(error_u, error_v) > TOLERANCE * area + _ROUNDING * total[owner]
        done += np.bincount(owner[~rough], area[~rough], count)
        pieces = _halved(pieces[rough], (error_u >= error_v)[rough])
        owner = np.tile(owner[rough], 2)
        if len(pieces) > 16 * _MOST_PIECES:
            break
    if len(pieces):
        raise SurfaceError("the area cannot be integrated: the surface is too rough for its knots")
    return done


def _halved(pieces: Array, across_u: Mask) -> Array:
    """Both halves of each rectangle, all lower ones first; cut across u or across v."""
    middle = np.where(across_u, pieces[:, :2].mean(axis=1), pieces[:, 2:].mean(axis=1))
    low, high = pieces.copy(), pieces.copy()
    low[across_u, 1] = high[across_u, 0] = middle[across_u]
    low[~across_u, 3] = high[~across_u, 2] = middle[~across_u]
    return np.concatenate([low, high])


def _fewer(unused: tuple[int, ...]) -> Array:
    """Weights (9,) of a rule without some of the nodes: exact for as many powers as are left."""
    kept = np.delete(np.arange(len(_NODES)), unused)
    powers = np.arange(len(kept))
    moments = np.where(powers % 2 == 0, 2.0 / (powers + 1.0), 0.0)
    weights = np.zeros(len(_NODES))
    weights[kept] = np.linalg.solve(_NODES[kept] ** powers[:, None], moments)
    return weights


_RULES = np.stack([_WEIGHTS, _fewer(unused=(2, 6))])


def _ruled(element: Callable[[Array, Array], Array], pieces: Array) -> tuple[Array, Array, Array]:
    """Of each rectangle (n, 4) the area, and its change with fewer nodes along u, and along v."""
    sums = np.empty((len(pieces), 2, 2))
    step = 1_000_000 // len(_NODES) ** 2
    for first in range(0, len(pieces), step):
        u0, u1, v0, v1 = pieces[first : first + step].T[:, :, None, None]
        half_u, half_v = (u1 - u0) / 2.0, (v1 - v0) / 2.0
        u = u0 + half_u * (1.0 + _NODES[:, None])
        v = v0 + half_v * (1.0 + _NODES[None, :])
        sampled = element(*np.broadcast_arrays(u, v))
        sums[first : first + step] = _RULES @ sampled @ _RULES.T * (half_u * half_v)
    if not np.isfinite(sums).all():
        raise SurfaceError("the area cannot be integrated: the area element is not finite")
    area = sums[:, 0, 0]
    return area, np.abs(sums[:, 1, 0] - area), np.abs(sums[:, 0, 1] - area)
