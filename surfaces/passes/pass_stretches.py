"""The stretches of passes as they are run: in order, with their points evenly apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.linalg import norm

from coverable.arrays import Array, Mask, Protected
from surfaces.passes.levels import Line
from surfaces.surface import Surface


@dataclass(frozen=True, eq=False, slots=True)
class Pass(Protected):
    """One stretch of a pass that the tool can run without leaving the surface."""

    level: int
    """Which pass it belongs to, counted across the surface from 0."""
    points: Array
    """(k, 3) m, in the root frame; on the surface, but for the overrun."""
    normals: Array
    """(k, 3) outward unit normals; along the overrun those at the border."""
    on_surface: Mask
    """(k,) False along the overrun."""
    closed: bool
    """True where it ends where it begins."""

    @property
    def length(self) -> float:
        """m."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    @property
    def beyond_border(self) -> float:
        """m, how far it goes on beyond the border."""
        on = np.flatnonzero(self.on_surface)
        if not len(on):
            return 0.0
        ends = self.points[[0, -1]] - self.points[[on[0], on[-1]]]
        return float(np.linalg.norm(ends, axis=1).max())


class LevelLine(NamedTuple):
    """A line with the number of its level."""

    level: int
    line: Line


def in_order(lines: list[LevelLine], one_way: bool) -> Iterator[LevelLine]:
    """The lines, sorted by level, in the order of the run: every other level turned round.

    Within a level each line begins nearest to where the one before it ended; those that a hole
    parts follow one another as they lie on their line.
    """
    here: Array | None = None
    for number, (level, group) in enumerate(groupby(lines, key=lambda each: each.level)):
        row = [each.line for each in group]
        if number % 2 and not one_way:
            row = [line.reversed() for line in reversed(row)]
        while row:
            away = [0.0 if here is None else float(norm(line.points[0] - here)) for line in row]
            line = row.pop(int(np.argmin(away)))
            here = line.points[-1]
            yield LevelLine(level, line)


def stretch_of(surface: Surface, each: LevelLine, step: float, overrun: float) -> Pass:
    """A line with its points evenly apart, on the surface itself, and its overrun."""
    line = each.line
    points = np.concatenate([line.points, line.points[:1]]) if line.closed else line.points
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(1, math.ceil(along[-1] / step - 1e-9))
    wanted = np.linspace(0.0, along[-1], count + 1)
    even = np.column_stack([np.interp(wanted, along, points[:, k]) for k in range(3)])
    at = surface.closest(even)
    on, normals = even - at.height[:, None] * at.normal, at.normal
    inside = np.ones(len(on), dtype=bool)
    if overrun > 0.0 and not line.closed and len(on) > 1:
        extra = np.arange(1, max(1, math.ceil(overrun / step - 1e-9)) + 1)
        reach = overrun * extra / extra[-1]
        before, after = (
            _beyond(on[i], on[i] - on[j], normals[i], reach) for i, j in ((0, 1), (-1, -2))
        )
        on = np.concatenate([before[::-1], on, after])
        ends = np.repeat(normals[[0, -1]], len(extra), axis=0)
        normals = np.concatenate([ends[: len(extra)], normals, ends[len(extra) :]])
        inside = np.pad(inside, len(extra))
    return Pass(each.level, on, normals, inside, line.closed)


def _beyond(end: Array, heading: Array, normal: Array, reach: Array) -> Array:
    """(k, 3) m, points straight on from an end in its tangent plane, at distances (k,) from it."""
    flat = heading - (heading @ normal) * normal
    return np.asarray(end + reach[:, None] * flat / max(float(np.linalg.norm(flat)), 1e-300))
