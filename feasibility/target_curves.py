"""The task applied to cell curves: where tool point and axis have to be between cell centres."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.task import Task
from surfaces import Cells, components

RELIABLE = 0.03  # [1] a curve whose normal deviates no further shows how the surface bends
LATERAL = 1.1  # [1] the normal may turn that much faster between the places looked at
FEW, MANY = 3, 32  # places on a curve over a mesh; and on one over a crease, or off its facets by
OFF = 0.05  # [1] of the tolerance


class TargetCurves(NamedTuple):
    """Target point f + h n and approach direction -+n along the M curves of some cells."""

    first: NDArray[np.int64]
    """(M + 1,) where each curve's pieces begin, and the end of the last."""
    cubics: NDArray[np.float64]
    """(P, 4, 6) coefficients of 1, s, s^2, s^3 of point (m) and direction; s in 0..1."""
    derivative_bounds: NDArray[np.float64]
    """(P, 2) largest second derivatives of both by t in 0..1; inf where the offset folds."""
    curvature: NDArray[np.float64]
    """(P,) 1/m, how fast the direction turns for each metre on the target surface, at most."""
    deviations: NDArray[np.float64]
    """(M, 2) how far target point (m) and direction may be from the surface's own, at most."""
    centre_curvature: float
    """1/m, the largest `curvature` next to the cells' centres."""
    folded: NDArray[np.bool_]
    """(M,) curves where the offset surface folds, see `folded_curves`."""


def folded_curves(cells: Cells, height: float) -> NDArray[np.bool_]:
    """(M,) curves from or to a cell from which some curve runs into a fold of the offset surface.

    At a signed height (m) beyond a radius of curvature the offset surface runs backwards, but in
    the direction of that curvature only; curves across it do not show it, their neighbours do.
    """
    folded = cells.curves.folds(height)
    cell = np.zeros(len(cells), dtype=bool)
    # Those over creases, or with larger deviations, show nothing about their neighbours.
    reliable = ~cells.curves.creased & (cells.curves.deviations[:, 1] <= RELIABLE)
    cell[cells.pairs[folded & reliable]] = True
    return np.asarray(folded | cell[cells.pairs].any(axis=1))


def _see_facets(
    cells: Cells, standoff: float, tolerance: float, deviations: NDArray[np.float64]
) -> None:
    """Raise the deviations (M, 2) of curves over a mesh to those from its triangles."""
    some = np.arange(len(deviations))
    for count in (FEW, MANY):
        t = (np.arange(count) + 0.5) / count
        places = np.repeat(some, count), np.tile(t, len(some))
        found = beside_facets(cells, standoff, tolerance, *places, everywhere=False)
        off = found.off.reshape(-1, count).max(axis=1)
        leans = found.leans.reshape(-1, count).max(axis=1)
        deviations[some] = np.maximum(deviations[some], np.column_stack([off, leans]))
        some = some[(off > OFF * tolerance) | (leans > 0.0) | cells.curves.creased[some]]


class BesideFacets(NamedTuple):
    """How targets at k places on curves lie to the triangles of a mesh themselves."""

    off: NDArray[np.float64]
    """(k,) m, by how much the target's distance from them is not the standoff."""
    leans: NDArray[np.float64]
    """(k,) |n - m| of the curve's normal n and the direction m from the mesh to the target; on
    the strips along creases only, elsewhere normals are interpolated."""
    away: NDArray[np.float64]
    """(k,) m, the target's distance from them."""


def beside_facets(
    cells: Cells,
    standoff: float,
    tolerance: float,
    curves: NDArray[np.int64],
    t: NDArray[np.float64],
    everywhere: bool,
) -> BesideFacets:
    """Compare targets with the triangles of a mesh, without any interpolation.

    On the strip along a crease, and where normals are interpolated, the targets are nearer to the
    mesh than the standoff. So they are where something stands out of it. Nearer to a crease than
    the tolerance leaves over the standoff, the normal is any of those that meet there.

    Args:
        cells: of a mesh.
        standoff: m.
        tolerance: m, of the tool point.
        curves: (k,) which curves.
        t: (k,) places on them.
        everywhere: compare with all of the mesh, which takes long at large standoffs; otherwise
            with the cells of the curve and those that touch both.
    """
    pairs = cells.pairs[curves]
    point, normal = cells.curves.at(curves, t)
    target = point + cells.surface.side_sign * standoff * normal
    away, direction = cells.distances(pairs, target, everywhere)
    leans = np.zeros(len(t))
    off = np.abs(standoff - away) if standoff > 0.0 else leans
    strip = cells.crease_distances(pairs, point, everywhere)
    some = np.isfinite(strip) & (strip >= tolerance - standoff)
    leans[some] = np.linalg.norm(normal[some] - direction[some], axis=1)
    return BesideFacets(off, leans, away)


