"""The frames that a walk's roll is compared with: reference directions along the matched curves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.certification.piecewise_cubics import PiecewiseCubics, samples
from feasibility.roll import projected
from feasibility.targets import FrameCurves, TargetCurves, reference_directions
from feasibility.task import Task
from surfaces import Cells


class MatchedPlaces(NamedTuple):
    """Where the m waypoints of a walk, and the m - 1 segments between them, are."""

    resting: Ints
    """(i,) waypoints over a cell's centre."""
    cell: Ints
    """(i,) which cell."""
    along: Ints
    """(j,) waypoints along a curve."""
    curve: Ints
    """(j,) which curve."""
    t: Array
    """(j,) where on it."""
    moves: Ints
    """(k,) segments along a curve."""
    way: Ints
    """(k,) which curve."""
    ends: Array
    """(k, 2) from where on it to where."""


class FrameMatch(NamedTuple):
    """Approach and reference directions of m waypoints, with bounds between them."""

    approaches: Array
    """(m, 3) b."""
    references: Array
    """(m, 3) t."""
    derivative_bounds: Array
    """(m - 1, 2) the largest |t'| and |t''| along each segment, by its own parameter in 0..1."""
    deviations: Array
    """(m - 1,) bounds on how far t deviates from the surface's own."""


def match_frames(
    cells: Cells, task: Task, curves: TargetCurves, approaches: Array, places: MatchedPlaces
) -> FrameMatch | None:
    """The frames of a walk; None where the roll is free.

    Args:
        cells: the cells.
        task: the task.
        curves: its targets along the curves between cells.
        approaches: (m, 3) those of the waypoints.
        places: of its waypoints and segments.
    """
    frames, centres = curves.frames, task.targets(cells).references
    if frames is None or centres is None:
        return None
    references = np.empty_like(approaches)
    references[places.resting] = centres[places.cell]
    fitted = PiecewiseCubics(curves.first, frames.cubics)
    references[places.along] = fitted.at(places.curve, places.t)
    segments = len(approaches) - 1
    bounds, deviations = np.zeros((segments, 2)), np.zeros(segments)
    used, which = np.unique(places.way, return_inverse=True)
    bounds[places.moves] = _bounds(curves.first, frames, places.way, places.ends)
    deviations[places.moves] = _deviations(cells, task, curves, frames, used)[which]
    return FrameMatch(approaches, references, bounds, deviations)


def _bounds(first: Ints, frames: FrameCurves, curve: Ints, ends: Array) -> Array:
    """(k, 2) see `FrameMatch.derivative_bounds`, of segments between two t on curves."""
    # Of the whole curve: pieces differ little, and a segment may reach over several.
    whole = np.maximum.reduceat(frames.derivative_bounds, first[:-1]) if len(first) > 1 else None
    if whole is None:
        return np.zeros((len(curve), 2))
    width = np.abs(np.diff(ends, axis=1))
    with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
        return np.asarray(whole[curve] * np.hstack([width, width**2]))


def _deviations(
    cells: Cells, task: Task, curves: TargetCurves, frames: FrameCurves, used: Ints
) -> Array:
    """(k,) how far t on some curves is from the surface's own: at samples that no fit has used."""
    owner, t = samples(np.diff(curves.first)[used])
    deviations = frames.deviations[used].copy()
    approach = PiecewiseCubics(curves.first, curves.cubics[..., 3:]).at(used[owner], t)
    if task.along_normals(cells) and not cells.surface.bare:
        closest = cells.surface.closest(cells.curves.at(used[owner], t)[0])
        approach = -cells.surface.side_sign * closest.normal
    own, _ = projected(reference_directions(cells, task, used[owner], t), approach)
    fitted = PiecewiseCubics(curves.first, frames.cubics).at(used[owner], t)
    off = np.linalg.norm(fitted - own, axis=1)
    np.maximum.at(deviations, owner, np.where(np.isnan(off), np.inf, off))
    return deviations
