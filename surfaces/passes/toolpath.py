"""Passes as one toolpath: stretch after stretch, with the ways between them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.parallel import Passes
from surfaces.passes.stretches import Pass
from surfaces.surface import SurfaceError
from surfaces.toolpaths import PoseCells, poses

Floats = NDArray[np.float64]

RETRACT = 0.05  # m
BESIDE = 2.0  # [1] times the spacing: to an end this near the tool goes on along the surface
LIFTED = -1
SAMPLES = 16  # places of a lifted way that are looked at


class PassPlaces(NamedTuple):
    """Places along all passes in the order in which they are run, those of lifted ways among them.

    Where one stretch follows on another along the surface, the tool works on the way between too.
    """

    points: Floats
    """(N, 3) m."""
    normals: Floats
    """(N, 3) outward unit normals."""
    stretch: NDArray[np.int64]
    """(N,) which of the stretches each is a place of; -1 where the tool is lifted."""


def pass_places(found: Passes, retract: float = RETRACT) -> PassPlaces:
    """All stretches in their order, and the lifted ways between those that are apart.

    Args:
        found: passes with at least one stretch.
        retract: m > 0, how far the tool is lifted.

    Raises:
        SurfaceError: there are no passes, or a lifted way would run through the surface.
    """
    if not found.stretches:
        raise SurfaceError("there is no pass on it; take a smaller pitch", found.surface.kind)
    out = found.surface.side_sign * retract
    rows = [(found.stretches[0].points, found.stretches[0].normals, 0)]
    for number, (before, after) in enumerate(pairwise(found.stretches), start=1):
        ends = _ends(before, after)
        if np.linalg.norm(ends.points[1] - ends.points[0]) > BESIDE * found.spacing:
            lifted = ends.points + out * ends.normals
            _refuse_if_through(found, lifted)
            rows.append((lifted, ends.normals, LIFTED))
        rows.append((after.points, after.normals, number))
    points, normals, numbers = zip(*rows, strict=True)
    return PassPlaces(
        np.concatenate(points),
        np.concatenate(normals),
        np.repeat(np.array(numbers, dtype=np.int64), [len(row) for row in points]),
    )


def pass_toolpath(found: Passes, retract: float = RETRACT) -> PoseCells:
    """All stretches in their order as poses, to be run in one motion.

    From the end of one the tool goes on along the surface to a beginning that is near, and else
    lifted off it and straight across.

    Args:
        found: passes with at least one stretch.
        retract: m > 0, how far the tool is lifted.

    Raises:
        SurfaceError: there are no passes, too many points of them, or a lifted way would run
            through the surface.

    Example:
        >>> from surfaces import plane
        >>> from surfaces.passes import parallel_passes, pass_toolpath
        >>> line = pass_toolpath(parallel_passes(plane((0, 0.3), (0, 0.2)), 0.05))
        >>> len(line), line.in_order
        (100, True)
    """
    places = pass_places(found, retract)
    made = poses(places.points, places.normals, side=found.surface.side)
    return PoseCells.of(replace(made.surface, under=found.surface))


def _ends(before: Pass, after: Pass) -> Pass:
    """The last place of one stretch and the first of the next."""
    return Pass(
        level=after.level,
        points=np.stack([before.points[-1], after.points[0]]),
        normals=np.stack([before.normals[-1], after.normals[0]]),
        on_surface=np.array([before.on_surface[-1], after.on_surface[0]]),
        closed=False,
    )


def _refuse_if_through(found: Passes, ends: Floats) -> None:
    """Refuse a straight way between two places (2, 3) m off the surface that runs through it."""
    shares = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    heights = found.surface.closest(ends[0] + shares * (ends[1] - ends[0])).height
    if (found.surface.side_sign * heights <= 0.0).any():
        raise SurfaceError(
            "the way from one stretch of a pass to the next would run through the surface; "
            "take a larger retract height, or another direction",
            found.surface.kind,
        )
