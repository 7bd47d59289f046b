"""Curves between cell centres that no motion can be certified along, whatever the arm: in words."""

from dataclasses import replace

from coverable.arrays import Mask
from feasibility.clock import Clock
from feasibility.targets.curves import RELIABLE, target_curves
from feasibility.task import Task
from surfaces.adjacency import components
from surfaces.cells import Cells
from surfaces.surface import SurfaceError

GROWTH = 2.0**0.5  # from one length of smoothing that is tried to the next
MOST_LENGTHS = 10
MOST_OFF = 0.25  # [1] of the standoff: a copy further off the surface is not offered
OPEN = 0.25  # [1] of its area that no face of the offset surface may fall below


def blocked_curves(cells: Cells, task: Task) -> str:
    """Why no motion can be certified between some neighbouring cells; empty where it can."""
    if not task.cone_chord > 0.0:
        return (
            "A cone of 0 degrees leaves a motion no margin between samples, so none can be "
            "certified; allow a small angle."
        )
    tolerance = task.effective_tolerance
    targets = target_curves(cells, task)
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
            f"of a mesh it can, but not past a corner, nor into a concave one){parted}; use "
            "smaller cells, a finer or smoother mesh, patches joined as a piecewise surface, which "
            "can be followed into a concave edge, or allow a wider cone or a larger tolerance."
        )
    leans = cells.at_height(cells.surface.side_sign * task.standoff).curves.leans
    if leans.any():
        return (
            f"Pieces meet in an inner crease {some.format(int((leans > 0.0).sum()))}, where only "
            "motions are tried along which the tool turns on the spot, so one may have been "
            "missed; allow a wider cone."
        )
    return ""


def smoothing_offer(cells: Cells, task: Task, clock: Clock) -> str:
    """Over which length a mesh has to be smoothed so that nothing is blocked; empty for none.

    Lengths are tried one after the other, which takes seconds, for as long as there is time.
    """
    from surfaces.meshes.mesh_surface import MeshSurface
    from surfaces.meshes.smoothing import smoothed

    surface = cells.surface
    if not isinstance(surface, MeshSurface):
        return ""
    height, tolerance = surface.side_sign * task.standoff, task.effective_tolerance
    shortest = max(task.standoff, surface.mean_edge_length, 1.5 * (task.smooth or 0.0))
    longest = float(surface.mesh.extent.max())
    for length in (shortest * GROWTH**k for k in range(MOST_LENGTHS)):
        length = float(f"{length:.2g}")
        if length > longest or clock.out_of_time:
            break
        clock.report(0, None, f"smoothing the mesh over {length:g} m")
        try:
            copy = smoothed(surface, length, tolerance)
            made = copy.smoothing
            if made is None or made.off > max(tolerance, MOST_OFF * task.standoff):
                break
            if copy.least_area(height) < OPEN:
                continue
            smoother = copy.cells(count=len(cells))
        except SurfaceError:
            continue
        if not blocked_curves(smoother, replace(task, smooth=length)):
            return f"With task.smooth = {length:g} it can be tried: {made.words()}."
    return ""


def _parted(cells: Cells, usable: Mask) -> str:
    """Says so where the usable curves (M,) leave the cells in several parts, whatever the arm."""
    before, parts = (
        int(components(pairs, len(cells)).max(initial=-1)) + 1
        for pairs in (cells.pairs, cells.pairs[usable])
    )
    if parts == before:
        return ""
    return f", which leaves {parts} parts of the surface that no arm's motion joins"
