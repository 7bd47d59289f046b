"""Bridges: connecting two components between cell centres.

Two sheets of configurations (two flips of a wrist, say) may touch only where the arm passes a
singularity, and the target of that singularity may lie between the centres. So two nodes over
neighbouring cells are both tracked to a point of the curve between their centres, and a self-motion
is tried there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.roadmap.expansion import CONNECT_STEPS
from feasibility.roadmap.graph import Roadmap, add_motion, roots_of_nodes
from feasibility.roadmap.motions import (
    MOST_STEPS,
    SearchArrays,
    Work,
    aim,
    connect,
    stand_still,
    track,
)

NARROWEST, WIDEST = 0.1, 0.9  # [1] of the curve between two centres: where a bridge is tried
Reserve = Callable[[int], Roadmap]
"""Makes space for so many rows of `waypoints` and an edge, and returns the roadmap."""


def nearest_pairs(roadmap: Roadmap, pairs: Ints, one: int, other: int) -> Ints:
    """(k, 2) nodes of two components over neighbouring cells, the nearest first.

    Near means that a motion from one to the other would move the tool little, see
    `self_motion.effects`; at a singularity two sheets are near although their joints are far apart.
    """
    root, node_over = roots_of_nodes(roadmap), []
    for component in (one, other):
        node = np.full(len(roadmap.first_node), -1)
        mine = np.flatnonzero(root == component)
        node[roadmap.cell[mine]] = mine
        node_over.append(node)
    both = np.vstack([pairs, pairs[:, ::-1]])
    x, y = node_over[0][both[:, 0]], node_over[1][both[:, 1]]
    found = (x >= 0) & (y >= 0)
    x, y = x[found], y[found]
    effect = 0.5 * (roadmap.effect[x] + roadmap.effect[y])
    distance = (((roadmap.q[x] - roadmap.q[y]) * effect) ** 2).sum(axis=1)
    return np.column_stack([x, y])[np.argsort(distance, kind="stable")]


def bridge(
    arrays: SearchArrays, work: Work, reserve: Reserve, x: int, y: int, curve: int, share: float
) -> bool:
    """Try to connect two nodes over neighbouring cells at a point of the curve between them.

    Args:
        arrays, work, reserve: of the search, see `Reserve`.
        x, y: the nodes.
        curve: the curve between their cells.
        share: parameter of the point on it, in [0, 1].

    Returns:
        True when an edge was added; the components are one then.
    """
    roadmap = reserve(0)
    starts = (0.0, 1.0) if roadmap.cell[x] < roadmap.cell[y] else (1.0, 0.0)
    waypoints, ends = [], []
    for node, start in ((x, starts[0]), (y, starts[1])):
        q = roadmap.q[node].copy()
        rows = np.empty((MOST_STEPS + 1, len(q)))
        count = track(arrays, work, curve, start, share, q, q, False, rows, 0)
        if count < 0:
            return False
        waypoints.append(rows[:count])
        ends.append(q)
    aim(arrays, work, curve, share)
    stand_still(arrays, work)
    between = _self_motion(arrays, work, ends)
    if between is None:
        return False
    # From x to the point, the self-motion there, and the motion from y backwards.
    motion = np.vstack([waypoints[0], between, waypoints[1][-2::-1], roadmap.q[y][None]])
    roadmap = reserve(len(motion))
    add_motion(roadmap, x, y, motion)
    return True


def _self_motion(arrays: SearchArrays, work: Work, ends: list[Array]) -> Array | None:
    """(k, n) waypoints over `work.target` from the first configuration to the second, or None."""
    rows = np.empty((CONNECT_STEPS + 1, len(ends[0])))
    for a, b in ((0, 1), (1, 0)):
        q = ends[a].copy()
        count, reached = connect(arrays, work, q, ends[b], rows, 0, CONNECT_STEPS)
        if reached and a == 0:
            return rows[:count]
        if reached:
            # The motion leads from the second to the first configuration: reverse it.
            return np.vstack([rows[: count - 1][::-1], ends[1][None]])
    return None
