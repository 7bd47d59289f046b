"""Match a motion to the curves between cell centres, from the motion alone, for its replay.

Between two marked waypoints a walk either stays over one cell, or goes to a neighbouring cell along
the curve between the two. Each waypoint in between is matched to the point of that curve that is
nearest to the tool point. Any points would do for a proof; these show the least error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.certification.curve_deviations import curve_deviations
from feasibility.certification.piecewise_cubics import PiecewiseCubics
from feasibility.certification.rolls import FrameMatch, MatchedPlaces, match_frames
from feasibility.targets import TargetCurves, target_curves
from feasibility.task import Task
from feasibility.verdict import Walk
from surfaces import Cells

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
    at = PiecewiseCubics(curves.first, curves.cubics).at(places.curve, places.t)
    target[places.along], approach[places.along] = at[:, :3], at[:, 3:]

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
    marks: Ints,
    curve: Ints,
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


def _curves(cells: Cells, start: Ints, end: Ints) -> Ints:
    """(k,) the curve between two cells; STAYS where they are one, less where there is none."""
    pairs, count = cells.pairs, len(cells)
    keys = pairs[:, 0] * count + pairs[:, 1]
    wanted = np.minimum(start, end) * count + np.maximum(start, end)
    row = np.searchsorted(keys, wanted)
    known = row < len(keys)
    known[known] = keys[row[known]] == wanted[known]
    return np.where(start == end, STAYS, np.where(known, row, STAYS - 1))


def _matched_parameters(
    curves: TargetCurves, curve: Ints, points: Array, near: float
) -> tuple[Array, Mask]:
    """(k,) t on each curve for a tool point, and whether that is at one of its centres.

    A tool point within `near` (m) of a centre may be taken to be there, which costs up to that
    distance; this is done only where the deviation bound of the curve costs more.
    """
    targets = PiecewiseCubics(curves.first, curves.cubics[..., :3].copy())
    t = targets.nearest(curve, points)
    arrived = np.zeros(len(curve), dtype=bool)
    pays = curves.deviations[curve, 1] > curves.centre_curvature * near
    where = np.flatnonzero(pays)
    for end in (0.0, 1.0) if len(where) else ():
        centre = targets.at(curve[where], np.full(len(where), end))
        there = where[np.linalg.norm(points[where] - centre, axis=1) <= near]
        t[there], arrived[there] = end, True
    return t, arrived


def _matched_between_poses(
    curves: TargetCurves, curve: Ints, tools: Array, lean: float
) -> tuple[Array, Mask]:
    """(k,) t on each curve for a tool point and its axis (k, 6); none is taken to be at a pose.

    The axis tells places apart where the tool turns on the spot; elsewhere it hardly counts: an
    axis off by 1 as much as a point off by `lean` (m).
    """
    scale = np.array([1.0, 1.0, 1.0, lean, lean, lean])
    t = PiecewiseCubics(curves.first, scale * curves.cubics).nearest(curve, scale * tools)
    return t, np.zeros(len(t), dtype=bool)


def _derivative_bounds(curves: TargetCurves, curve: Ints, t0: Array, t1: Array) -> Array:
    """(k, 3) see `CurveMatch.derivative_bounds`, of segments from t0 to t1 on curves."""
    cubics = PiecewiseCubics(curves.first, curves.cubics)
    low, high = (cubics.pieces(curve, end(t0, t1)).piece for end in (np.minimum, np.maximum))
    known = np.column_stack([curves.derivative_bounds, curves.curvature])
    most = known[low]
    for ahead in range(1, int((high - low).max(initial=0)) + 1):
        piece = np.minimum(low + ahead, high)
        most = np.maximum(most, known[piece])
    with np.errstate(invalid="ignore"):  # a fold, and t0 = t1: NaN, which is refused
        most[:, :2] *= ((t1 - t0) ** 2)[:, None]
    return most
