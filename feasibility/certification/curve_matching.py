"""Match a motion to the curves between cell centres, from the motion alone, for its replay.

Between two marked waypoints a walk either stays over one cell, or goes to a neighbouring cell along
the curve between the two. Each waypoint in between is matched to the point of that curve that is
nearest to the tool point. Any points would do for a proof; these show the least error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.curve_deviations import curve_deviations
from feasibility.certification.rolls import FrameMatch, MatchedPlaces, match_frames
from feasibility.targets import TargetCurves, target_curves
from feasibility.task import Task
from feasibility.verdict import Walk
from surfaces import Cells

Array = NDArray[np.float64]

GUESSES = 4  # parameters tried first on each piece of a curve
NEWTON_STEPS = 16  # from the best of them, at most
CONVERGED = 1e-7  # [1] of a curve: a step this small is the last
BLOCK = 4096  # waypoints at once, to bound the memory
ARRIVED = 0.02  # [1] share of the tolerance: a tool point this near to a centre is at it
STAYS = -1  # in place of a curve: the walk stays over one cell


@dataclass(frozen=True, eq=False, slots=True)
class CurveMatch:
    """A walk of m waypoints compared with the targets that it follows."""

    error: Array
    """(m,) m, distance of each tool point from its target point."""
    chord: Array
    """(m,) |a - b| of tool axis and approach direction."""
    derivative_bounds: Array
    """(m - 1, 3) largest second derivatives of target point and approach direction along each
    segment, by the segment's own parameter in 0..1; and the curvature of the target surface
    there, 1/m: how fast the direction turns along it."""
    deviations: Array
    """(m - 1, 2) bounds on how far target point and approach direction deviate from those of the
    surface."""
    centre_curvature: float
    """1/m, the same curvature next to the cells' centres."""
    fault: str
    """Why the walk is no motion along curves between neighbouring cells; empty when it is."""
    frames: FrameMatch | None = None
    """What its roll is compared with; None where it is free."""


def match_to_curves(cells: Cells, task: Task, walk: Walk, points: Array, axes: Array) -> CurveMatch:
    """Match each waypoint of a walk to a point of the curves between its cells.

    Args:
        cells: the cells.
        task: standoff.
        walk: the motion, its marks within range.
        points: (m, 3) its tool points, m.
        axes: (m, 3) its approach axes.
    """
    m = len(points)
    segments = np.zeros((max(m - 1, 0), 3))
    unmatched = CurveMatch(np.zeros(m), np.zeros(m), segments, segments[:, :2], 0.0, "")
    if m == 0:
        return unmatched
    marks = np.flatnonzero(walk.cell >= 0)
    if len(marks) == 0 or marks[0] != 0 or marks[-1] != m - 1:
        return replace(unmatched, fault="the motion begins or ends away from every cell's centre")
    start, end = walk.cell[marks[:-1]], walk.cell[marks[1:]]
    curve = _curves(cells, start, end)
    if (curve < STAYS).any():
        k = int(np.flatnonzero(curve < STAYS)[0])
        names = " to ".join(str(list(cells.unravel(int(c)))) for c in (start[k], end[k]))
        return replace(unmatched, fault=f"the motion goes from cell {names}, which do not touch")
    curves = target_curves(cells, task)
    tools = np.hstack([points, axes]) if cells.surface.bare else points
    way = _way(task, curves, walk, tools, marks, curve)
    places, t0, t1 = way.places, *way.ends

    aims = task.targets(cells)
    target, approach = np.empty((m, 3)), np.empty((m, 3))
    target[places.resting] = aims.points[places.cell]
    approach[places.resting] = aims.approaches[places.cell]
    target[places.along], approach[places.along] = _at(curves, places.curve, places.t)

    moves = places.moves
    derivative_bounds, deviations = np.zeros((m - 1, 3)), np.zeros((m - 1, 2))
    derivative_bounds[:, 2] = curves.centre_curvature
    used, which = np.unique(places.way, return_inverse=True)
    derivative_bounds[moves] = _derivative_bounds(curves, places.way, t0[moves], t1[moves])
    found, fault = curve_deviations(cells, task, curves, used)
    deviations[moves] = found[which]
    return CurveMatch(
        error=np.linalg.norm(points - target, axis=1),
        chord=np.linalg.norm(axes - approach, axis=1),
        derivative_bounds=derivative_bounds,
        deviations=deviations,
        centre_curvature=curves.centre_curvature,
        fault=fault,
        frames=match_frames(cells, task, curves, approach, places),
    )


class _Way(NamedTuple):
    """Where the waypoints are, and from where to where on its curve each segment leads."""

    places: MatchedPlaces
    ends: tuple[Array, Array]


