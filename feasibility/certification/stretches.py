"""Stretches of a motion between two exact configurations, and what is known along them.

Take a part of the segment between two rows, with its own parameter s in 0..1, whose ends are over
the places x0 and x1: found for their tool points, though any would do. `surfaces.places` gives a
continuous path from x0 to x1 of straight pieces, and for each piece numbers d_T and d_b, such that
T and b differ from straight lines by at most these; or by at most 4 t (1 - t) times these, t the
piece's own parameter, as what bends evenly does.
Tool point and axis differ likewise from straight lines, by D_p and D_a of the stretch
(`lever_bounds`), and by w^2 D_p and w^2 D_a on a part of it that is w of the whole. So on the
part that goes with a piece

    |p - T| <= (1 - t) e0 + t e1 + t (1 - t) / 2 w^2 D_p + d_T    or 4 t (1 - t) d_T

with e0 and e1 bounds of |p - T| at its ends: there p is known to s (1 - s) / 2 D_p. The same holds
for |a - b|, and for the roll what `certification.roll_held` says. Nothing else is assumed of the
surface: not that closest points are unique, nor that they move continuously.

**On a mesh** the normals of targets are interpolated, and the tool point has to keep its distance
from the triangles themselves, too: standoff less tolerance from all of them, so that nothing
protrudes into it, and no concave crease is entered. The squared distance of p from any set is the
least of |p - f|^2 over its points f; along a straight line each of these is a parabola with the
second derivative 2 |p'|^2, so their least lies at most s (1 - s) |p'|^2 below the straight line
between its ends; and p is off its chord by D_p / 8 at most.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array, Ints, Mask, Rows
from feasibility.certification.bisection import Stretches
from feasibility.certification.faults import ROLL_CLOSE
from feasibility.certification.lever_bounds import jacobians, peaks, second_derivatives
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface
from surfaces.places.places import Places
from surfaces.surface import Surface

ANY_CHORD = 4.0  # more than any; what is not known is inside a cone of all directions
CLOSE_TO_ZERO = 1e-12  # [m], [1]: rounding of double arithmetic on unit vectors


@dataclass(frozen=True, eq=False, slots=True)
class Figures(Rows):
    """What is known of k configurations of a motion, or at least along k stretches."""

    error: Array
    """(k,) m, |p - T|."""
    chord: Array
    """(k,) |a - b|."""
    facets: Array
    """(k,) m, distance from the triangles of a mesh; inf where the surface is smooth."""
    roll: Array
    """(k,) rad, how far the roll is off the middle of its range; 0 where it is free."""


@dataclass(frozen=True, eq=False, slots=True)
class Samples(Figures):
    """k exact configurations of a motion, compared with the surface over some places."""

    row: Ints
    """(k,) the row, or the row before."""
    share: Array
    """(k,) how far on the way to the next row, 0..1."""
    points: Array
    """(k, 3) m, tool points."""
    axes: Array
    """(k, 3) approach axes."""
    places: Places
    x: Array
    """(k, 3) reference axes."""


@dataclass(frozen=True, eq=False, slots=True)
class SampledStretches(Stretches[Samples]):
    """k stretches from sample to sample."""

    of_segment: Array
    """(k, 3) D_p (m), D_a and D_x + D_y of the segment from row to row."""

    @property
    def second(self) -> Array:
        """(k, 3) the same by the stretch's own parameter."""
        return self.of_segment * self.length[:, None] ** 2


@dataclass(frozen=True, eq=False, slots=True)
class Bounds(Figures):
    """What is known all along k stretches."""

    joined: Mask
    """(k,) whether a path of places from one end to the other is known."""


def configurations(rows: Array, row: Ints, share: Array) -> Array:
    """(k, n) where a motion (m, n) is so far on from rows (k,) to the next ones, rad or m."""
    start = rows[row]
    return start + share[:, None] * (rows[np.minimum(row + 1, len(rows) - 1)] - start)


