"""Stretches of a motion between two exact configurations, and what is known along them.

Take a part of the segment between two rows, with its own parameter s in 0..1, whose ends are over
the places x0 and x1: found for their tool points, though any would do. `surfaces.places` gives a
continuous path from x0 to x1 of straight pieces, and for each piece numbers D_T and D_b such that
T and b differ from straight lines by at most t (1 - t) / 2 of them, t the piece's own parameter.
Tool point and axis differ likewise from straight lines, by D_p and D_a of the stretch
(`kinematic_bounds`), and by w^2 D_p and w^2 D_a on a part of it that is w of the whole. So on the
part that goes with a piece

    |p - T| <= (1 - t) e0 + t e1 + t (1 - t) / 2 (w^2 D_p + D_T)

with e0 and e1 bounds of |p - T| at its ends: there p is known to s (1 - s) / 2 D_p. The same holds
for |a - b|. Nothing else is assumed of the surface: not that closest points are unique, nor that
they move continuously.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.kinematic_bounds import Placements, peaks, second_derivatives
from feasibility.task import Task
from robots import Kinematics, Robot
from surfaces.places import OffsetSurface, Places

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

CLOSE_TO_ZERO = 1e-12  # [1]: rounding of double arithmetic on unit vectors


class Samples(NamedTuple):
    """k exact configurations of a motion, compared with the surface."""

    row: Ints
    """(k,) the row, or the row before."""
    share: Array
    """(k,) how far on the way to the next row, 0..1."""
    points: Array
    """(k, 3) m, tool points."""
    axes: Array
    """(k, 3) approach axes."""
    places: Places
    error: Array
    """(k,) m, |p - T| over these places."""
    chord: Array
    """(k,) |a - b|."""

    def of(self, rows: Mask | Ints) -> Samples:
        """Some of them."""
        return Samples(
            self.row[rows], self.share[rows], self.points[rows], self.axes[rows],
            self.places.of(rows), self.error[rows], self.chord[rows],
        )  # fmt: skip

    @staticmethod
    def join(parts: list[Samples]) -> Samples:
        """Samples one after the other; at least one part."""
        row, share, points, axes, error, chord = (
            np.concatenate([part[k] for part in parts]) for k in (0, 1, 2, 3, 5, 6)
        )
        places = Places.join(*(part.places for part in parts))
        return Samples(row, share, points, axes, places, error, chord)


class Stretches(NamedTuple):
    """k stretches from sample to sample."""

    start: Samples
    end: Samples
    bends: Array
    """(k, 2) D_p (m) and D_a by the stretch's own parameter."""
    length: Array
    """(k,) share of the segment between two rows."""

    def of(self, rows: Mask | Ints) -> Stretches:
        """Some of them."""
        return Stretches(self.start.of(rows), self.end.of(rows), self.bends[rows],
                         self.length[rows])  # fmt: skip

    def halves(self, middle: Samples) -> Stretches:
        """Both halves of each, first all first halves."""
        ends = Samples.join([self.start, middle]), Samples.join([middle, self.end])
        bends = 0.25 * np.concatenate([self.bends, self.bends])
        return Stretches(*ends, bends, 0.5 * np.concatenate([self.length, self.length]))


class Bounds(NamedTuple):
    """What is known along k stretches."""

    error: Array
    """(k,) m, bounds of |p - T|."""
    chord: Array
    """(k,) of |a - b|."""
    joined: Mask
    """(k,) whether a path of places from one end to the other is known."""

    def of(self, rows: Mask | Ints) -> Bounds:
        """Some of them."""
        return Bounds(self.error[rows], self.chord[rows], self.joined[rows])


class Judge:
    """Compares configurations of one motion, and stretches between them, with a surface."""

    def __init__(self, robot: Robot, task: Task, offset: OffsetSurface, sign: float) -> None:
        """Judge `robot` by `task`, with b = `sign` times the outward normal."""
        self.robot, self.task, self.offset, self.sign = robot, task, offset, sign
        self._kinematics = Kinematics(robot)

    def sampled(self, row: Ints, share: Array, q: Array) -> Samples:
        """Samples at configurations q (k, n)."""
        return self.compared(row, share, *self._kinematics.tools(q))

    def compared(self, row: Ints, share: Array, points: Array, axes: Array) -> Samples:
        """Samples of known tool points and axes; the second guess is where the tool looks."""
        tolerance = self.task.effective_tolerance
        places = self.offset.nearest(points, points + self.task.standoff * axes, tolerance)
        target, normal = self.offset.at(places)
        error = np.linalg.norm(points - target, axis=1)
        chord = np.linalg.norm(axes - self.sign * normal, axis=1)
        return Samples(row, share, points, axes, places, error, chord)

    def between_rows(self, rows: Array, poses: Placements, at: Samples) -> Stretches:
        """The stretches from row to row."""
        steps, slides = np.abs(np.diff(rows, axis=0)), self.robot.prismatic
        bends = [
            second_derivatives(steps, slides, poses.levers, np.inf),
            second_derivatives(steps, slides, poses.sines, 1.0),
        ]
        index = np.arange(len(rows))
        ends = at.of(index[:-1]), at.of(index[1:])
        return Stretches(*ends, np.stack(bends, axis=1), np.ones(len(steps)))

    def bounds(self, s: Stretches) -> Bounds:
        """See the module's text."""
        path = self.offset.paths(s.start.places, s.end.places)
        share = path.share[..., None]
        width = np.diff(path.share, axis=1) ** 2
        found = []
        for start, end, aims, bend, bends in (
            (s.start.points, s.end.points, path.points, s.bends[:, :1], path.bends[..., 0]),
            (s.start.axes, s.end.axes, self.sign * path.normals, s.bends[:, 1:],
             path.bends[..., 1]),
        ):  # fmt: skip
            line = (1.0 - share) * start[:, None] + share * end[:, None]
            sag = 0.5 * path.share * (1.0 - path.share) * bend
            off = np.linalg.norm(line - aims, axis=2) + sag
            peak = peaks(off[:, :-1], off[:, 1:], width * bend + bends)
            found.append(peak.max(axis=1, initial=0.0))
        joined = np.asarray(np.isfinite(path.bends).all(axis=(1, 2)))
        return Bounds(found[0], found[1], joined)

    def within(self, error: Array, chord: Array) -> Mask:
        """(k,) inside tolerance and cone; NaN is not."""
        inside = error <= self.task.effective_tolerance
        return np.asarray(inside & (chord <= self.task.cone_chord + CLOSE_TO_ZERO))