def _way(
    task: Task,
    curves: TargetCurves,
    walk: Walk,
    points: Array,
    marks: NDArray[np.int64],
    curve: NDArray[np.int64],
) -> _Way:
    """Match the waypoints between marks to the curve (k - 1,) between each two of the k marks.

    By their tool points (m, 3); between poses by their axes too (m, 6).
    """
    m = len(points)
    start, end = walk.cell[marks[:-1]], walk.cell[marks[1:]]
    # Each segment, and each waypoint between marks, belongs to one section from mark to mark.
    section = np.searchsorted(marks, np.arange(m - 1), side="right") - 1
    backwards = (start > end)[section]
    inner = np.flatnonzero(walk.cell < 0)
    along = inner[curve[section[inner]] != STAYS]
    t, arrived = np.zeros(m), walk.cell >= 0
    matched = _matched_parameters if points.shape[1] == 3 else _matched_between_poses
    t[along], arrived[along] = matched(
        curves, curve[section[along]], points[along], ARRIVED * task.effective_tolerance
    )
    t0, t1 = t[:-1].copy(), t[1:].copy()
    t0[marks[:-1]] = backwards[marks[:-1]]
    t1[marks[1:] - 1] = ~backwards[marks[1:] - 1]
    # A self-motion over one centre, at the end of a curve, does not move along it.
    at_rest = (t0 == t1) & arrived[:-1] & arrived[1:]
    moves = np.flatnonzero((curve[section] != STAYS) & ~at_rest)
    still = inner[curve[section[inner]] == STAYS]
    places = MatchedPlaces(
        resting=np.concatenate([marks, still]),
        cell=np.concatenate([walk.cell[marks], start[section[still]]]),
        along=along,
        curve=curve[section[along]],
        t=t[along],
        moves=moves,
        way=curve[section[moves]],
        ends=np.column_stack([t0, t1])[moves],
    )
    return _Way(places, (t0, t1))


