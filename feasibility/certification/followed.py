"""Poses over a surface: which parts of a motion along them have to be right over it as well.

The curves of a toolpath say where it leads. Where they follow a surface, the tool has to be right
over the surface itself; where it is lifted, or beyond the border, it must not go through that. The
height of a point over a surface changes by no more than the point moves; so on a straight line
between two points d apart, with the heights a and b, it is at least (a + b - d) / 2. Between two
configurations the tool point bends off such a line by less, the more they are halved.

`on_the_way` is of motions from cell to cell of one patch. Where the offset surface folds, by less
than the tolerance, the places nearest to a tool jump, and the tool need not be right over any of
both for long; over the places on the straight way from centre to centre, passed in order while the
tool goes along, it may be right all along.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import runs
from feasibility.certification.faults import MotionFault
from feasibility.certification.stretches import Judge, SampledStretches, Samples, configurations
from robots.kinematics import Kinematics
from surfaces.places.patch_places import PatchPlaces
from surfaces.places.places import Places
from surfaces.surface import Surface

HALVINGS = 30  # to where a motion leaves what it follows
LEVELS = 20  # halvings of what is lifted, until it is clear of the surface
BEYOND, LONG = 2e-3, 0.02  # [m] so close points are looked at, beyond the border and elsewhere
STEPS, PARTS = 256, 8  # of the way from centre to centre, of a motion from row to row
STEEP = 8  # power of what a place costs, so that the worst counts most
LONGEST = 500  # rows from mark to mark that are looked at so
BENT = 1.01  # [1] the way between two points that are so close, compared with the straight line


def rows_and_shares(at: Array) -> tuple[Ints, Array]:
    """Of row numbers with their shares (k,)."""
    row = at.astype(np.int64)
    return row, at - row


def followed_parts(
    judge: Judge, followed: Mask, samples: Samples
) -> tuple[list[Array], tuple[Array, Array]]:
    """The parts of a motion over curves (M,) between poses that follow a surface.

    Each by the row numbers, with their shares, at which it is known; and (k,) from where to where
    it does not follow the surface. The samples are of the motion, as it passes them, over their
    places on the curves.
    """
    on = _on(samples.places.chart, followed)
    at = samples.row + samples.share
    off = np.flatnonzero(~(on[:-1] & on[1:]))
    turns = np.flatnonzero(on[1:] != on[:-1])
    cuts = _turns(judge, followed, at[turns], at[turns + 1], on[turns])
    ends, on = np.insert(at, turns + 1, cuts), np.insert(on, turns + 1, values=True)
    return [np.unique(ends[run]) for run in runs(on)], (at[off], at[off + 1])


def _on(chart: Ints, followed: Mask) -> Mask:
    """(k,) which places are on curves that follow the surface."""
    return np.asarray((chart >= 0) & followed[np.maximum(chart, 0)])


def _turns(judge: Judge, followed: Mask, low: Array, high: Array, begins: Mask) -> Array:
    """(k,) where between `low` and `high` a motion changes what it follows; `begins`: at low."""
    low, high = low.copy(), high.copy()
    for _ in range(HALVINGS if len(low) else 0):
        middle = 0.5 * (low + high)
        found = judge.sampled(*rows_and_shares(middle))
        same = _on(found.places.chart, followed) == begins
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


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
        rows: (m, n) the motion of the arm of `kinematics`, rad or m.
        lifted: (k,) from where to where it is, in rows with their shares.
        tolerance: m, how deep the tool may be.
    """
    left, right = lifted
    for _ in range(LEVELS):
        if not len(left) or surface is None:
            return []
        at = [rows_and_shares(end) for end in (left, right)]
        points = [kinematics.tools(configurations(rows, *end))[0] for end in at]
        ends = np.stack([_heights(surface, each) for each in points])
        least = np.nan_to_num(ends, nan=np.inf).min(axis=0)
        if (least < -tolerance).any():
            (row, share), k = at[0], int(np.argmin(least))
            by = f"by {-1e3 * least[k]:.4g} mm"
            text = f"the tool goes through the surface where it is lifted, {by}"
            return [MotionFault(text, int(row[k]), float(share[k]))]
        way = BENT * np.linalg.norm(points[1] - points[0], axis=1)
        both, none = np.isfinite(ends).all(axis=0), np.isnan(ends).all(axis=0)
        bound = np.where(both, 0.5 * (ends.sum(axis=0) - way), least - way)
        open_ = ~(bound >= -tolerance) | (way > np.where(none, BEYOND, LONG))
        middle = 0.5 * (left[open_] + right[open_])
        left, right = np.append(left[open_], middle), np.append(middle, right[open_])
    if not len(left):
        return []
    text = "not certified: the tool may go through the surface where it is lifted"
    return [MotionFault(text, int(left[0]), float(left[0] % 1.0))]


