"""Where a cut may be: the gaps between the components' intervals of each joint.

Components are seen by their intervals; points of the motion set that belong to none of them cut a
gap into smaller ones. The widest are the likeliest to hold a cut, in their middle.

A joint that turns freely, or through more than a turn, has gaps on its circle: all its windings
place the tool alike. Where it can nowhere be at t + 2 pi k, one turn from t is enough for all
windings, and a motion stays inside its own.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.proofs.regions import TURN

NARROWEST = 1e-3  # [rad], [m]: gaps that are not worth a try
KEPT = 8  # gaps kept of those between the same two components


class Component(NamedTuple):
    """Configurations that motions of the roadmap join, and the cells that they cover."""

    q: Array
    """(k, n) samples of its motions."""
    cover: Mask
    """(N,)"""


def components_of(roadmap: Roadmap) -> list[Component]:
    """The components of a roadmap, the largest first: nodes and waypoints, and covered cells."""
    parts: dict[int, list[Array]] = {}
    for node, q in enumerate(roadmap.q):
        parts.setdefault(roadmap.root_of(node), []).append(q[None])
    for x, _, motion in roadmap.edges:
        parts[roadmap.root_of(x)].append(motion)
    found = [Component(np.vstack(parts[k]), roadmap.cover[k].copy()) for k in sorted(parts)]
    return sorted(found, key=lambda component: -int(component.cover.sum()))


class JointGap(NamedTuple):
    """An interval of a joint without a known point of the motion set, between two components."""

    joint: int
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


def gaps(joints: tuple[int, ...], components: list[Component], samples: Array) -> list[JointGap]:
    """The gaps of some joints, the most promising first.

    Components are those inside a region, samples (k, n) other points of the motion set inside it.
    """
    found = [gap for joint in joints for gap in gaps_of(joint, components, samples)]
    return sorted(found, key=lambda gap: -gap.promise)


def gaps_of(joint: int, components: list[Component], samples: Array) -> list[JointGap]:
    """The gaps of one joint, each cut at the samples, the widest `KEPT` of each."""
    along = [component.q[:, joint] for component in components]
    low = np.array([values.min() for values in along])
    order = np.argsort(low, kind="stable")
    reached = np.maximum.accumulate(np.array([along[k].max() for k in order]))
    others = np.sort(samples[:, joint])
    found: list[JointGap] = []
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
            JointGap(
                joint=joint,
                low=float(ends[i]),
                high=float(ends[i + 1]),
                between=(start, end),
                promise=float(ends[i + 1] - ends[i]) * (1 + settled),
            )
            for i in widest
            if ends[i + 1] - ends[i] > NARROWEST
        ]
    return found


def openings(joint: int, components: list[Component], samples: Array) -> Iterator[float]:
    """Angles (-pi to pi) at which the circle of a joint may be cut open, the widest gap's first.

    Neither components nor samples (k, n), other points of the motion set, are there.
    """
    starts = [samples[:, joint]]
    widths = [np.zeros(len(samples))]
    for component in components:
        values = component.q[:, joint]
        starts.append(values.min(keepdims=True))
        widths.append(np.ptp(values, keepdims=True))
    start, width = np.mod(np.concatenate(starts), TURN), np.concatenate(widths)
    if not len(start):
        yield 0.0
        return
    order = np.argsort(start, kind="stable")
    start, end = start[order], np.maximum.accumulate((start + width)[order])
    # What reaches past a full turn covers the circle's beginning too.
    end = np.maximum(end, end[-1] - TURN)
    gap = np.append(start[1:], start[0] + TURN) - end
    for k in np.argsort(-gap, kind="stable")[:KEPT]:
        if gap[k] > NARROWEST:
            t = float(end[k] + 0.5 * gap[k])
            yield float(np.mod(t + np.pi, TURN) - np.pi)
