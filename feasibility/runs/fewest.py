"""The fewest interruptions of a toolpath, over the configurations that are known.

Stations stand along the toolpath in its order. Over each are nodes, configurations that a search
found; a certified motion leads from a node to another over the same station or the next one. The
tool may be lifted at any station and set down at another node over it, which is an interruption,
and between two stations it may stay lifted, which leaves the piece between them undone. The best
way is a shortest path by (undone length, runs, cuts inside a pass, waypoints), in that order.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Cost = tuple[float, int, int, int]
NOTHING: Cost = (0.0, 0, 0, 0)
GRAIN = 1e-12  # [m] lengths are counted in this, so that equal sums are equal


class Stations(NamedTuple):
    """What is known of a toolpath."""

    over: NDArray[np.int64]
    """(nodes,) the station of each node."""
    steps: NDArray[np.int64]
    """(E, 4) from a node to another over the same station or the next, the signed number of the
    motion, and how many waypoints it has."""
    pieces: NDArray[np.float64]
    """(N - 1,) m, of the passes between stations; 0 where the tool need not work."""
    inside: NDArray[np.bool_]
    """(N - 1,) whether both stations belong to one stretch of a pass."""

    @property
    def number(self) -> int:
        """N, of the stations."""
        return len(self.pieces) + 1


class Way(NamedTuple):
    """One run: from a node along motions."""

    nodes: tuple[int, ...]
    route: tuple[int, ...]
    """The signed numbers of the motions, one fewer than nodes."""


def fewest_ways(stations: Stations) -> tuple[Way, ...]:
    """The runs that leave least undone, the fewest of them, cut between passes where they can be.

    Args:
        stations: what is known; numbers of nodes are rows of `over`.
    """
    cost, came = _shortest(stations)
    last = -stations.number  # lifted over the last station
    ends = [k for k in cost if k == last or (k >= 0 and stations.over[k] == stations.number - 1)]
    here = min(ends, key=lambda k: cost[k])
    ways, nodes, route = list[Way](), list[int](), list[int]()
    while True:
        step = came.get(here)
        if here >= 0:
            nodes.append(here)
        if here >= 0 and (step is None or step[0] < 0):  # it was set down here
            ways.append(Way(tuple(reversed(nodes)), tuple(reversed(route))))
            nodes, route = [], []
        if step is None:
            break
        before, number = step
        if before >= 0 and here >= 0:
            route.append(number)
        here = before
    return tuple(way for way in reversed(ways) if len(way.nodes) > 1)


def _shortest(stations: Stations) -> tuple[dict[int, Cost], dict[int, tuple[int, int]]]:
    """Dijkstra's algorithm over nodes, and -1 - i for the lifted tool over station i."""
    following = _following(stations)
    over_station: list[list[int]] = [[] for _ in range(stations.number)]
    for node, station in enumerate(stations.over.tolist()):
        over_station[station].append(node)
    pieces = np.round(stations.pieces / GRAIN).tolist()
    inside = [*stations.inside.tolist(), False]
    station_of = stations.over.tolist()
    cost: dict[int, Cost] = {-1: NOTHING}
    came: dict[int, tuple[int, int]] = {}
    queue: list[tuple[Cost, int]] = [(NOTHING, -1)]
    done = set[int]()
    while queue:
        spent, here = heapq.heappop(queue)
        if here in done:
            continue
        done.add(here)
        for there, number, more in _steps(
            here, following, over_station, station_of, pieces, inside
        ):
            total = (
                spent[0] + more[0], spent[1] + more[1], spent[2] + more[2], spent[3] + more[3],
            )  # fmt: skip
            if there not in cost or total < cost[there]:
                cost[there] = total
                came[there] = here, number
                heapq.heappush(queue, (total, there))
    return cost, came


def _steps(
    here: int,
    following: list[list[tuple[int, int, int]]],
    over_station: list[list[int]],
    station_of: list[int],
    pieces: list[float],
    inside: list[bool],
) -> list[tuple[int, int, Cost]]:
    """Where one can go from a state: the state, the motion's number or 0, and what it costs."""
    if here >= 0:
        station = station_of[here]
        found = [(y, number, (0.0, 0, 0, rows)) for y, number, rows in following[here]]
        return [*found, (-1 - station, 0, (0.0, 0, int(inside[station]), 0))]
    station = -1 - here
    found = [(node, 0, (0.0, 1, 0, 0)) for node in over_station[station]]
    if station < len(pieces):
        found.append((here - 1, 0, (pieces[station], 0, 0, 0)))
    return found


def _following(stations: Stations) -> list[list[tuple[int, int, int]]]:
    """From each node those it leads to, with the motion's number and its waypoints."""
    found: list[list[tuple[int, int, int]]] = [[] for _ in range(len(stations.over))]
    for x, y, number, rows in stations.steps.tolist():
        found[x].append((y, number, rows))
    return found