def _heights(surface: Surface, points: Array) -> Array:
    """(k,) m, on the tool's side of a surface; NaN beyond its border."""
    from surfaces.meshes.mesh_surface import MeshSurface

    at = surface.closest(points)
    over = at.inside
    if isinstance(surface, MeshSurface):
        over = ~surface.beyond_border(*surface.nearest(points))
    return np.where(over, surface.side_sign * at.height, np.nan)


def on_the_way(
    judge: Judge,
    marks: Ints,
    at_rows: Samples,
    of_segment: Array,
    doubtful: Ints,
    decided: Callable[[SampledStretches], Mask],
) -> tuple[Mask, list[Samples]]:
    """Judge parts of a motion from mark to mark over straight ways between their places.

    Any places would do for `Judge.bounds`; these pass in order.

    Args:
        judge: of the motion, with its marks (m,).
        at_rows: samples at all rows, as the rest has them.
        of_segment: (m - 1, 3) see `SampledStretches`.
        doubtful: (k,) rows at which, or behind which, something is wrong or open.
        decided: (k,) which stretches bounds show to be right; see `bisected`.

    Returns:
        (m,) behind which rows the motion is right so, and at the last, if it is behind the one
        before; and the samples there. Nothing, unless all that is doubtful is right.
    """
    good, nothing, found = *np.zeros((2, len(marks)), dtype=bool), list[Samples]()
    runs = list(itertools.pairwise(np.flatnonzero(marks >= 0).tolist()))
    wanted = [((doubtful >= run[0]) & (doubtful <= run[1])).any() for run in runs]
    for k in np.flatnonzero(wanted).tolist():
        first, last = runs[k]
        if last - first > LONGEST or not isinstance(judge.offset, PatchPlaces):
            return nothing, []
        ends = judge.offset.closest(judge.cells.centres[marks[[first, last]]])
        at = _in_order(judge, judge.offset, ends, np.arange(first, last))
        found.append(at)
        if first > 0 and not (k and wanted[k - 1]):
            at = Samples.join(at_rows.of(np.array([first])), at)
        if last < len(marks) - 1 and not (k + 1 < len(runs) and wanted[k + 1]):
            at = Samples.join(at, at_rows.of(np.array([last])))
        start, end = at.of(slice(-1)), at.of(slice(1, None))
        row = np.minimum(start.row, len(marks) - 2)
        low, high = (each.share + (each.row - row) for each in (start, end))
        stretches = SampledStretches(row, low, high, start, end, of_segment[row])
        if not (judge.within(at).all() and decided(stretches).all()):
            return nothing, []
        good[first:last] = True
    good[-1] = good[-2]
    return good, found


def _in_order(judge: Judge, patch: PatchPlaces, ends: Places, numbers: Ints) -> Samples:
    """The motion behind rows (k,) over places on the straight way between two of them.

    Both go on by turns, as keeps them near to each other.
    """
    share = np.linspace(0.0, 1.0, STEPS + 1)
    first, last = (ends.of(np.full(len(share), k)) for k in (0, 1))
    way = patch.between(first, last, share)
    row = np.append(np.repeat(numbers, PARTS), numbers[-1])
    parts = np.append(np.tile(np.arange(PARTS) / PARTS, len(numbers)), 1.0)
    at = judge.sampled(row, parts)
    target, approaches, _ = judge.targets(way)
    off = np.linalg.norm(at.points[:, None] - target, axis=2) / judge.task.effective_tolerance
    chord = max(judge.task.cone_chord, 1e-9)
    lean = np.linalg.norm(at.axes[:, None] - approaches, axis=2) / chord
    k, m = _by_turns(np.minimum(np.maximum(off, lean), 10.0) ** STEEP)
    at = at.of(k)
    return judge.over(way.of(m), at.row, at.share, at.points, at.axes, at.x)


def _by_turns(costs: Array) -> tuple[Ints, Ints]:
    """Numbers k and m that rise from the first to the last of costs (K, M), with the least sum."""
    least = costs.cumsum(axis=1)
    for k in range(1, len(costs)):
        before = np.minimum(least[k - 1], np.append(np.inf, least[k - 1, :-1])).tolist()
        own = np.inf
        for m, cost in enumerate(costs[k].tolist()):
            least[k, m] = own = cost + min(before[m], own)
    k, m = len(costs) - 1, costs.shape[1] - 1
    found = [(k, m)]
    while k or m:
        choices = [(k - 1, m - 1), (k - 1, m), (k, m - 1)]
        k, m = min((one for one in choices if min(one) >= 0), key=lambda one: least[one])
        found.append((k, m))
    numbers = np.array(found[::-1])
    return numbers[:, 0], numbers[:, 1]
