"""A walk over some of the cells of a component: the motion that paints one patch.

The motion may lead over any cell of the component; only the wanted ones have to be visited.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.graph import EDGES, NODES, Roadmap
from feasibility.roadmap.walk import edge_motion
from feasibility.verdict import Walk

Step = tuple[int, int]
"""An edge, and the node that it leads to."""


@dataclass(frozen=True, eq=False, slots=True)
class Links:
    """The motions of one component."""

    roadmap: Roadmap
    nodes: NDArray[np.int64]
    """(k,) the nodes of the component."""
    steps: dict[int, list[Step]]
    """Ways on from each node."""


def links_of(roadmap: Roadmap, component: int) -> Links:
    """The motions inside a component.

    Args:
        roadmap: the roadmap.
        component: a root component.
    """
    root = np.array(roadmap.parent)
    while not np.array_equal(root, root[root]):
        root = root[root]
    owner = root[roadmap.component[: roadmap.counters[NODES]]]
    nodes = np.flatnonzero(owner == component)
    steps: dict[int, list[Step]] = {x: [] for x in nodes.tolist()}
    ends = roadmap.ends[: roadmap.counters[EDGES]]
    for e in np.flatnonzero(owner[ends[:, 0]] == component).tolist():
        x, y = ends[e].tolist()
        steps[x].append((e, y))
        steps[y].append((e, x))
    return Links(roadmap, nodes, steps)


def patch_walk(links: Links, wanted: NDArray[np.bool_], start: int) -> Walk:
    """One continuous motion through the wanted cells.

    Steps to the nearest node over a cell that is still wanted; of several, to the one that has the
    fewest such neighbours itself (Warnsdorff's rule, so that corners are not left behind).

    Args:
        links: the motions of the component.
        wanted: (N,) cells to visit; the component covers them.
        start: a node of the component over a wanted cell.

    Returns:
        The walk; consecutive waypoints lie on certified segments of the roadmap's edges.

    Raises:
        ValueError: the component does not reach a wanted cell.
    """
    cell = links.roadmap.cell
    left = set(np.flatnonzero(wanted).tolist())
    left.discard(int(cell[start]))
    here, route = start, list[Step]()
    while left:
        way = _nearest(links, here, left)
        if not way:
            raise ValueError(f"no motion of the component leads to cell {min(left)}")
        route += way
        here = way[-1][1]
        left -= {int(cell[y]) for _, y in way}
    return _strung(links.roadmap, start, route)


def _nearest(links: Links, here: int, left: set[int]) -> list[Step]:
    """Steps from a node to the best of the nearest ones over cells in `left`; empty if none."""
    cell = links.roadmap.cell
    came: dict[int, tuple[int, int]] = {here: (-1, -1)}
    ring = deque([here])
    while ring:
        found, further = [], deque[int]()
        for x in ring:
            for e, y in links.steps[x]:
                if y in came:
                    continue
                came[y] = (e, x)
                further.append(y)
                if int(cell[y]) in left:
                    found.append(y)
        if found:
            y = min(found, key=lambda y: sum(int(cell[z]) in left for _, z in links.steps[y]))
            way = list[Step]()
            while y != here:
                e, x = came[y]
                way.append((e, y))
                y = x
            return way[::-1]
        ring = further
    return []


def _strung(roadmap: Roadmap, start: int, route: list[Step]) -> Walk:
    """Waypoints and cell marks of a route."""
    rows, marks = [roadmap.q[start][None]], [np.array([roadmap.cell[start]])]
    here = start
    for e, y in route:
        motion = edge_motion(roadmap, e)
        if roadmap.ends[e, 0] != here:
            motion = motion[::-1]
        rows.append(motion[1:])
        mark = np.full(len(motion) - 1, -1, dtype=np.int64)
        mark[-1] = roadmap.cell[y]
        marks.append(mark)
        here = y
    return Walk(q=np.vstack(rows), cell=np.concatenate(marks))
