"""Lines on a surface with so many points that the straight pieces between them stay near it.

A tool runs straight from one point to the next, and its normal along the great arc; so a pass, or
the way from one pass to the next, is as near to the surface as its points are close.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from surfaces.passes.parallel import Passes
from surfaces.passes.pass_stretches import Pass
from surfaces.places.offset_surfaces import offset_surface
from surfaces.surface import Surface
from surfaces.toolpaths.arcs import arc_at

WITHIN = 1e-4  # [m], by default
LEANS = 0.05  # [rad] of a normal from the great arc; over triangles it may be more
LEVELS = 10  # halvings of a piece
TURNING = 4  # of them those for the sake of normals alone
SHARES = np.array([0.25, 0.5, 0.75])  # where a piece is compared with the surface
LONGER = 2.0  # [1] times the straight line: a way on the surface that is longer goes round a gap
CLEAR = 64  # places of a straight way beside the surface that are looked at
OVER = (
    0.9  # [1] cosine of the angle at the nearest place from which on a point is not beyond a border
)


class Line(NamedTuple):
    """Points on a surface, joined by straight lines."""

    points: Array
    """(k, 3) m."""
    normals: Array
    """(k, 3) outward unit normals."""


class ToolWay(NamedTuple):
    """Where a tool is to be beside the surface, and how near to that it has to stay."""

    height: float
    """m, along the outward normal."""
    within: float = WITHIN
    """m, how far straight lines between its places may be from where it is to be."""


def fitted(found: Passes, way: ToolWay) -> Passes:
    """The same passes with points put in where straight lines between them would leave them."""
    return replace(found, stretches=tuple(_fitted(found.surface, p, way) for p in found.stretches))


def _fitted(surface: Surface, each: Pass, way: ToolWay) -> Pass:
    """One stretch; its overrun is straight already."""
    on = np.flatnonzero(each.on_surface)
    if len(on) < 2:
        return each
    inner = slice(int(on[0]), int(on[-1]) + 1)
    line = followed(surface, each.points[inner], each.normals[inner], way)
    parts = [(each.points[: on[0]], each.normals[: on[0]])]
    parts += [(line.points, line.normals), (each.points[on[-1] + 1 :], each.normals[on[-1] + 1 :])]
    points, normals = (np.concatenate(part) for part in zip(*parts, strict=True))
    inside = np.repeat([False, True, False], [len(part[0]) for part in parts])
    return replace(each, points=points, normals=normals, on_surface=inside)


def followed(surface: Surface, points: Array, normals: Array, way: ToolWay) -> Line:
    """A line through points (k, 3) m on a surface, with those put in that keep it there."""
    base, line = offset_surface(surface, 0.0), Line(points, normals)
    for level in range(LEVELS):
        middle, off, leans = _beside(surface, line.points, line.normals, way.height)
        cut = (off > way.within) | (level < TURNING) & (leans > LEANS)
        if not cut.any():
            break
        new = base.at(base.nearest(middle[cut], middle[cut], np.inf))[:2]
        at = np.flatnonzero(cut) + 1
        line = Line(*(np.insert(old, at, put, axis=0) for old, put in zip(line, new, strict=True)))
    return line


def _beside(
    surface: Surface, points: Array, normals: Array, height: float
) -> tuple[Array, Array, Array]:
    """The middles (k, 3) of the pieces of a line, and how far a tool is off along them: m, rad."""
    base, offset = offset_surface(surface, 0.0), offset_surface(surface, height)
    start, ahead, share = points[:-1], np.diff(points, axis=0), SHARES[:, None, None]
    over = (start + share * ahead).reshape(-1, 3)
    target, normal, _ = offset.at(base.nearest(over, over, np.inf))
    ends = points + height * normals
    tool = (ends[:-1] + share * np.diff(ends, axis=0)).reshape(-1, 3)
    first, last = (np.tile(some, (len(SHARES), 1)) for some in (normals[:-1], normals[1:]))
    arc, _ = arc_at(first, last, np.repeat(SHARES, len(ahead)))
    off, leans = (
        np.linalg.norm(apart, axis=1).reshape(len(SHARES), -1).max(axis=0)
        for apart in (tool - target, arc - normal)
    )
    return start + 0.5 * ahead, off, leans


def along_surface(surface: Surface, ends: Array, normals: Array, way: ToolWay) -> Line | None:
    """The way on a surface between two places (2, 3) m of it; None where there is no short one."""
    line = followed(surface, ends, normals, way)
    pieces = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
    _, off, _ = _beside(surface, line.points, line.normals, way.height)
    straight = float(np.linalg.norm(ends[1] - ends[0]))
    if (off > way.within).any() or pieces.sum() > LONGER * straight:
        return None
    return line


class Beside(NamedTuple):
    """How a straight way of the tool lies to the surface."""

    through: bool
    """It runs through it."""
    near: bool
    """It comes nearer than the tool is to be."""


def beside(surface: Surface, ends: Array, normals: Array, way: ToolWay) -> Beside:
    """How the straight way of a tool between two places (2, 3) m lies to a surface."""
    share = np.linspace(0.0, 1.0, CLEAR)[:, None]
    tool = ends + way.height * normals
    tool = tool[0] + share * (tool[1] - tool[0])
    base = offset_surface(surface, 0.0)
    foot, normal, _ = base.at(base.nearest(tool, tool, np.inf))
    apart = np.linalg.norm(tool - foot, axis=1)
    above = surface.side_sign * ((tool - foot) * normal).sum(axis=1)
    over = np.abs(above) > OVER * apart
    return Beside(
        bool((over & (above < -way.within)).any()),
        bool((over & (apart < abs(way.height) - way.within)).any()),
    )
