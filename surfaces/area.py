"""Area of parameter rectangles of any smooth patch: Gauss-Legendre, halved until it is exact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.surface import SurfaceError

Array = NDArray[np.float64]

TOLERANCE = 1e-11  # of a piece's area: the two rules differ by no more
_ROUNDING = 1e-15  # of the whole rectangle's, likewise
_COARSE, _FINE = (np.polynomial.legendre.leggauss(count) for count in (5, 7))
_MOST_HALVINGS = 14
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

    A rectangle is cut at the breaks it crosses. A piece is done when the rules of 5 x 5 and of
    7 x 7 nodes differ by `TOLERANCE` of its area, and quartered until it is; the finer rule's
    value is taken, which is better by several digits. Areas are positive, so the errors add up to
    no more than that share of the whole.

    Args:
        element: (u, v) of one shape -> area element |du x dv|, of that shape.
        u0: lower ends in u; these four broadcast. A rectangle the wrong way round counts negative.
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
    return np.stack([
        np.maximum(low[:, None], breaks[:-1]),
        np.minimum(high[:, None], breaks[1:]),
    ])  # fmt: skip


def _integrated(
    element: Callable[[Array, Array], Array], pieces: Array, owner: NDArray[np.int64], count: int
) -> Array:
    """Sum (count,) of the integrals over `pieces` (n, 4), each added to its owner."""
    done = np.zeros(count)
    for _ in range(_MOST_HALVINGS):
        if not len(pieces):
            return done
        coarse, fine = (_ruled(element, pieces, *rule) for rule in (_COARSE, _FINE))
        whole = done + np.bincount(owner, fine, count)
        settled = np.abs(fine - coarse) <= TOLERANCE * fine + _ROUNDING * whole[owner]
        done += np.bincount(owner[settled], fine[settled], count)
        pieces = _quartered(pieces[~settled]).reshape(-1, 4)
        owner = np.repeat(owner[~settled], 4)
        if len(pieces) > 16 * _MOST_PIECES:
            break
    if len(pieces):
        raise SurfaceError("the area cannot be integrated: the surface is too rough for its knots")
    return done


def _quartered(pieces: Array) -> Array:
    """(n, 4, 4) the four quarters of each rectangle."""
    u0, u1, v0, v1 = pieces.T
    u, v = (u0 + u1) / 2.0, (v0 + v1) / 2.0
    return np.stack(
        [
            np.stack([a, b, c, d], axis=1)
            for a, b in ((u0, u), (u, u1))
            for c, d in ((v0, v), (v, v1))
        ],
        axis=1,
    )


def _ruled(
    element: Callable[[Array, Array], Array], pieces: Array, nodes: Array, weights: Array
) -> Array:
    """Gauss and Legendre's rule over each rectangle (n, 4)."""
    values = np.empty(len(pieces))
    step = 1_000_000 // len(nodes) ** 2
    for first in range(0, len(pieces), step):
        u0, u1, v0, v1 = pieces[first : first + step].T[:, :, None, None]
        half_u, half_v = (u1 - u0) / 2.0, (v1 - v0) / 2.0
        u = u0 + half_u * (1.0 + nodes[:, None])
        v = v0 + half_v * (1.0 + nodes[None, :])
        u, v = np.broadcast_arrays(u, v)
        sampled = np.einsum("nij,i,j->n", element(u, v), weights, weights)
        values[first : first + step] = sampled * half_u[:, 0, 0] * half_v[:, 0, 0]
    if not np.isfinite(values).all():
        raise SurfaceError("the area cannot be integrated: the area element is not finite")
    return values
