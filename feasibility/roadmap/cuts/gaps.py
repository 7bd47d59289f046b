"""Where a cut may be: the gaps between the components' intervals of each joint.

Components are seen by their intervals; points of the motion set that belong to none of them cut a
gap into smaller ones. The widest are the likeliest to hold a cut, in their middle. Where the
intervals of every joint overlap, several joints together may still have a gap, along the line
between the nearest points of two components' convex hulls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

NARROWEST = 1e-3  # [rad], [m]: gaps that are not worth a try
KEPT = 8  # gaps kept of those between the same two components
PAIRED = 4  # components whose hulls are compared, each two of them
HULL_POINTS = 400  # samples of a component that its hull is made of
STEPS = 200  # towards the nearest points of two hulls


class Component(NamedTuple):
    """Configurations that motions of the roadmap join, and the cells that they cover."""

    q: NDArray[np.float64]
    """(k, n) samples of its motions."""
    cover: NDArray[np.bool_]
    """(N,)"""


class Gap(NamedTuple):
    """An interval of w . q without a known point of the motion set, between two components."""

    weights: NDArray[np.float64]
    """(n,) w"""
    low: float
    high: float
    between: tuple[float, float]
    """The interval between the components, of which this one is a part."""
    promise: float
    """How likely it is to lead to a proof."""

    @property
    def middle(self) -> float:
        """Where the cut is tried."""
        return 0.5 * (self.low + self.high)


def gaps(
    joints: tuple[int, ...], components: list[Component], samples: NDArray[np.float64]
) -> list[Gap]:
    """The gaps of some joints, the most promising first.

    Args:
        joints: which.
        components: those inside a region.
        samples: (k, n) other points of the motion set inside it.
    """
    found: list[Gap] = []
    for joint in joints:
        found += gaps_along(np.eye(samples.shape[1])[joint], components, samples)
    return sorted(found, key=lambda gap: -gap.promise)


def slanted_gaps(
    joints: tuple[int, ...], components: list[Component], samples: NDArray[np.float64]
) -> list[Gap]:
    """The gaps along several joints together, the most promising first; as `gaps`."""
    found: list[Gap] = []
    for k, one in enumerate(components[:PAIRED]):
        for other in components[:k]:
            weights = np.zeros(samples.shape[1])
            weights[list(joints)] = _between_hulls(one.q[:, joints], other.q[:, joints])
            if weights.any():
                found += gaps_along(weights, components, samples)
    return sorted(found, key=lambda gap: -gap.promise)


def _between_hulls(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit vector (m,) between the nearest points of two hulls of points (k, m).

    Gilbert's algorithm on their difference: a point of it moves towards the corner that is furthest
    along the way to the origin. All 0 where they seem to overlap.
    """
    one, other = (q[:: 1 + len(q) // HULL_POINTS] for q in (one, other))
    near = one.mean(axis=0) - other.mean(axis=0)
    for _ in range(STEPS):
        corner = one[np.argmin(one @ near)] - other[np.argmax(other @ near)]
        step = near - corner
        length = float(step @ step)
        if length <= 0.0 or near @ step <= 1e-6 * (near @ near):
            break
        near = near - min(float(near @ step) / length, 1.0) * step
    size = float(np.linalg.norm(near))
    return near / size if size > NARROWEST else np.zeros_like(near)


def gaps_along(
    weights: NDArray[np.float64], components: list[Component], samples: NDArray[np.float64]
) -> list[Gap]:
    """The gaps of w . q between components, each cut at the samples, the widest `KEPT` of each."""
    along = [component.q @ weights for component in components]
    low = np.array([values.min() for values in along])
    order = np.argsort(low, kind="stable")
    reached = np.maximum.accumulate(np.array([along[k].max() for k in order]))
    others = np.sort(samples @ weights)
    found: list[Gap] = []
    for k in range(len(order) - 1):
        start, end = float(reached[k]), float(low[order[k + 1]])
        if not end - start > NARROWEST:
            continue
        ends = np.concatenate([[start], others[(others > start) & (others < end)], [end]])
        widest = np.argsort(-np.diff(ends), kind="stable")[:KEPT]
        # Sides that need no further cut make a proof likelier.
        sides = [[components[i].cover for i in part] for part in (order[: k + 1], order[k + 1 :])]
        settled = sum(not np.any(side, axis=0).all() for side in sides)
        found += [
            Gap(
                weights=weights,
                low=float(ends[i]),
                high=float(ends[i + 1]),
                between=(start, end),
                promise=float(ends[i + 1] - ends[i]) * (1 + settled),
            )
            for i in widest
            if ends[i + 1] - ends[i] > NARROWEST
        ]
    return found
