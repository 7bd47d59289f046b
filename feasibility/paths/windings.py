"""Motions turned by whole turns of a joint, which are motions as well.

A joint that may run over more than a whole turn can do the same work from another turn. A path that
has got to the end of such a joint goes on if all of it is run one turn earlier.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from feasibility.paths.motion_graph import MotionNet

TURN = 2.0 * math.pi
MOST_TURNS = 2  # whole turns of one joint that are tried either way


def whole_turns(net: MotionNet, nodes: list[int]) -> list[NDArray[np.float64]]:
    """(n,) each, rad: turns of one joint that keep a motion from node to node inside the limits.

    Args:
        net: the known motions.
        nodes: nodes, consecutive ones joined by a motion.
    """
    lowest, highest = net.q[nodes[0]].copy(), net.q[nodes[0]].copy()
    for x, y in pairwise(nodes):
        np.minimum(lowest, net.links[x][y].min(axis=0), out=lowest)
        np.maximum(highest, net.links[x][y].max(axis=0), out=highest)
    lower, upper = net.problem.lower, net.problem.upper
    found = []
    for joint in np.flatnonzero(~net.problem.chain.prismatic):
        for times in range(1, MOST_TURNS + 1):
            for by in (-times * TURN, times * TURN):
                if lowest[joint] + by >= lower[joint] and highest[joint] + by <= upper[joint]:
                    turn = np.zeros(len(lowest))
                    turn[joint] = by
                    found.append(turn)
    return found


def turned(net: MotionNet, nodes: list[int], turn: NDArray[np.float64]) -> list[int]:
    """The nodes of the same motion turned, which is added to the net."""
    moved = [net.node(net.cell[x], net.q[x] + turn) for x in nodes]
    for (x, y), (a, b) in zip(pairwise(nodes), pairwise(moved), strict=True):
        net.link(a, b, net.links[x][y] + turn)
    return moved
