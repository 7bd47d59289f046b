"""Passes as one toolpath: stretch after stretch, with the moves between them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.passes.parallel import Passes
from surfaces.surface import SurfaceError
from surfaces.toolpaths import PoseCells, poses

RETRACT = 0.05  # m
BESIDE = 2.0  # [1] times the spacing: to an end this near the tool goes on along the surface
LIFTED = -1
SAMPLES = 16  # places of a lifted move that are checked


class PassPlaces(NamedTuple):
    """Places along all passes in the order in which they are run, those of lifted moves among them.

    Where one stretch follows on another along the surface, the tool works between them too.
    """

    points: Array
    """(N, 3) m."""
    normals: Array
    """(N, 3) outward unit normals."""
    stretch: Ints
    """(N,) which of the stretches each is a place of; -1 where the tool is lifted."""


def pass_places(found: Passes, retract: float = RETRACT) -> PassPlaces:
    """All stretches in their order, and the lifted moves between those that are apart.

    Args:
        found: passes with at least one stretch.
        retract: m > 0, how far the tool is lifted.

    Raises:
        SurfaceError: there are no passes, or a lifted move would run through the surface.
    """
    if not found.stretches:
        raise SurfaceError("there is no pass on it; take a smaller pitch", found.surface.kind)
    out = found.surface.side_sign * retract
    rows = [(found.stretches[0].points, found.stretches[0].normals, 0)]
    for number, (before, after) in enumerate(pairwise(found.stretches), start=1):
        ends = np.stack([before.points[-1], after.points[0]])
        if np.linalg.norm(ends[1] - ends[0]) > BESIDE * found.spacing:
            normals = np.stack([before.normals[-1], after.normals[0]])
            lifted = ends + out * normals
            _refuse_if_through(found, lifted)
            rows.append((lifted, normals, LIFTED))
        rows.append((after.points, after.normals, number))
    points, outward, numbers = zip(*rows, strict=True)
    return PassPlaces(
        np.concatenate(points),
        np.concatenate(outward),
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
        SurfaceError: there are no passes, too many points of them, or a lifted move would
            run through the surface.

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


def _refuse_if_through(found: Passes, ends: Array) -> None:
    """Refuse a straight move between two places (2, 3) m off the surface that runs through it."""
    shares = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    heights = found.surface.closest(ends[0] + shares * (ends[1] - ends[0])).height
    if (found.surface.side_sign * heights <= 0.0).any():
        raise SurfaceError(
            "the move from one stretch of a pass to the next would run through the surface; "
            "take a larger retract height, or another direction",
            found.surface.kind,
        )
