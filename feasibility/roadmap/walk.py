"""Covering walks: edges of one component in a row, one continuous motion over its cells.

The walk goes to the nearest cell that it has not visited, and among equally near ones by
Warnsdorff's rule. The witness repeats stored edges.
"""

from collections.abc import Sequence

import numpy as np

from coverable.arrays import Mask
from feasibility.roadmap.graph import Roadmap
from feasibility.verdict import Walk

Links = dict[int, list[tuple[int, int]]]
"""Steps from each node of a component: the node that a motion leads to, and its edge + 1, negative
where the motion is run backwards."""


def links_of(roadmap: Roadmap, component: int) -> Links:
    """The motions inside a root component."""
    nodes = range(len(roadmap.cell))
    links: Links = {node: [] for node in nodes if roadmap.root_of(node) == component}
    for edge, (x, y, _) in enumerate(roadmap.edges):
        if x in links:
            links[x].append((y, edge + 1))
            links[y].append((x, -edge - 1))
    return links


def _to_nearest(
    roadmap: Roadmap, links: Links, wanted: set[int], here: int, first: bool
) -> tuple[list[int], int | None]:
    """Signed edges of a shortest path to a node over a wanted cell, and that node.

    Among equally near nodes the one with the fewest steps to wanted cells is taken (Warnsdorff's
    rule, so that corners are not left behind).

    Args:
        roadmap, links: the roadmap, and the motions of the component.
        wanted: cells.
        here: the node where the path begins.
        first: take the first node found that is more than one edge away, without the rule.

    Returns:
        No edges and None where there is no such node.
    """
    came: dict[int, tuple[int, int]] = {here: (here, 0)}
    ring, found, fewest = [here], None, np.inf
    while ring and found is None:
        further = list[int]()
        for x in ring:
            for y, edge in links[x]:
                if y in came:
                    continue
                came[y] = x, edge
                further.append(y)
                if roadmap.cell[y] in wanted:
                    far = first and x != here
                    open_ends = -1 if far else sum(roadmap.cell[z] in wanted for z, _ in links[y])
                    if open_ends < fewest:
                        found, fewest = y, open_ends
        ring = further
    path, x = list[int](), here if found is None else found
    while x != here:
        x, edge = came[x]
        path.append(edge)
    return path[::-1], found


def _route(roadmap: Roadmap, links: Links, wanted: set[int], start: int, first: bool) -> list[int]:
    """Signed edges of a walk from a node through the wanted cells, always to the nearest one.

    Cells are taken out of `wanted` where the walk passes; those that no motion leads to stay.
    """
    route, here = list[int](), start
    while True:
        wanted.discard(roadmap.cell[here])
        path, there = _to_nearest(roadmap, links, wanted, here, first) if wanted else ([], None)
        if there is None:
            return route
        route += path
        here = there


def covering_walk(roadmap: Roadmap, component: int, start: int | None = None) -> Walk:
    """One continuous motion through every cell that a root component covers, at least one.

    It begins at the node `start`, at any by default; consecutive waypoints lie on certified
    segments of the roadmap's edges.
    """
    links = links_of(roadmap, component)
    if start is None:  # a node with the fewest steps: corners are best visited first
        start = min(links, key=lambda node: len(links[node]))
    wanted = set(np.flatnonzero(roadmap.cover[component]).tolist())
    return route_walk(roadmap, start, _route(roadmap, links, wanted, start, True))


def route_walk(roadmap: Roadmap, start: int, route: Sequence[int]) -> Walk:
    """The motion from a node along a route.

    The route is of edges + 1, negative where one is run backwards, each from the end of the last.
    """
    q, cell = [roadmap.q[start][None]], [roadmap.cell[start]]
    for step in route:
        x, y, _ = roadmap.edges[abs(step) - 1]
        motion, node = roadmap.motion(abs(step) - 1), y
        if step < 0:
            motion, node = motion[::-1], x
        q.append(motion[1:])
        cell += [-1] * (len(motion) - 2) + [roadmap.cell[node]]
    return Walk(np.vstack(q), np.array(cell, dtype=np.int64))


def patch_walk(roadmap: Roadmap, links: Links, wanted: Mask, start: int) -> Walk:
    """One continuous motion through the wanted cells: the motion that covers one patch.

    It may lead over any cell of the component; only the wanted ones have to be visited.

    Args:
        roadmap, links: the roadmap, and the motions of the component.
        wanted: (N,) cells to visit; the component covers them.
        start: a node of the component over a wanted cell.

    Raises:
        ValueError: the component does not reach a wanted cell.
    """
    left = set(np.flatnonzero(wanted).tolist())
    route = _route(roadmap, links, left, start, False)
    if left:
        raise ValueError(f"no motion of the component leads to cell {min(left)}")
    return route_walk(roadmap, start, route)