def _curves(cells: Cells, start: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k,) the curve between two cells; STAYS where they are one, less where there is none."""
    pairs, count = cells.pairs, len(cells)
    keys = pairs[:, 0] * count + pairs[:, 1]
    wanted = np.minimum(start, end) * count + np.maximum(start, end)
    row = np.searchsorted(keys, wanted)
    known = row < len(keys)
    known[known] = keys[row[known]] == wanted[known]
    return np.where(start == end, STAYS, np.where(known, row, STAYS - 1))


def _pieces(
    curves: TargetCurves, curve: NDArray[np.int64], t: Array
) -> tuple[NDArray[np.int64], Array, NDArray[np.int64]]:
    """Piece (k,) that t falls into, s (k,) on it, and number of pieces (k,) of the curve."""
    first = curves.first[curve]
    count = curves.first[curve + 1] - first
    along = t * count
    piece = np.minimum(np.maximum(along.astype(np.int64), 0), count - 1)
    return first + piece, along - piece, count


def _at(curves: TargetCurves, curve: NDArray[np.int64], t: Array) -> tuple[Array, Array]:
    """Target points and approach directions (k, 3) at t."""
    values = _values(curves, curve, t, 6)
    return values[:, :3], values[:, 3:]


def _powers(s: Array) -> Array:
    """(k, 4) 1, s, s^2, s^3."""
    powers = np.empty((len(s), 4))
    powers[:, 0], powers[:, 1] = 1.0, s
    powers[:, 2] = square = s * s
    powers[:, 3] = square * s
    return powers


def _matched_parameters(
    curves: TargetCurves, curve: NDArray[np.int64], points: Array, near: float
) -> tuple[Array, NDArray[np.bool_]]:
    """(k,) t on each curve for a tool point, and whether that is at one of its centres.

    A tool point within `near` (m) of a centre may be taken to be there, which costs up to that
    distance; this is done only where the deviation bound of the curve costs more.
    """
    t = _nearest(curves, curve, points)
    arrived = np.zeros(len(curve), dtype=bool)
    pays = curves.deviations[curve, 1] > curves.centre_curvature * near
    where = np.flatnonzero(pays)
    for end in (0.0, 1.0) if len(where) else ():
        centre, _ = _at(curves, curve[where], np.full(len(where), end))
        there = where[np.linalg.norm(points[where] - centre, axis=1) <= near]
        t[there], arrived[there] = end, True
    return t, arrived


def _matched_between_poses(
    curves: TargetCurves, curve: NDArray[np.int64], tools: Array, lean: float
) -> tuple[Array, NDArray[np.bool_]]:
    """(k,) t on each curve for a tool point and its axis (k, 6); none is taken to be at a pose.

    The axis tells places apart where the tool turns on the spot; elsewhere it hardly counts: an
    axis off by 1 as much as a point off by `lean` (m).
    """
    scale = np.array([1.0, 1.0, 1.0, lean, lean, lean])
    t = _nearest(curves._replace(cubics=scale * curves.cubics), curve, scale * tools)
    return t, np.zeros(len(t), dtype=bool)


def _values(curves: TargetCurves, curve: NDArray[np.int64], t: Array, axes: int) -> Array:
    """(k, axes) target points (m) at t, and perhaps directions."""
    piece, s, _ = _pieces(curves, curve, t)
    return np.asarray(np.einsum("kp,kpd->kd", _powers(s), curves.cubics[piece, :, :axes]))


def _places(
    curves: TargetCurves, curve: NDArray[np.int64], t: Array, axes: int
) -> tuple[Array, Array]:
    """`_values` at t, by coordinate (axes, k), and their derivatives by t."""
    piece, s, count = _pieces(curves, curve, t)
    a, b, c, d = curves.cubics.take(piece, axis=0)[:, :, :axes].transpose(1, 2, 0)
    bent, turned = s * d, s * c
    slope = b + turned + turned + 3.0 * s * bent
    return a + s * (b + turned + s * bent), slope * count


def _nearest(curves: TargetCurves, curve: NDArray[np.int64], points: Array) -> Array:
    """(k,) t of the place on each curve that is closest to a tool point (k, 3), or more numbers."""
    axes = points.shape[1]
    t = np.empty(len(curve))
    counts = curves.first[curve + 1] - curves.first[curve]
    for count in np.unique(counts):
        alike = np.flatnonzero(counts == count)
        # Not where two pieces join: a curve may have zero speed there, where Newton's method fails.
        inner = (np.arange(GUESSES * count) + 0.5) / (GUESSES * count)
        grid = np.concatenate([[0.0], inner, [1.0]])
        used, which = np.unique(curve[alike], return_inverse=True)
        along = _values(curves, np.repeat(used, len(grid)), np.tile(grid, len(used)), axes)
        tried = along.reshape(len(used), len(grid), axes)
        for first in range(0, len(alike), BLOCK):
            some = slice(first, first + BLOCK)
            away = tried[which[some]].transpose(2, 0, 1) - points[alike[some]].T[:, :, None]
            t[alike[some]] = grid[np.argmin(_square(away), axis=1)]
    # Newton steps, shortened where one leads further away: they overshoot next to a point where a
    # curve has zero speed.
    left, width = np.arange(len(t)), 1.0 / (GUESSES * counts)
    wanted, here_t, here_curve = points.T, t.copy(), curve
    off, slope = _places(curves, curve, t, axes)
    off -= wanted
    for _ in range(NEWTON_STEPS):
        square = _square(slope)
        step = (off * slope).sum(axis=0)
        step = np.divide(step, square, out=np.zeros(len(left)), where=square > 0.0)
        step = np.minimum(np.maximum(step, -width), width)
        tried_t = np.minimum(np.maximum(here_t - step, 0.0), 1.0)
        there, there_slope = _places(curves, here_curve, tried_t, axes)
        there -= wanted
        nearer = _square(there) < _square(off)
        here_t = np.where(nearer, tried_t, here_t)
        off, slope = np.where(nearer, there, off), np.where(nearer, there_slope, slope)
        t[left] = here_t
        width = np.where(nearer, width, 0.25 * np.abs(step))
        open_ = np.flatnonzero(np.abs(step) > CONVERGED)
        if len(open_) == 0:
            break
        left, here_curve = left[open_], here_curve[open_]
        here_t, width = here_t[open_], width[open_]
        off, slope, wanted = (a[:, open_] for a in (off, slope, wanted))
    return t


def _square(a: Array) -> Array:
    """(...,) sums of squares of (axes, ...); numpy's own sums are slow over three numbers."""
    total = a[0] * a[0]
    for one in a[1:]:
        total += one * one
    return total


def _derivative_bounds(
    curves: TargetCurves, curve: NDArray[np.int64], t0: Array, t1: Array
) -> Array:
    """(k, 3) see `CurveMatch.derivative_bounds`, of segments from t0 to t1 on curves."""
    low, _, _ = _pieces(curves, curve, np.minimum(t0, t1))
    high, _, _ = _pieces(curves, curve, np.maximum(t0, t1))
    known = np.column_stack([curves.derivative_bounds, curves.curvature])
    most = known[low]
    for ahead in range(1, int((high - low).max(initial=0)) + 1):
        piece = np.minimum(low + ahead, high)
        most = np.maximum(most, known[piece])
    with np.errstate(invalid="ignore"):  # a fold, and t0 = t1: NaN, which is refused
        most[:, :2] *= ((t1 - t0) ** 2)[:, None]
    return most