class Judge:
    """Compares configurations of one motion, and stretches between them, with a surface."""

    def __init__(
        self,
        robot: Robot,
        task: Task,
        surface: Surface,
        cells: Cells,
        rows: Array,
        marks: Ints | None = None,
        curves: Ints | None = None,
    ) -> None:
        """Judge a motion `rows` (m, n) of `robot` by `task`, over the parallel of a surface.

        That is the surface of `cells`, or the one under them. `marks` (m,) say at which cell's
        target a row is said to be, -1 for none, and `curves` (m,) between poses which curve the
        motion is on behind each row.
        """
        self.robot, self.task, self.cells = robot, task, cells
        self.rows, self.marks, self._curves = rows, marks, curves
        self.kinematics = Kinematics(robot)
        self._sign, self._approach = -cells.surface.side_sign, task.fixed_approach(cells)
        self._reference = None if task.roll is None else task.fixed_reference(cells)
        by_u, self._roll = task.roll is not None and self._reference is None, None
        self.offset = offset_surface(surface, -self._sign * task.standoff, by_u)
        if task.roll is not None:  # what judges a roll is loaded where there is a range of it
            from feasibility.certification.roll_held import HeldRoll

            square = by_u and self._approach is None and self.offset.square
            self._roll = HeldRoll(task.roll, square)

    def along(self, rows: Array) -> Judge:
        """The same of another motion without marks."""
        other = copy(self)
        other.rows, other.marks = rows, None
        return other

    def at_rows(self) -> Samples:
        """Samples at all rows."""
        return self.sampled(np.arange(len(self.rows)), np.zeros(len(self.rows)))

    def sampled(self, row: Ints, share: Array) -> Samples:
        """Samples of the motion so far on from rows (k,) to the next ones.

        The second guess is where the tool looks. Over a hollow that is about as round as the
        standoff a tool point is near to the targets of several places. Where its axis does not fit
        to the nearest, the one that the tool looks at may be right.
        """
        q, tolerance = configurations(self.rows, row, share), self.task.effective_tolerance
        points, axes, x = self.kinematics.held(q)
        ahead = points + max(self.task.standoff, self.offset.least_look) * axes
        only = None if self._curves is None else self._curves[row]
        places = self.offset.nearest(points, ahead, tolerance, only)
        found = self.over(places, row, share, points, axes, x)
        bad = np.flatnonzero(~self.within(found) & (found.error <= tolerance))
        if not len(bad):
            return found
        some = None if only is None else only[bad]
        seen = self.offset.nearest(ahead[bad], ahead[bad], np.inf, some)
        for places in (self.offset.approached(points[bad], seen), seen):
            found = self.corrected(found, bad, places)
        return found

    def corrected(self, found: Samples, bad: Ints, places: Places) -> Samples:
        """Samples, but some (k,) of them over other places, where they are right there."""
        some = found.of(bad)
        tried = self.over(places, some.row, some.share, some.points, some.axes, some.x)
        which, better = np.arange(len(found.row)), self.within(tried)
        which[bad[better]] = len(found.row) + np.flatnonzero(better)
        return Samples.join(found, tried).of(which)

    def over(
        self, places: Places, row: Ints, share: Array, points: Array, axes: Array, x: Array
    ) -> Samples:
        """`sampled`, of known tool points, axes and reference axes (k, 3), over given places."""
        target, approaches, references = self.targets(places)
        error = np.linalg.norm(points - target, axis=1)
        chord = np.linalg.norm(axes - approaches, axis=1)
        facets = self.offset.facets(points)
        roll = np.zeros(len(x))
        if self._roll is not None:
            roll = self._roll.rolls(x, axes, approaches, references)
        return Samples(error, chord, facets, roll, row, share, points, axes, places, x)

    def targets(self, places: Places) -> tuple[Array, Array, Array]:
        """(k, 3) m, targets over places, and (k, 3) approach and reference directions there."""
        target, normals, tangents = self.offset.at(places)
        return target, *self._directions(normals, tangents)

    def _directions(self, normals: Array, tangents: Array) -> tuple[Array, Array]:
        """Approach and reference directions (..., 3), of outward normals and u directions."""
        approaches = self._sign * normals
        if self._approach is not None:
            approaches = np.where(np.isnan(normals), np.nan, self._approach)
        if self._reference is not None:
            tangents = np.broadcast_to(self._reference, normals.shape)
        return approaches, tangents

    def between_rows(self, at: Samples) -> SampledStretches:
        """The stretches from row to row, with samples `at` every row."""
        poses = jacobians(self.kinematics, self.rows)
        steps, slides = np.abs(np.diff(self.rows, axis=0)), self.robot.prismatic
        second = np.zeros((len(steps), 3))
        second[:, 0] = second_derivatives(steps, slides, poses.levers, np.inf)
        second[:, 1] = second_derivatives(steps, slides, poses.sines, 1.0)
        if self._roll is not None:
            from feasibility.certification.roll_held import frame_second_derivatives

            second[:, 2] = frame_second_derivatives(steps, slides, poses, at.x)
        row, none = np.arange(len(steps)), np.zeros(len(steps))
        ends = at.of(row), at.of(row + 1)
        return SampledStretches(row, none, none + 1.0, *ends, second)

    def bounds(self, s: SampledStretches) -> Bounds:
        """See the module's text."""
        path = self.offset.paths(s.start.places, s.end.places)
        known = path.known
        normals, tangents = self._directions(path.normals, path.tangents)
        path = replace(path, normals=normals, tangents=tangents)
        for column, fixed in ((1, self._approach), (2, self._reference)):
            if fixed is not None:
                path.deviations[..., column] = 0.0
        share, width = path.share[..., None], np.diff(path.share, axis=1) ** 2
        second = s.second
        found = []
        for start, end, aims, own, beside in (
            (s.start.points, s.end.points, path.points, second[:, :1], path.deviations[..., 0]),
            (s.start.axes, s.end.axes, path.normals, second[:, 1:2], path.deviations[..., 1]),
        ):  # fmt: skip
            line = (1.0 - share) * start[:, None] + share * end[:, None]
            sag = 0.5 * path.share * (1.0 - path.share) * own
            off = np.linalg.norm(line - aims, axis=2) + sag
            if self.offset.bends_evenly:
                peak = peaks(off[:, :-1], off[:, 1:], width * own + 8.0 * beside)
            else:
                peak = peaks(off[:, :-1], off[:, 1:], width * own) + beside
            found.append(peak.max(axis=1, initial=0.0))
        x, axes = (s.start.x, s.end.x), (s.start.axes, s.end.axes)
        roll = np.zeros(len(second))
        if self._roll is not None:
            roll = self._roll.rolls_between(x, axes, second[:, 2], path)
        return Bounds(found[0], found[1], _apart(s), roll, known)

    def beyond(self, one: Figures) -> Array:
        """(4, k) see `beyond`; and m, how far too near to the triangles of a mesh."""
        least = self.task.standoff - self.task.effective_tolerance - CLOSE_TO_ZERO
        return np.vstack([beyond(self.task, one.error, one.chord, one.roll), least - one.facets])

    def within(self, one: Figures) -> Mask:
        """(k,) inside tolerance, cone and roll, apart from a mesh's triangles; NaN is not."""
        return np.asarray((self.beyond(one) <= 0.0).all(axis=0))


def beyond(task: Task, error: Array, chord: Array, roll: Array) -> Array:
    """(3, k) by how much tools are outside of what is exactly allowed; NaN is not inside.

    `error`, `chord` and `roll` (k,) are as in `Samples`.
    """
    half = 0.0 if task.roll is None else task.roll.half
    return np.stack([
        error - task.effective_tolerance,
        np.minimum(chord, ANY_CHORD) - (task.cone_chord + CLOSE_TO_ZERO),
        roll - (half + ROLL_CLOSE),
    ])  # fmt: skip


def _apart(s: SampledStretches) -> Array:
    """(k,) m, lower bounds of the tool point's distance from the triangles of a mesh."""
    a, b = s.start.facets, s.end.facets
    known = np.isfinite(a) & np.isfinite(b)
    least = np.where(np.isnan(a) | np.isnan(b), np.nan, np.inf)
    if known.any():
        step = ((s.end.points[known] - s.start.points[known]) ** 2).sum(axis=1)
        square = -peaks(-(a[known] ** 2), -(b[known] ** 2), 2.0 * step)
        least[known] = np.sqrt(np.maximum(square, 0.0)) - s.second[known, 0] / 8.0
    return least
