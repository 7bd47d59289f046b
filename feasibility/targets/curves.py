"""The task applied to cell curves: where the tool has to be between cell centres, and how held."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.task import Task
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface

if TYPE_CHECKING:
    from feasibility.targets.frames import FrameCurves

RELIABLE = 0.03  # [1] a curve whose normal deviates no further shows the curvature of the surface
LATERAL = 1.1  # [1] the normal may turn that much faster between the places looked at
FEW, MANY = 3, 32  # places on a curve over a mesh; and on one over a crease, or off its facets by
OFF = 0.05  # [1] of the tolerance
UNSEEN = 1.25  # [1] a curve may be that much further from the surface between the places looked at


class TargetCurves(NamedTuple):
    """Target point f + h n, approach direction and reference along the M curves of some cells."""

    first: Ints
    """(M + 1,) where each curve's pieces begin, and the end of the last."""
    cubics: Array
    """(P, 4, 6) coefficients of 1, s, s^2, s^3 of point (m) and direction; s in 0..1."""
    derivative_bounds: Array
    """(P, 2) largest second derivatives of both by t in 0..1; inf where the offset folds."""
    curvature: Array
    """(P,) 1/m, how fast the direction turns for each metre on the target surface, at most."""
    deviations: Array
    """(M, 2) how far target point (m) and direction may be from the surface's own, at most."""
    centre_curvature: float
    """1/m, the largest `curvature` next to the cells' centres."""
    folded: Mask
    """(M,) curves where the offset surface folds, see `folded_curves`."""
    frames: FrameCurves | None = None
    """The reference direction of the roll; None where the roll is free."""


def folded_curves(cells: Cells, height: float) -> Mask:
    """(M,) curves from or to a cell from which some curve runs into a fold of the offset surface.

    At a signed height (m) beyond a radius of curvature the offset surface runs backwards, but in
    the direction of that curvature only; curves across it do not show it, their neighbours do.
    """
    if cells.surface.bare:
        return np.zeros(len(cells.curves), dtype=bool)
    folded = cells.curves.folds(height)
    cell = np.zeros(len(cells), dtype=bool)
    # Those over creases, or with larger deviations, show nothing about their neighbours.
    reliable = ~cells.curves.creased & (cells.curves.deviations[:, 1] <= RELIABLE)
    cell[cells.pairs[folded & reliable]] = True
    return np.asarray(folded | cell[cells.pairs].any(axis=1))


def _see_facets(cells: Cells, standoff: float, tolerance: float, deviations: Array) -> None:
    """Raise the deviations (M, 2) of curves over a mesh to those from its triangles.

    On the strip along a crease, and where normals are interpolated, targets are nearer to the
    triangles than the standoff. So they are where something protrudes. On such a strip the
    direction of the tool is compared with the one from the nearest place to the target, too;
    nearer to a crease than the tolerance leaves over the standoff, with none.
    """
    some = np.arange(len(deviations))
    for count in (FEW, MANY):
        t = (np.arange(count) + 0.5) / count
        pairs = np.repeat(cells.pairs[some], count, axis=0)
        point, normal = cells.curves.at(np.repeat(some, count), np.tile(t, len(some)))
        target = point + cells.surface.side_sign * standoff * normal
        away, direction = cells.distances(pairs, target)
        leans = np.zeros(len(point))
        off = np.abs(standoff - away) if standoff > 0.0 else leans
        strip = cells.crease_distances(pairs, point)
        on = np.isfinite(strip) & (strip >= tolerance - standoff)
        leans[on] = np.linalg.norm(normal[on] - direction[on], axis=1)
        off, leans = (each.reshape(-1, count).max(axis=1) for each in (off, leans))
        deviations[some] = np.maximum(deviations[some], np.column_stack([off, leans]))
        some = some[(off > OFF * tolerance) | (leans > 0.0) | cells.curves.creased[some]]


def _see_surface(cells: Cells, height: float, deviations: Array) -> None:
    """Raise the deviations (M, 2) of curves that follow a surface to those from it, as sampled.

    Whether a motion is right over the surface is for the judge to say.
    """
    from surfaces.toolpaths.pose_surface import PoseSurface

    surface = cells.surface
    if not isinstance(surface, PoseSurface) or surface.under is None:
        return
    some = np.flatnonzero(surface.followed)
    if not len(some):
        return
    base, offset = offset_surface(surface.under, 0.0), offset_surface(surface.under, height)
    i, j = cells.pairs[some].T
    ends = cells.centres + height * cells.normals
    for t in (np.arange(FEW) + 0.5) / FEW:
        over, normals = cells.curves.at(some, np.full(len(some), t))
        target, normal, _ = offset.at(base.nearest(over, over, np.inf))
        tool = (1.0 - t) * ends[i] + t * ends[j]
        off = np.linalg.norm(tool - target, axis=1)
        leans = np.linalg.norm(normals - normal, axis=1)
        deviations[some] = np.maximum(deviations[some], UNSEEN * np.column_stack([off, leans]))
    off, lean = surface.under.deviations
    deviations[some] += (off + abs(height) * lean, lean)


