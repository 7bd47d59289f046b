"""The fastest speeds along a curve: reachability analysis, as in TOPP-RA.

With x = (ds/dt)^2 at the places of a grid and x running straight in between, what limits allow on
a piece is |c x + d y| <= 1, row by row, for x at its beginning and y at its end. These sets are
convex and hold (0, 0), so from the last place, at rest, backwards the values of x from which rest
can be reached are 0 .. K, with K the largest x for which there is a y in 0 .. K' of the next place
(a linear program in two variables); and forwards, from rest, the largest y is the fastest.

For the largest x let lower(x) and upper(x) be the bounds on y. Their gap is concave, so where it is
negative, the lines that bound y there cross at an x which is not smaller than the largest: one goes
there, and on until there is a gap. As no line is met twice, that ends.

H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE Transactions on Robotics 34 (2018).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.kernels import entry, kernel

CROSSINGS = 100  # per place; with what is left over then, the speed is 0 there
ROUNDING = 1e-12  # [1]
LEAST_SHARE = 1e-13  # [1] of c, below which d is nothing


class Rows(NamedTuple):
    """Limits |c x + d y| <= l of each piece, made ready for any l > 0."""

    lean: Array
    """(m - 1, r) c / d; 0 where d is nothing."""
    margin: Array
    """(m - 1, r) 1 / |d|; inf there."""
    alone: Array | None
    """(m - 1, r) 1 / |c| there and inf elsewhere; None where d is something everywhere."""

    @staticmethod
    def of(c: Array, d: Array) -> Rows:
        """From c and d (m - 1, r)."""
        alone = np.abs(d) <= LEAST_SHARE * np.abs(c)
        with np.errstate(divide="ignore", invalid="ignore"):
            margin = np.where(alone, np.inf, 1.0 / np.abs(d))
            lean = np.where(alone, 0.0, c / d)
            by_itself = np.where(alone, 1.0 / np.abs(c), np.inf) if alone.any() else None
        return Rows(lean, margin, by_itself)


def fastest_speeds(most: Array, rows: Rows, limits: Array | float = 1.0) -> Array:
    """(m,) the largest x from rest to rest; see the module.

    It is at most `most` (m,); of the rows of each piece `limits` are l (m - 1, r), or a number.

    Example:
        >>> rows = Rows.of(np.full((4, 1), -0.5), np.full((4, 1), 0.5))
        >>> fastest_speeds(np.full(5, 9.0), rows).round(9).tolist()
        [0.0, 2.0, 4.0, 2.0, 0.0]
    """
    # y is between -margin - lean x and margin - lean x.
    x = np.append(most[:-1], 0.0)
    if rows.alone is not None:
        x[:-1] = np.minimum(x[:-1], (rows.alone * limits).min(axis=1))
    _run_through(x, rows.margin * limits, rows.lean)
    return x


@entry
def _run_through(x, margin, lean):  # type: ignore[no-untyped-def]
    """Set x (m,), upper bounds before, to the largest values; by two passes."""
    for i in range(x.shape[0] - 2, -1, -1):
        x[i] = _largest_start(x[i], x[i + 1], margin[i], lean[i])
    x[0] = 0.0
    for i in range(x.shape[0] - 1):
        y = x[i + 1]
        for j in range(margin.shape[1]):
            y = min(y, margin[i, j] - lean[i, j] * x[i])
        x[i + 1] = max(y, 0.0)


@kernel
def _largest_start(x, end, margin, lean):  # type: ignore[no-untyped-def]
    """The largest x, at most the one given, that leads to some y in 0 .. end."""
    for _ in range(CROSSINGS):
        upper, upper_margin, upper_lean = end, end, 0.0
        lower, lower_margin, lower_lean = 0.0, 0.0, 0.0
        for j in range(margin.shape[0]):
            at = lean[j] * x
            if margin[j] - at < upper:
                upper, upper_margin, upper_lean = margin[j] - at, margin[j], lean[j]
            if -margin[j] - at > lower:
                lower, lower_margin, lower_lean = -margin[j] - at, margin[j], lean[j]
        if lower <= upper:
            return x
        crossing = (upper_margin + lower_margin) / (upper_lean - lower_lean)
        if not crossing < x * (1.0 - ROUNDING):
            return x * (1.0 - ROUNDING)
        x = crossing
    return 0.0
