"""How far the curves between cell centres deviate from the surface itself, for the replay."""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.certification.piecewise_cubics import SAMPLES, samples
from feasibility.targets import TargetCurves, beside_facets
from feasibility.task import Task
from surfaces import Cells

BLOCK = 4096  # curves at once
MOST_PARTS = 400  # of a curve over a mesh, each with these samples


def curve_deviations(
    cells: Cells, task: Task, targets: TargetCurves, used: Ints
) -> tuple[Array, str]:
    """See `_of_some`; some curves at a time, to bound the memory."""
    starts = range(0, max(len(used), 1), BLOCK)
    found = [_of_some(cells, task, targets, used[k : k + BLOCK]) for k in starts]
    faults = [fault for _, fault in found if fault]
    return np.concatenate([deviations for deviations, _ in found]), "".join(faults[:1])


def _of_some(cells: Cells, task: Task, targets: TargetCurves, used: Ints) -> tuple[Array, str]:
    """Bounds on how far the targets of curves deviate from the surface's, and a fault.

    The curves are compared with their closest points on the surface, at samples that their fit did
    not use; the curves' own deviation bounds count where they are larger. On a mesh the samples are
    half a tolerance apart, and the targets are compared with the triangles themselves too, which
    may be nearer to them than the standoff: a thorn beside the curve, another part of the mesh, or
    facets that are not square to the interpolated normal. An approach that is not the normal
    deviates as `targets` say. Between poses there is no surface.
    """
    if cells.surface.bare:
        return targets.deviations[used], ""
    curves, surface = cells.curves, cells.surface
    standoff, tolerance = task.standoff, task.effective_tolerance
    owner, t = _samples(cells, used, 0.5 * tolerance)
    point, normal = curves.at(used[owner], t)
    closest = surface.closest(point)
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    found = np.abs(closest.height), np.linalg.norm(normal - closest.normal, axis=1)
    measured = (
        np.maximum.reduceat(np.column_stack(found), first) if len(first) else np.empty((0, 2))
    )
    deviations = np.maximum(curves.deviations[used], measured)
    if not np.isfinite(deviations).all():
        return deviations, "the curve between two cells is not known"
    if not closest.inside.all():
        return deviations, "the curve between two cells leaves the surface"
    deviations += surface.deviations
    deviations[:, 0] += standoff * deviations[:, 1]
    if surface.mean_edge_length > 0.0:
        places = used[owner], point, normal
        beside = beside_facets(cells, standoff, tolerance, *places, everywhere=True)
        np.maximum.at(deviations[:, 0], owner, beside.off)
        np.maximum.at(deviations[:, 1], owner, beside.leans)
        if not beside.off.max(initial=0.0) <= tolerance:
            away = beside.away.min()
            return deviations, (
                f"between centres the tool point would come within {1e3 * away:.3g} mm of the "
                f"surface, nearer than the standoff of {1e3 * standoff:g} mm: something protrudes "
                "there, or its facets are too coarse for this standoff"
            )
    if not task.along_normals(cells):
        deviations[:, 1] = targets.deviations[used, 1]
    return deviations, ""


def _samples(cells: Cells, used: Ints, apart: float) -> tuple[Ints, Array]:
    """Samples (k,) to compare: which of the used curves, and t on it."""
    curves = cells.curves
    count = curves.first[used + 1] - curves.first[used]
    if cells.surface.mean_edge_length > 0.0:
        ends = cells.centres[cells.pairs[used]]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        fine = np.ceil(length / apart / len(SAMPLES)).astype(np.int64)
        count = np.maximum(count, np.minimum(fine, MOST_PARTS))
    return samples(count)