def target_curves(cells: Cells, task: Task) -> TargetCurves:
    """Offset the curves of `cells` to the tool's side by the standoff, and direct the tool there.

    Raises:
        ArgumentError: the roll is limited, but neither task nor cells have a reference.
    """
    # Of two tasks that differ in cone or range alone the curves are the same.
    rolls = None if task.roll is None else (-1.0, 1.0)
    aim = Task(
        standoff=task.standoff,
        cone_deg=90.0,
        tolerance=task.effective_tolerance,
        approach=task.approach,
        roll_deg=rolls,
        roll_reference=task.roll_reference if rolls else None,
    )
    return _target_curves(cells, aim)


# Search and replay need the same; cells are values, compared by identity.
@lru_cache(maxsize=4)
def _target_curves(cells: Cells, task: Task) -> TargetCurves:
    """`target_curves` of a task whose cone and range do not matter."""
    sign, standoff, tolerance = cells.surface.side_sign, task.standoff, task.effective_tolerance
    height = sign * standoff
    cells = cells.at_height(height)
    curves = cells.curves
    folded = folded_curves(cells, height)
    cubics = np.empty_like(curves.cubics)
    cubics[..., :3] = curves.cubics[..., :3] + height * curves.cubics[..., 3:]
    cubics[..., 3:] = -sign * curves.cubics[..., 3:]
    derivative_bounds = curves.derivative_bounds.copy()
    derivative_bounds[:, 0] += standoff * derivative_bounds[:, 1]
    deviations = curves.deviations + cells.surface.deviations
    deviations[:, 0] += standoff * deviations[:, 1]
    deviations[:, 1] += curves.leans
    if cells.surface.bare:
        from surfaces.toolpaths.arcs import straight

        cubics[..., :3] = straight(task.targets(cells).points, cells.pairs, curves.first)
        derivative_bounds[:, 0] = deviations[:, 0] = 0.0
        _see_surface(cells, height, deviations)
    if cells.surface.mean_edge_length > 0.0:
        _see_facets(cells, standoff, tolerance, deviations)
    curvature, at_centre = _normal_curvature(cells, standoff, tolerance)
    along_normals = task.along_normals(cells)
    if not along_normals:  # the target stays on the normal, but the tool is held otherwise
        from feasibility.targets.direction_cubics import approach_curves

        others = approach_curves(cells, task)
        cubics[..., 3:] = others.cubics
        derivative_bounds[:, 1] = others.derivative_bounds[:, 1]
        deviations[:, 1] = others.deviations
        curvature, at_centre = np.zeros_like(curvature), 0.0
    derivative_bounds[np.repeat(folded, np.diff(curves.first))] = np.inf
    if len(cells.pairs) and along_normals:
        ends = np.concatenate([curves.first[:-1][~folded], curves.first[1:][~folded] - 1])
        at_centre = float(curvature[ends].max(initial=0.0))
    frames = None
    if task.roll is not None:
        from feasibility.targets.frames import frame_curves

        frames = frame_curves(cells, task, cubics, curvature)
    for array in (cubics, derivative_bounds, curvature, deviations, folded):
        array.flags.writeable = False
    return TargetCurves(
        first=curves.first,
        cubics=cubics,
        derivative_bounds=derivative_bounds,
        curvature=curvature,
        deviations=deviations,
        centre_curvature=at_centre,
        folded=folded,
        frames=frames,
    )


def _normal_curvature(cells: Cells, standoff: float, tolerance: float) -> tuple[Array, float]:
    """(P,) 1/m, how fast the normal turns on the target surface, at most; and beside any centre.

    To the side of a curve the normal may turn faster than along it.
    """
    if cells.surface.bare:
        return np.zeros(len(cells.curves.cubics)), 0.0
    height = cells.surface.side_sign * standoff
    most = cells.parallel_curvature(height)
    if standoff > 0.0:  # over an edge it turns as over a ball of the standoff
        edge = np.where(cells.creased, 1.0 / max(standoff, tolerance), 0.0)
        most = np.maximum(most, edge)
    across = most[cells.pairs].max(axis=1)
    curves = cells.curves
    curvature = np.maximum(curves.curvature(height), np.repeat(across, np.diff(curves.first)))
    # Of a single cell, which has no curves, the second counts.
    return LATERAL * curvature, float(LATERAL * most[np.isfinite(most)].max(initial=0.0))
