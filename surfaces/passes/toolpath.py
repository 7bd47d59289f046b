"""Passes as one toolpath: stretch after stretch, with the ways between them.

From the end of a stretch the tool goes on along the surface, where the next one begins beside it;
beyond the border straight, where that stays clear of the surface; and else it is lifted.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.passes.parallel import Passes
from surfaces.passes.pass_stretches import Pass
from surfaces.passes.ways import ToolWay, along_surface, beside, fitted
from surfaces.surface import SurfaceError
from surfaces.toolpaths.given import poses
from surfaces.toolpaths.pose_cells import PoseCells

RETRACT = 0.05  # m
BESIDE = 2.0  # [1] times the spacing: to an end this near the tool goes on along the surface
LIFTED, BETWEEN = -1, -2
ON_SURFACE = ToolWay(0.0)


class PassPlaces(NamedTuple):
    """Places along all passes in the order in which they are run, those of the ways between too.

    Where one stretch follows on another along the surface, the tool works between them too.
    """

    points: Array
    """(N, 3) m."""
    normals: Array
    """(N, 3) outward unit normals."""
    stretch: Ints
    """(N,) which of the stretches each is a place of; -1 where the tool is lifted, -2 on the way
    from one to the next along the surface."""
    on_surface: Mask
    """(N,) False where the tool is lifted, and beyond the border."""

    @property
    def at_work(self) -> Ints:
        """(N,) `stretch`, on the way along the surface that of the one before; -1 if lifted."""
        known = np.where(self.stretch == BETWEEN, 0, np.arange(len(self.stretch)))
        return self.stretch[np.maximum.accumulate(known)]

    @property
    def lifts(self) -> int:
        """How often the tool is lifted between stretches."""
        return int((self.stretch == LIFTED).sum()) // 2


def pass_places(found: Passes, retract: float = RETRACT, way: ToolWay = ON_SURFACE) -> PassPlaces:
    """All stretches in their order, and the ways between them.

    Args:
        found: passes with at least one stretch.
        retract: m > 0, how far the tool is lifted.
        way: where the tool is to be.

    Raises:
        SurfaceError: there are no passes, or a lifted move would run through the surface.
    """
    if not found.stretches:
        raise SurfaceError("there is no pass on it; take a smaller pitch", found.surface.kind)
    parts = [_places(found.stretches[0], 0)]
    for number, (before, after) in enumerate(pairwise(found.stretches), start=1):
        parts += [*_between(found, before, after, retract, way), _places(after, number)]
    return PassPlaces(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _places(each: Pass, number: int) -> PassPlaces:
    """The places of one stretch."""
    return PassPlaces(each.points, each.normals, np.full(len(each.points), number), each.on_surface)


def _between(
    found: Passes, before: Pass, after: Pass, retract: float, way: ToolWay
) -> list[PassPlaces]:
    """The places between the end of one stretch and the beginning of the next; none if straight."""
    surface = found.surface
    ends = np.stack([before.points[-1], after.points[0]])
    normals = np.stack([before.normals[-1], after.normals[0]])
    if np.linalg.norm(ends[1] - ends[0]) <= BESIDE * found.spacing:
        if before.on_surface[-1] and after.on_surface[0]:
            line = along_surface(surface, ends, normals, way)
            if line is not None:
                points, outward = line.points[1:-1], line.normals[1:-1]
                on = np.ones(len(points), dtype=bool)
                return [PassPlaces(points, outward, np.full(len(points), BETWEEN), on)]
        elif not any(beside(surface, ends, normals, way)):
            return []
    lifted = ends + surface.side_sign * retract * normals
    if beside(surface, lifted, normals, way).through:
        raise SurfaceError(
            "the move from one stretch of a pass to the next would run through the surface; "
            "take a larger retract height, or another direction",
            surface.kind,
        )
    return [PassPlaces(lifted, normals, np.full(2, LIFTED), np.zeros(2, dtype=bool))]


class PassRoute(NamedTuple):
    """Passes as one toolpath."""

    passes: Passes
    """With places put in, where straight lines between them would leave the surface."""
    places: PassPlaces
    cells: PoseCells
    """The places as poses, in the frame of the surface."""


def pass_route(found: Passes, retract: float = RETRACT, way: ToolWay = ON_SURFACE) -> PassRoute:
    """Passes in their order, to be run in one motion.

    Args:
        found: passes with at least one stretch.
        retract: m > 0, how far the tool is lifted.
        way: where the tool is to be; by default on the surface, within 0.1 mm.

    Raises:
        SurfaceError: there are no passes, too many points of them, or a lifted move would
            run through the surface.
    """
    passes = fitted(found, way)
    places = pass_places(passes, retract, way)
    return PassRoute(passes, places, _posed(found, places))


def places_along(found: Passes, way: ToolWay = ON_SURFACE) -> PoseCells:
    """The places of passes as poses, without the ways between: what a motion has to reach.

    Raises:
        SurfaceError: there are no passes, or too many points of them.
    """
    if not found.stretches:
        raise SurfaceError("there is no pass on it; take a smaller pitch", found.surface.kind)
    parts = [_places(each, number) for number, each in enumerate(fitted(found, way).stretches)]
    return _posed(found, PassPlaces(*map(np.concatenate, zip(*parts, strict=True))))


def _posed(found: Passes, places: PassPlaces) -> PoseCells:
    """Places as poses, in the frame of the surface."""
    surface = found.surface
    turn, origin = surface.rotation, surface.position
    made = poses((places.points - origin) @ turn, places.normals @ turn, side=surface.side)
    placed = replace(
        made.surface, rotation=turn, position=origin, under=surface, working=places.on_surface
    )
    return PoseCells.of(placed)


def pass_toolpath(found: Passes, retract: float = RETRACT) -> PoseCells:
    """All stretches in their order as poses, to be run in one motion; see `pass_route`.

    Example:
        >>> from coverable import plane
        >>> from coverable import parallel_passes, pass_toolpath
        >>> line = pass_toolpath(parallel_passes(plane((0, 0.3), (0, 0.2)), 0.05))
        >>> len(line), line.in_order
        (100, True)
    """
    return pass_route(found, retract).cells
