"""The task applied to courses: where tool point and axis have to be between cell centres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces import Cells

ASIDE = 1.1  # [1] the normal may turn that much faster across the courses than along them


class TargetCourses(NamedTuple):
    """Target point f + h n and approach direction -+n along the M courses of some cells."""

    first: NDArray[np.int64]
    """(M + 1,) where each course's pieces begin, and the end of the last."""
    cubics: NDArray[np.float64]
    """(P, 4, 6) coefficients of 1, s, s^2, s^3 of point (m) and direction; s in 0..1."""
    bends: NDArray[np.float64]
    """(P, 2) largest second derivatives of both by t in 0..1; inf where the offset folds."""
    stray_point: float
    """m, how far a target point may be from the target surface, at most."""
    stray_approach: float
    """How far an approach direction may be from the surface's own, at most."""
    turning: float
    """1/m, how fast the direction turns for each metre on the target surface, at most."""
    folded: NDArray[np.bool_]
    """(M,) courses where the offset surface folds, see `folded_courses`."""


def folded_courses(cells: Cells, height: float) -> NDArray[np.bool_]:
    """(M,) courses from or to a cell from which some course runs into a fold of the offset surface.

    At a signed height (m) beyond a radius of curvature the offset surface runs backwards, but in
    the direction of that curvature only; courses across it do not show it, their neighbours do.
    """
    folded = cells.courses.folds(height)
    cell = np.zeros(len(cells), dtype=bool)
    cell[cells.pairs[folded]] = True
    return np.asarray(cell[cells.pairs].any(axis=1))


def target_courses(cells: Cells, standoff: float) -> TargetCourses:
    """Offset the courses of `cells` to the tool's side by `standoff` (m)."""
    courses, sign = cells.courses, cells.surface.side_sign
    height = sign * standoff
    folded = folded_courses(cells, height)
    cubics = np.empty_like(courses.cubics)
    cubics[..., :3] = courses.cubics[..., :3] + height * courses.cubics[..., 3:]
    cubics[..., 3:] = -sign * courses.cubics[..., 3:]
    bends = courses.bends.copy()
    bends[:, 0] += standoff * bends[:, 1]
    bends[np.repeat(folded, np.diff(courses.first))] = np.inf
    stray, turned = courses.strays[~folded].max(axis=0, initial=0.0)
    return TargetCourses(
        first=courses.first,
        cubics=cubics,
        bends=bends,
        stray_point=float(stray + standoff * turned),
        stray_approach=float(turned),
        turning=ASIDE * courses.turning(height, ~folded),
        folded=folded,
    )
