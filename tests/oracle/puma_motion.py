"""Motions out of the PUMA oracle: its "joined" made checkable.

The oracle says that two cells hang together because its graph does. Here the graph's shortest path
between them becomes a motion: along the path the tool point follows the patch exactly (closed-form
theta1 to theta3 at every parameter), and theta4 and theta5 run in straight lines. What the motion
really does is then measured on samples that are many times finer than the graph.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from oracle_cases import Domain, Floats, Ints, Problem
from puma_oracle import (
    STANDARD,
    TAU,
    Fibres,
    Resolution,
    arms,
    components,
    domain_of,
    fibres,
    in_link3,
    row_step,
    slack,
)
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order


class Motion(NamedTuple):
    """A continuous motion, as samples of it."""

    uv: Floats
    """(m, 2) parameters of the tool point, rad or m."""
    q: Floats
    """(m, 5) theta1 to theta5."""


class Measured(NamedTuple):
    """What a motion keeps, at its worst sample; everything >= 0 is inside."""

    cone: float
    """rad, room to the cone's rim."""
    limits: float
    """rad, room to the nearest limit of theta1 to theta5."""
    jump: float
    """rad, the largest change of a joint from one sample to the next."""


def _edges(found: Fibres) -> tuple[Ints, Ints, int]:
    """Both ends of every edge between (arm node, row, interval) nodes, and the count of nodes."""
    low, high = found.spans[..., 0], found.spans[..., 1]
    _, rows, slots = low.shape
    size = rows * slots
    heads, tails = [], []
    steps = [(np.arange(len(found.arm)), np.arange(len(found.arm)), 1)]
    steps += [(found.links[:, 0], found.links[:, 1], 0)]
    for a, b, down in steps:
        last = rows - down
        for i in range(slots):
            for j in range(slots):
                one, two = found.arm[a], found.arm[b]
                bottom = np.maximum(low[one, :last, i], low[two, down:, j])
                node, row = np.nonzero(
                    np.minimum(high[one, :last, i], high[two, down:, j]) >= bottom
                )
                heads.append(a[node] * size + row * slots + i)
                tails.append(b[node] * size + (row + down) * slots + j)
    return np.concatenate(heads), np.concatenate(tails), len(found.arm) * size


def spanning(
    problem: Problem, resolution: Resolution = STANDARD, fine: int = 20, on: str = "net"
) -> dict[int, Motion]:
    """Motions from one configuration to each cell of the component that has most.

    They all start alike, so that together they are one continuous motion over these cells (out and
    back along each). `fine` is the number of samples of each step from node to node; `on` is the
    domain, see `oracle_cases`.
    """
    domain, folds = domain_of(problem, on, resolution)
    found = fibres(problem, domain, folds, row_step(problem, resolution))
    cells, roots = components(found, domain)
    if len(roots) == 0:
        return {}
    pairs = np.unique(np.stack([roots, cells], 1), axis=0)
    names, sizes = np.unique(pairs[:, 0], return_counts=True)
    start = int(names[sizes.argmax()])  # a component is named by its smallest node
    head, tail, count = _edges(found)
    graph = coo_matrix((np.ones(len(head), dtype=np.int8), (head, tail)), (count, count)).tocsr()
    order, before = breadth_first_order(graph, start, directed=False)
    at = found.sample[order // (found.spans.shape[1] * found.spans.shape[2])]
    made = {}
    for cell in pairs[pairs[:, 0] == start, 1].tolist():
        way = [int(order[at == domain.centres[cell]][0])]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        made[cell] = _walk(problem, domain, found, np.array(way[::-1]), fine)
    return made


def _walk(problem: Problem, domain: Domain, found: Fibres, way: Ints, fine: int) -> Motion:
    """The motion through a sequence of nodes."""
    _, rows, slots, _ = found.spans.shape
    node, row, slot = way // (rows * slots), way // slots % rows, way % slots
    span = found.spans[found.arm[node], row, slot]
    uv, theta5, near = domain.uv[found.sample[node]], found.rows[row], found.theta[node]
    low, high = np.maximum(span[:-1, 0], span[1:, 0]), np.minimum(span[:-1, 1], span[1:, 1])
    # theta4 crosses from node to node in the middle of where their intervals overlap. Each step
    # sweeps theta4 along the node's own row first, and then goes across.
    cross = np.concatenate([span[:1].mean(axis=1), (low + high) / 2.0])
    before = np.column_stack([uv[:-1], cross[:-1], theta5[:-1]])
    swept = np.column_stack([uv[:-1], cross[1:], theta5[:-1]])
    after = np.column_stack([uv[1:], cross[1:], theta5[1:]])
    part = np.arange(fine)[:, None] / fine
    legs = [a[:, None] + part * (b - a)[:, None] for a, b in ((before, swept), (swept, after))]
    samples = np.stack(legs, 1).reshape(-1, 4)
    samples = np.concatenate([samples, [[*uv[-1], cross[-1], theta5[-1]]]])
    places = samples[:, :2]
    steps = np.append(np.repeat(np.arange(len(node) - 1), 2 * fine), len(node) - 1)
    angles = arms(problem.targets(*places.T)[0])[np.arange(len(places)), found.branch[node[steps]]]
    angles = near[steps] + (angles - near[steps] + np.pi) % TAU - np.pi
    return Motion(places, np.column_stack([angles, samples[:, 2:]]))


def measure(problem: Problem, motion: Motion) -> Measured:
    """How much room a motion keeps; out of reach counts as no room in the cone."""
    points, approaches = problem.targets(*motion.uv.T)
    seen = in_link3(motion.q[:, :3], approaches)
    c4, s4 = np.cos(motion.q[:, 3]), np.sin(motion.q[:, 3])
    c5, s5 = np.cos(motion.q[:, 4]), np.sin(motion.q[:, 4])
    lean = -s5 * c4 * seen[:, 0] + c5 * seen[:, 1] + s5 * s4 * seen[:, 2]
    angle = np.arccos(np.clip(lean, -1.0, 1.0))
    angle = np.where((slack(points) >= 0.0).all(axis=-1), angle, np.inf)
    limits = problem.limits[:5]
    room = np.minimum(motion.q - limits[:, 0], limits[:, 1] - motion.q)
    jump = np.abs(np.diff(motion.q, axis=0)).max() if len(motion.q) > 1 else 0.0
    return Measured(
        float(np.radians(problem.cone_deg) - angle.max()), float(room.min()), float(jump)
    )