# Search and replay need the same; cells are values, compared by identity.
@lru_cache(maxsize=4)
def target_curves(cells: Cells, standoff: float, tolerance: float) -> TargetCurves:
    """Offset the curves of `cells` to the tool's side by `standoff` (m).

    Args:
        cells: the cells.
        standoff: m.
        tolerance: m, of the tool point.
    """
    curves, sign = cells.curves, cells.surface.side_sign
    height = sign * standoff
    folded = folded_curves(cells, height)
    cubics = np.empty_like(curves.cubics)
    cubics[..., :3] = curves.cubics[..., :3] + height * curves.cubics[..., 3:]
    cubics[..., 3:] = -sign * curves.cubics[..., 3:]
    derivative_bounds = curves.derivative_bounds.copy()
    derivative_bounds[:, 0] += standoff * derivative_bounds[:, 1]
    derivative_bounds[np.repeat(folded, np.diff(curves.first))] = np.inf
    # To the side of a curve the normal may turn faster than along it.
    max_curvature = cells.parallel_curvature(height)
    if standoff > 0.0:  # over an edge it turns as over a ball of the standoff
        edge = np.where(cells.creased, 1.0 / max(standoff, tolerance), 0.0)
        max_curvature = np.maximum(max_curvature, edge)
    across = max_curvature[cells.pairs].max(axis=1)
    curvature = np.maximum(curves.curvature(height), np.repeat(across, np.diff(curves.first)))
    curvature *= LATERAL
    ends = np.concatenate([curves.first[:-1][~folded], curves.first[1:][~folded] - 1])
    centre_curvature = curvature[ends].max(initial=0.0)
    if len(cells.pairs) == 0:  # a single cell: the normal turns beside its centre too
        centre_curvature = LATERAL * max_curvature[np.isfinite(max_curvature)].max(initial=0.0)
    deviations = curves.deviations.copy()
    deviations[:, 0] += standoff * deviations[:, 1]
    if cells.surface.mean_edge_length > 0.0:
        _see_facets(cells, standoff, tolerance, deviations)
    for array in (cubics, derivative_bounds, curvature, deviations, folded):
        array.flags.writeable = False
    return TargetCurves(
        first=curves.first,
        cubics=cubics,
        derivative_bounds=derivative_bounds,
        curvature=curvature,
        deviations=deviations,
        centre_curvature=float(centre_curvature),
        folded=folded,
    )


def blocked_curves(cells: Cells, task: Task) -> str:
    """Why no motion can be certified between some neighbouring cells; empty where it can."""
    if not task.cone_chord > 0.0:
        return (
            "A cone of 0 degrees leaves a motion no margin between samples, so none can be "
            "certified; allow a small angle."
        )
    tolerance = task.effective_tolerance
    targets = target_curves(cells, task.standoff, tolerance)
    some = f"between {{}} of {len(cells.pairs)} pairs of neighbouring cells"
    curves = cells.curves
    smooth = ~curves.creased & (curves.deviations[:, 1] <= RELIABLE)
    folds = targets.folded & smooth
    cone_chord = task.cone_chord
    rough = (
        (targets.deviations[:, 0] >= tolerance)
        | (targets.deviations[:, 1] >= cone_chord)
        | targets.folded
    )
    parted = _parted(cells, ~rough)
    if folds.any():
        if cells.surface.mean_edge_length > 0.0:  # facets do not tell the two apart
            return (
                "The offset surface folds where it is concave, or the mesh is too coarse where it "
                f"bends, {some.format(int(folds.sum()))}: the standoff is too large for the "
                f"radius of curvature, so no motion can be certified there{parted}; use a smaller "
                "standoff, a mesh that is finer along its bends, or a part of it that ends there."
            )
        return (
            f"The offset surface folds {some.format(int(folds.sum()))}: the standoff reaches "
            "the surface's radius of curvature on its concave side, so no motion can be certified "
            f"there{parted}; use a smaller standoff."
        )
    if rough.any():
        return (
            f"The surface is creased, or rougher than the task allows, "
            f"{some.format(int(rough.sum()))}, so no motion can be certified there (round an edge "
            f"of a mesh it can, but not into a concave one, or past a corner){parted}; use smaller "
            "cells, a finer or smoother mesh, cut it along its creases, or allow a wider cone or a "
            "larger tolerance."
        )
    return ""


def _parted(cells: Cells, usable: NDArray[np.bool_]) -> str:
    """Says so where the usable curves (M,) leave the cells in several parts, whatever the arm."""
    before, parts = (
        int(components(pairs, len(cells)).max(initial=-1)) + 1
        for pairs in (cells.pairs, cells.pairs[usable])
    )
    if parts == before:
        return ""
    return f", which leaves {parts} parts of the surface that no arm's motion joins"
