"""The fewest interruptions of a toolpath, over the configurations that are known.

Stations lie along the toolpath in its order. Over each are nodes, configurations that a search
found; a certified motion leads from a node to another over the same station or the next one. The
tool may be lifted at any station and set down at another node over it, which is an interruption,
and between two stations it may stay lifted, which leaves the piece between them undone. The best
runs are a shortest path by (undone length, runs, cuts inside a pass, waypoints), in that order.
"""

from itertools import pairwise
from typing import NamedTuple

import networkx as nx
import numpy as np

from coverable.arrays import Array, Ints, Mask

RESOLUTION = 1e-12  # [m] lengths are counted in this, so that equal sums are equal
# What one step costs, as digits of one number; none of them has more than 32 bits in all.
CUT, RUN, UNDONE = 1 << 32, 1 << 64, 1 << 96


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
    steps = _steps(stations)
    before, cost = nx.dijkstra_predecessor_and_distance(steps, -1)
    last = stations.number - 1
    ends = [k for k in cost if k == -1 - last or (k >= 0 and stations.over[k] == last)]
    path = [min(ends, key=lambda k: cost[k])]
    while before[path[-1]]:
        path.append(before[path[-1]][0])
    runs = list[tuple[list[int], list[int]]]()
    for here, there in pairwise(reversed(path)):
        if number := steps[here][there]["number"]:
            runs[-1][0].append(there)
            runs[-1][1].append(number)
        elif there >= 0:  # the tool is set down here
            runs.append(([there], []))
    return tuple(Run(tuple(nodes), tuple(route)) for nodes, route in runs if route)


def _steps(stations: Stations) -> nx.DiGraph:
    """The steps from each state: a node, or -1 - i for the tool lifted over station i.

    Each has a `weight`, and the signed `number` of the motion, or 0 for none.
    """
    inside = [*stations.inside.tolist(), False]
    steps = nx.DiGraph()
    steps.add_node(-1)
    for x, y, number, rows in sorted(stations.steps.tolist(), key=lambda row: -row[3]):
        steps.add_edge(x, y, number=number, weight=rows)  # of several the shortest stays
    for node, station in enumerate(stations.over.tolist()):
        steps.add_edge(node, -1 - station, number=0, weight=CUT * inside[station])
        steps.add_edge(-1 - station, node, number=0, weight=RUN)
    for station, undone in enumerate(np.round(stations.pieces / RESOLUTION).tolist()):
        steps.add_edge(-1 - station, -2 - station, number=0, weight=UNDONE * int(undone))
    return steps
