"""The fewest interruptions of a toolpath, over the configurations that are known.

Stations lie along the toolpath in its order. Over each are nodes, configurations that a search
found; a certified motion leads from a node to another over the same station or the next one. The
tool may be lifted at any station and set down at another node over it, which is an interruption,
and between two stations it may stay lifted, which leaves the piece between them undone. The best
runs are a shortest path by (undone length, runs, cuts inside a pass, waypoints), in that order.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask

RESOLUTION = 1e-12  # [m] lengths are counted in this, so that equal sums are equal
# What one step costs, as digits of one number; none of them has more than 32 bits in all.
CUT, RUN, UNDONE = 1 << 32, 1 << 64, 1 << 96

Step = tuple[int, int, int]
"""Where to, the signed number of the motion or 0 for none, and the cost."""


class Stations(NamedTuple):
    """What is known of a toolpath."""

    over: Ints
    """(nodes,) the station of each node."""
    steps: Ints
    """(E, 4) from a node to another over the same station or the next, the signed number of the
    motion, and how many waypoints it has."""
    pieces: Array
    """(N - 1,) m, of the passes between stations; 0 where the tool need not work."""
    inside: Mask
    """(N - 1,) whether both stations belong to one stretch of a pass."""

    @property
    def number(self) -> int:
        """N, of the stations."""
        return len(self.pieces) + 1


class Run(NamedTuple):
    """One run: from a node along motions."""

    nodes: tuple[int, ...]
    route: tuple[int, ...]
    """The signed numbers of the motions, one fewer than nodes."""


def fewest_runs(stations: Stations) -> tuple[Run, ...]:
    """The runs that leave least undone, the fewest of them, cut between passes where they can be.

    Numbers of nodes are rows of `stations.over`.
    """
    cost, before = _cheapest(_steps(stations), -1)
    last = stations.number - 1
    ends = [k for k in cost if k == -1 - last or (k >= 0 and stations.over[k] == last)]
    here = min(ends, key=lambda k: cost[k])
    path = list[tuple[int, int]]()
    while here in before:
        there, number = before[here]
        path.append((here, number))
        here = there
    runs = list[tuple[list[int], list[int]]]()
    for state, number in reversed(path):
        if number:
            runs[-1][0].append(state)
            runs[-1][1].append(number)
        elif state >= 0:  # the tool is set down here
            runs.append(([state], []))
    return tuple(Run(tuple(nodes), tuple(route)) for nodes, route in runs if route)


def _steps(stations: Stations) -> dict[int, list[Step]]:
    """The steps from each state: a node, or -1 - i for the tool lifted over station i."""
    over, inside = stations.over.tolist(), [*stations.inside.tolist(), False]
    steps: dict[int, list[Step]] = {k: [] for k in range(-stations.number, len(over))}
    for x, y, number, rows in stations.steps.tolist():
        steps[x].append((y, number, rows))
    for node, station in enumerate(over):
        steps[node].append((-1 - station, 0, CUT * inside[station]))
        steps[-1 - station].append((node, 0, RUN))
    for station, undone in enumerate(np.round(stations.pieces / RESOLUTION).tolist()):
        steps[-1 - station].append((-2 - station, 0, UNDONE * int(undone)))
    return steps


def _cheapest(
    steps: dict[int, list[Step]], start: int
) -> tuple[dict[int, int], dict[int, tuple[int, int]]]:
    """The least cost of each state, and the state and the motion before it (Dijkstra)."""
    cost, before = {start: 0}, dict[int, tuple[int, int]]()
    queue = [(0, start)]
    while queue:
        spent, here = heapq.heappop(queue)
        if spent > cost[here]:
            continue
        for there, number, more in steps[here]:
            if there not in cost or spent + more < cost[there]:
                cost[there], before[there] = spent + more, (here, number)
                heapq.heappush(queue, (spent + more, there))
    return cost, before
