"""The nearest points of any smooth curve or patch: samples in a tree, then projected Newton.

For a map S from a box of parameters into the plane or into space, and a point p, the nearest point
is the least of f(x) = |S(x) - p|^2 / 2 over the box. Newton's method finds it from a start in the
right valley. The valley is found by sampling: with f known from the nearest sample, only samples
within sqrt(2 f) + reach of p can lead to a nearer point, where no place of the box is further than
`reach` from its sample; each that is lowest among its neighbours on the grid starts a descent too.
So the answer is the nearest point if every valley that matters shows on the grid of samples.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask

_MOST_STEPS = 60
_MOST_HALVINGS = 40
_MOST_RIVALS = 8  # valleys tried for one point, besides the nearest sample's
_BLOCK = 1_000_000  # pairs of a point and a sample held at a time, at most
_FEWEST = 16  # points at a time, though these may be more
_HALF = 0.6  # of a step from sample to sample: what is between is longer than the chord
_STILL = 1e-14  # of the box's width: a step this short ends a descent
_EPSILON = float(np.finfo(float).eps)


class Jet(NamedTuple):
    """A map with d parameters into m dimensions at n places, with its derivatives."""

    point: Array
    """(n, m) m."""
    first: Array
    """(n, d, m) first derivatives."""
    second: Array
    """(n, d, d, m) second derivatives."""


class ClosestPointSearch:
    """Nearest points of a smooth map from a box with d = 1 or 2 parameters."""

    def __init__(
        self,
        point: Callable[[Array], Array],
        jet: Callable[[Array], Jet],
        lines: Sequence[Array],
        closed: Sequence[bool],
    ) -> None:
        """Sample the map.

        Args:
            point: parameters (n, d) -> points (n, m).
            jet: parameters (n, d) -> points and derivatives.
            lines: for each parameter the values to sample at, rising from end to end of the box.
            closed: for each parameter whether its two ends are one place.
        """
        from scipy.spatial import cKDTree  # takes longer to load than many a search

        self._point, self._jet = point, jet
        self._low = np.array([line[0] for line in lines])
        self._high = np.array([line[-1] for line in lines])
        self._width = self._high - self._low
        self._closed = np.array(closed, dtype=bool)
        mesh = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
        placed = point(mesh.reshape(-1, len(lines))).reshape(*mesh.shape[:-1], -1)
        self._reach = _HALF * sum(
            float(np.linalg.norm(np.diff(placed, axis=axis), axis=-1).max())
            for axis in range(len(lines))
        )
        kept = tuple(slice(0, -1) if ends_meet else slice(None) for ends_meet in closed)
        self._shape = mesh[kept].shape[:-1]
        self._samples = mesh[kept].reshape(-1, len(lines))
        self._places = placed[kept].reshape(len(self._samples), -1)
        self._extent = float(np.abs(self._places).max())
        self._tree = cKDTree(self._places)

    def nearest(self, points: Array) -> Array:
        """Parameters (n, d) of the point of the map nearest to each of `points` (n, m), finite."""
        _, start = self._tree.query(points)
        found = self._descend(points, self._samples[start])
        gap = np.linalg.norm(self._point(found) - points, axis=1)
        radius = gap + self._reach
        few = max(_BLOCK // len(self._samples), _FEWEST)
        for part in np.split(np.arange(len(points)), np.arange(few, len(points), few)):
            owner, rival = self._rivals(points[part], radius[part], start[part])
            if not len(owner):
                continue
            owner += part[0]
            other = self._descend(points[owner], self._samples[rival])
            away = np.linalg.norm(self._point(other) - points[owner], axis=1)
            order = np.lexsort((away, owner))
            best = order[np.r_[True, np.diff(owner[order]) > 0]]
            best = best[away[best] < gap[owner[best]]]
            found[owner[best]] = other[best]
        return found

    def _rivals(self, points: Array, radius: Array, start: Ints) -> tuple[Ints, Ints]:
        """(point, sample): samples in each ball that are lowest among their neighbours."""
        lists = self._tree.query_ball_point(points, radius, return_sorted=False)
        lengths = np.array([len(found) for found in lists])
        owner = np.repeat(np.arange(len(points)), lengths)
        sample = np.fromiter(itertools.chain.from_iterable(lists), np.int64, int(lengths.sum()))
        other = sample != start[owner]
        owner, sample = owner[other], sample[other]

        def square(which: Ints) -> Array:
            offset = self._places[which] - points[owner]
            return np.asarray(np.einsum("nm,nm->n", offset, offset))

        away = square(sample)
        shifts = itertools.product((-1, 0, 1), repeat=len(self._shape))
        for shift in sorted(shifts, key=np.count_nonzero):  # the nearest ones leave the fewest
            if any(shift):
                lowest = away <= square(self._beside(sample, shift))
                owner, sample, away = owner[lowest], sample[lowest], away[lowest]
        order = np.lexsort((away, owner))
        owner, sample = owner[order], sample[order]
        rank = np.arange(len(owner)) - np.searchsorted(owner, owner)
        return owner[rank < _MOST_RIVALS], sample[rank < _MOST_RIVALS]

    def _beside(self, sample: Ints, shift: tuple[int, ...]) -> Ints:
        """The sample that lies `shift` steps further on the grid, or at its border."""
        index = []
        for axis, place in enumerate(np.unravel_index(sample, self._shape)):
            moved = place + shift[axis]
            size = self._shape[axis]
            index.append(moved % size if self._closed[axis] else np.clip(moved, 0, size - 1))
        return np.asarray(np.ravel_multi_index(tuple(index), self._shape))

    def _descend(self, points: Array, start: Array) -> Array:
        """Projected Newton from `start` (n, d), until the steps are as short as rounding."""
        x = start.copy()
        going = np.arange(len(x))
        for _ in range(_MOST_STEPS):
            if not len(going):
                break
            jet = self._jet(x[going])
            residual = jet.point - points[going]
            slope = np.einsum("ndm,nm->nd", jet.first, residual)
            step = self._step(jet, residual, slope, x[going])
            moved = self._along(points[going], x[going], residual, slope, step)
            size = np.abs((moved - x[going]) / self._width).max(axis=1)
            x[going] = self._wrapped(moved)
            going = going[size > _STILL]
        return x

    def _step(self, jet: Jet, residual: Array, slope: Array, x: Array) -> Array:
        """Newton's step, or Gauss and Newton's where f is not convex; held at the box's sides.

        A parameter at its end is held if the slope, or else the step itself, points out.
        """
        gauss = np.einsum("nim,njm->nij", jet.first, jet.first)
        newton = gauss + np.einsum("nijm,nm->nij", jet.second, residual)
        at_low = ~self._closed & (x <= self._low)
        at_high = ~self._closed & (x >= self._high)
        held = (at_low & (slope > 0.0)) | (at_high & (slope < 0.0))
        step = np.zeros_like(x)
        for _ in range(2):
            step = _solved(newton, gauss, slope, held)
            held |= (at_low & (step < 0.0)) | (at_high & (step > 0.0))
        return np.where(held, 0.0, step)

    def _along(self, points: Array, x: Array, residual: Array, slope: Array, step: Array) -> Array:
        """The first of x + step, x + step/2, ... in the box that lowers f, up to rounding."""
        value = 0.5 * np.einsum("nm,nm->n", residual, residual)
        scale = self._extent + np.linalg.norm(points, axis=1)
        slack = 8.0 * _EPSILON * scale * (np.sqrt(2.0 * value) + _EPSILON * scale)
        result = x.copy()
        share = 1.0
        going = np.flatnonzero(np.any(step != 0.0, axis=1))
        for _ in range(_MOST_HALVINGS):
            if not len(going):
                break
            trial = x[going] + share * step[going]
            trial = np.where(self._closed, trial, np.clip(trial, self._low, self._high))
            offset = self._point(self._wrapped(trial)) - points[going]
            after = 0.5 * np.einsum("nm,nm->n", offset, offset)
            expected = np.einsum("nd,nd->n", slope[going], trial - x[going])
            lower = after <= value[going] + 1e-4 * expected + slack[going]
            result[going[lower]] = trial[lower]
            going = going[~lower]
            share /= 2.0
        return result

    def _wrapped(self, x: Array) -> Array:
        """Closed parameters brought back into the box."""
        if not self._closed.any():
            return x
        return np.where(self._closed, self._low + np.mod(x - self._low, self._width), x)


def _solved(newton: Array, gauss: Array, slope: Array, held: Mask) -> Array:
    """-H^-1 slope over the parameters not held, H = newton where it is safely positive."""
    free = ~held
    both = free[:, :, None] & free[:, None, :]
    unit = np.eye(slope.shape[1], dtype=bool)
    one = unit & held[:, :, None]
    newton, gauss = (np.where(both, h, 0.0) + one for h in (newton, gauss))
    diagonal = np.einsum("nii->ni", newton) > 1e-6 * np.einsum("nii->ni", gauss)
    convex = diagonal.all(axis=1) & (np.linalg.det(newton) > 1e-6 * np.linalg.det(gauss))
    hessian = np.where(convex[:, None, None], newton, gauss)
    downhill = np.where(free, -slope, 0.0)
    return np.asarray(np.linalg.solve(hessian, downhill[:, :, None])[:, :, 0])
