"""The reference direction of the roll along cell curves, with bounds on how fast it turns."""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.roll import ALONG, projected
from feasibility.targets.direction_cubics import DirectionCurves, fitted
from feasibility.targets.references import on_patches, reference_directions
from feasibility.task import Task
from surfaces.cells import Cells
from surfaces.patches.patch import Patch
from surfaces.surface import max_principal_curvature

PLACES = (0.0, 0.5, 1.0)  # along a piece, where the frame's turning to the side is measured
STEP = 1e-4  # [1] of a range of parameters: of differences
SIDEWAYS = 1.1  # [1] frames may turn that much faster between the places looked at


class FrameCurves(NamedTuple):
    """Reference direction t along the M curves of some cells, on the pieces of `TargetCurves`."""

    cubics: Array
    """(P, 4, 3) coefficients of 1, s, s^2, s^3 of t, square to b and of length 1 but for
    `deviations`; s in 0..1."""
    derivative_bounds: Array
    """(P, 2) the largest |t'| and |t''| by t in 0..1 of all the curve, as those of
    `TargetCurves`; inf where nothing is known, next to where the reference is along b."""
    deviations: Array
    """(M,) how far t may be from the surface's own, at most."""
    curvature: Array
    """(P,) 1/m, how fast the frame of b and t turns for each metre to any side on the target
    surface, at most: kappa_t. With a fixed reference whose angle to b has the sine h it is that of
    b over h. 0 between poses, which have no surface beside them."""
    centre_curvature: float
    """1/m, the largest `curvature` next to the cells' centres."""


def frame_curves(cells: Cells, task: Task, targets: Array, curvature: Array) -> FrameCurves:
    """Fit t to the reference's part square to b.

    Args:
        cells: the cells.
        task: its roll is limited.
        targets: (P, 4, 6) cubics of target point and approach direction.
        curvature: (P,) 1/m, how fast b turns on the target surface, at most.
    """
    first = cells.curves.first
    counts = np.diff(first)
    least = np.ones(len(counts))

    def direction(curves: Ints, t: Array) -> Array:
        approach = _approaches(targets, first, curves, t)
        found, sine = projected(reference_directions(cells, task, curves, t), approach)
        np.minimum.at(least, curves, np.where(sine >= ALONG, sine, 0.0))
        return found

    references = task.targets(cells).references
    if references is None:
        raise ValueError("the roll is free, so there is no frame to follow")
    made = fitted(cells, direction, references[cells.pairs])
    lost = least == 0.0
    made.deviations[lost] = np.inf
    made.derivative_bounds[np.repeat(lost, counts)] = np.inf
    frame_curvature = _curvature(cells, task, curvature, np.repeat(least, counts), made)
    ends = np.concatenate([first[:-1], first[1:] - 1])
    near = frame_curvature[ends]
    for array in (*made, frame_curvature):
        array.flags.writeable = False
    return FrameCurves(*made, frame_curvature, float(near[np.isfinite(near)].max(initial=0.0)))


def _approaches(targets: Array, first: Ints, curves: Ints, t: Array) -> Array:
    """(k, 3) values of the cubics of b at t of some curves."""
    count = np.diff(first)[curves]
    piece = np.clip(np.floor(t * count), 0, count - 1).astype(np.int64)
    powers = np.vander(t * count - piece, 4, increasing=True)
    return np.asarray(np.einsum("kp,kpd->kd", powers, targets[first[curves] + piece, :, 3:]))


def _curvature(
    cells: Cells, task: Task, curvature: Array, least: Array, made: DirectionCurves
) -> Array:
    """(P,) see `FrameCurves.curvature`; `least` (P,) is the sine of the reference's angle to b."""
    from surfaces.piecewise.piecewise_surface import Piecewise

    if task.fixed_reference(cells) is not None:
        return np.divide(curvature, least, out=np.full(len(least), np.inf), where=least > 0.0)
    if not isinstance(cells.surface, (Patch, Piecewise)):
        return np.zeros(len(curvature))
    return np.maximum(_sideways(cells, task), curvature)


def _sideways(cells: Cells, task: Task) -> Array:
    """(P,) 1/m, how fast the u direction turns over the target surface, at most, by differences."""
    curves, surface = cells.curves, cells.surface
    height = surface.side_sign * task.standoff
    fixed = task.fixed_approach(cells)
    counts = np.diff(curves.first)
    owner = np.repeat(np.arange(len(counts)), counts)
    piece = np.arange(len(owner)) - curves.first[:-1][owner]
    fastest = np.zeros(len(owner))
    for place in PLACES:
        points, _ = curves.at(owner, (piece + place) / counts[owner])
        for rows, patch, u, v in on_patches(surface, points):
            steps, turns = np.empty((2, len(rows), 2, 3))
            for axis, limits in enumerate((patch.u_range, patch.v_range)):
                step = STEP * (limits[1] - limits[0])
                ends = []
                for sign in (-1.0, 1.0):
                    x = [u, v]
                    x[axis] = np.clip(x[axis] + sign * step, *limits)
                    normal = patch.normal(*x)
                    b = normal if fixed is None else fixed
                    ends.append(
                        (patch.point(*x) + height * normal, projected(patch.tangent(*x), b)[0])
                    )
                steps[:, axis], turns[:, axis] = (b - a for a, b in zip(*ends, strict=True))
            found = max_principal_curvature(steps, turns)
            fastest[rows] = np.maximum(fastest[rows], np.where(np.isnan(found), np.inf, found))
    return SIDEWAYS * fastest
