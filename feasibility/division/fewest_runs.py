"""The fewest interruptions of a toolpath, over the configurations that are known.

A roadmap has nodes over the poses of the toolpath; a certified motion leads from a node to another
over the same pose or the next one. The tool may be lifted at any pose and set down at another node
over it, which is an interruption, and between two poses it may stay lifted, which leaves the piece
between them undone. The best runs are a shortest path by (undone length, runs, cuts inside a pass,
changes of posture in place, waypoints), in that order.
"""

from itertools import pairwise
from typing import NamedTuple

import networkx as nx
import numpy as np

from coverable.arrays import Array, Mask
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.ordered_run import steps_ahead

RESOLUTION = 1e-12  # [m] lengths are counted in this, so that equal sums are equal
# What one step costs, as digits of one number; all motions together have less than 64 bits.
CUT, RUN, UNDONE = 1 << 64, 1 << 96, 1 << 128


class Run(NamedTuple):
    """One run: from a node along motions."""

    start: int
    route: list[int]
    """The numbers of the edges + 1, negative where one is run backwards."""


def fewest_runs(roadmap: Roadmap, pieces: Array, inside: Mask) -> list[Run]:
    """The runs that leave least undone, the fewest of them, cut between passes where they can be.

    Args:
        roadmap: over N poses.
        pieces: (N - 1,) m, of the passes between poses; 0 where the tool need not work.
        inside: (N - 1,) whether both poses belong to one stretch of a pass.
    """
    steps, last = _steps(roadmap, pieces, inside), len(pieces)
    before, cost = nx.dijkstra_predecessor_and_distance(steps, -1)
    ends = [k for k in cost if k == -1 - last or (k >= 0 and roadmap.cell[k] == last)]
    path = [min(ends, key=lambda k: cost[k])]
    while before[path[-1]]:
        path.append(before[path[-1]][0])
    runs = list[Run]()
    for here, there in pairwise(reversed(path)):
        if number := steps[here][there]["number"]:
            runs[-1].route.append(number)
        elif there >= 0:  # the tool is set down here
            runs.append(Run(there, []))
    return [run for run in runs if run.route]


def _steps(roadmap: Roadmap, pieces: Array, inside: Mask) -> nx.DiGraph:
    """The steps from each state: a node, or -1 - i for the tool lifted over pose i.

    Each has a `weight`, and the signed `number` of the motion, or 0 for none.
    """
    steps, within = nx.DiGraph(), [*inside.tolist(), False]
    steps.add_node(-1)
    for (x, y), (cost, number) in steps_ahead(roadmap).items():
        steps.add_edge(x, y, number=number, weight=int(cost))
    for node, pose in enumerate(roadmap.cell):
        steps.add_edge(node, -1 - pose, number=0, weight=CUT * within[pose])
        steps.add_edge(-1 - pose, node, number=0, weight=RUN)
    for pose, undone in enumerate(np.round(pieces / RESOLUTION).tolist()):
        steps.add_edge(-1 - pose, -2 - pose, number=0, weight=UNDONE * int(undone))
    return steps
