"""Poses over a surface: which parts of a motion along them have to be right over it as well.

The curves of a toolpath say where it leads. Where they follow a surface, the tool has to be right
over the surface itself; where it is lifted, or beyond the border, it must not go through that. The
height of a point over a surface changes by no more than the point moves; so on a straight line
between two points d apart, with the heights a and b, it is at least (a + b - d) / 2. Between two
configurations the tool point bends off such a line by less, the more they are halved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.faults import MotionFault
from feasibility.certification.stretches import Judge, Samples
from robots.kinematics import Kinematics
from surfaces.surface import Surface

HALVINGS = 30  # to where a motion leaves what it follows
LEVELS = 20  # halvings of what is lifted, until it is clear of the surface
BEYOND, LONG = 2e-3, 0.02  # [m] so close points are looked at, beyond the border and elsewhere
BENT = 1.01  # [1] the way between two points that are so close, compared with the straight line


@dataclass(frozen=True, eq=False, slots=True)
class FollowedPart:
    """A part of a motion that follows a surface."""

    q: Array
    """(k, n) rows, rad or m."""
    row: Ints
    """(k,) the row of the whole motion, or the row before."""
    share: Array
    """(k,) how far on the way to the next one, 0..1."""

    def placed(self, fault: MotionFault) -> MotionFault:
        """A fault of this part as one of the whole motion."""
        last = len(self.row) - 1
        k = min(max(fault.row, 0), last)
        here = self.row[k] + self.share[k]
        there = self.row[min(k + 1, last)] + self.share[min(k + 1, last)]
        at = float(here + fault.share * (there - here))
        row = int(np.floor(at))
        return MotionFault(row, at - row, fault.text)


def followed_parts(
    judge: Judge, followed: Mask, rows: Array, samples: Samples
) -> list[FollowedPart]:
    """The parts of a motion over curves that follow a surface.

    Args:
        judge: of the motion over the poses.
        followed: (M,) which of their curves do.
        rows: (m, n) the motion, rad or m.
        samples: of it, as it passes them, over their places on the curves.
    """
    on = _on(samples.places.chart, followed)
    at = samples.row + samples.share
    turns = np.flatnonzero(on[1:] != on[:-1])
    cuts = _turns(judge, followed, rows, at[turns], at[turns + 1], on[turns])
    parts = []
    for run in np.split(np.arange(len(at)), turns + 1):
        if len(run) and on[run[0]]:
            own = at[run]
            before, after = np.searchsorted(turns, run[0]) - 1, np.searchsorted(turns, run[-1])
            ends = [cuts[k : k + 1] if 0 <= k < len(cuts) else own[:0] for k in (before, after)]
            parts.append(_part(rows, np.unique(np.concatenate([ends[0], own, ends[1]]))))
    return parts


def _on(chart: Ints, followed: Mask) -> Mask:
    """(k,) which places are on curves that follow the surface."""
    return np.asarray((chart >= 0) & followed[np.maximum(chart, 0)])


def _part(rows: Array, at: Array) -> FollowedPart:
    """The configurations of a motion at row numbers with their shares (k,)."""
    row = np.minimum(np.floor(at).astype(np.int64), max(len(rows) - 2, 0))
    share = at - row
    ahead = rows[np.minimum(row + 1, len(rows) - 1)] - rows[row]
    return FollowedPart(rows[row] + share[:, None] * ahead, row, share)


def _turns(
    judge: Judge, followed: Mask, rows: Array, low: Array, high: Array, begins: Mask
) -> Array:
    """(k,) where between `low` and `high` a motion changes what it follows; `begins`: at low."""
    low, high = low.copy(), high.copy()
    for _ in range(HALVINGS if len(low) else 0):
        middle = 0.5 * (low + high)
        part = _part(rows, middle)
        found = judge.sampled(part.row, part.share, part.q)
        same = _on(found.places.chart, followed) == begins
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def off_surface(followed: Mask, samples: Samples) -> tuple[Array, Array]:
    """(k,) from where to where, in rows with their shares, a motion does not follow the surface."""
    off = ~_on(samples.places.chart, followed)
    at = samples.row + samples.share
    some = np.flatnonzero(off[:-1] | off[1:])
    return at[some], at[some + 1]


def lifted_faults(
    surface: Surface | None,
    rows: Array,
    lifted: tuple[Array, Array],
    kinematics: Kinematics,
    tolerance: float,
) -> list[MotionFault]:
    """Where a tool that is lifted, or beyond the border, may be through a surface.

    Args:
        surface: the surface, if there is one.
        rows: (m, n) the motion, rad or m.
        lifted: (k,) from where to where it is, in rows with their shares.
        kinematics: of the arm.
        tolerance: m, how deep the tool may be.
    """
    left, right = lifted
    for _ in range(LEVELS):
        if not len(left) or surface is None:
            return []
        parts = [_part(rows, end) for end in (left, right)]
        points = [kinematics.tools(part.q)[0] for part in parts]
        ends = np.stack([_heights(surface, each) for each in points])
        least = np.nan_to_num(ends, nan=np.inf).min(axis=0)
        if (least < -tolerance).any():
            return [_through(parts[0], least)]
        way = BENT * np.linalg.norm(points[1] - points[0], axis=1)
        both, none = np.isfinite(ends).all(axis=0), np.isnan(ends).all(axis=0)
        bound = np.where(both, 0.5 * (ends.sum(axis=0) - way), least - way)
        open_ = ~(bound >= -tolerance) | (way > np.where(none, BEYOND, LONG))
        middle = 0.5 * (left[open_] + right[open_])
        left, right = np.append(left[open_], middle), np.append(middle, right[open_])
    if not len(left):
        return []
    text = "not certified: the tool may go through the surface where it is lifted"
    return [MotionFault(int(left[0]), float(left[0] % 1.0), text)]


def _through(part: FollowedPart, heights: Array) -> MotionFault:
    """The fault of a tool that goes deepest where it is."""
    worst = int(np.argmin(heights))
    text = (
        f"the tool goes through the surface where it is lifted, by {-1e3 * heights[worst]:.4g} mm"
    )
    return MotionFault(int(part.row[worst]), float(part.share[worst]), text)


def _heights(surface: Surface, points: Array) -> Array:
    """(k,) m, on the tool's side of a surface; NaN beyond its border."""
    from surfaces.meshes.mesh_surface import MeshSurface

    at = surface.closest(points)
    over = at.inside
    if isinstance(surface, MeshSurface):
        over = ~surface.beyond_border(*surface.nearest(points))
    return np.where(over, surface.side_sign * at.height, np.nan)
