"""One motion over all cells out of some of the motions that are known."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from feasibility.speed.rated_graph import Edge, RatedGraph


def route(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> list[int] | None:
    """Nodes of one motion over all cells, in order where they have one; None if there is none.

    Args:
        rated: the nodes.
        edges: the motions that may be used.
        begin: the node that it has to begin at; None for any.
    """
    graph = _graph(rated, edges, begin)
    if rated.cells.in_order:
        return _in_order(graph, rated.graph.cell, len(rated.cells), begin)
    best = _largest(graph, rated, begin)
    if len({rated.graph.cell[x] for x in best}) < len(rated.cells):
        return None
    return _visiting(graph, best, rated.graph.cell, min(best) if begin is None else begin)


def possible(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> bool:
    """Is there a `route`?"""
    if rated.cells.in_order:
        return route(rated, edges, begin) is not None
    return bool(covered(rated, edges, begin).all())


def _graph(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> nx.Graph:
    """The nodes, all or the first alone, and these motions."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(rated.graph.cell)) if begin is None else [begin])
    graph.add_edges_from(edges)
    return graph


def covered(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> NDArray[np.bool_]:
    """(N,) the most cells that one motion visits."""
    graph = _graph(rated, edges, begin)
    found = np.zeros(len(rated.cells), dtype=bool)
    if rated.cells.in_order:
        for last in range(len(rated.cells), 0, -1):
            if _in_order(graph, rated.graph.cell, last, begin) is not None:
                found[:last] = True
                break
        return found
    found[[rated.graph.cell[x] for x in _largest(graph, rated, begin)]] = True
    return found


def _largest(graph: nx.Graph, rated: RatedGraph, begin: int | None) -> set[int]:
    """The component over most cells, or that of a node."""
    if begin is not None:
        return set(nx.node_connected_component(graph, begin))
    parts = nx.connected_components(graph)

    def rank(part: set[int]) -> tuple[int, int]:
        return len({rated.graph.cell[x] for x in part}), -min(part)

    return max(parts, key=rank, default=set[int]())


def _visiting(graph: nx.Graph, part: set[int], cell: Sequence[int], begin: int) -> list[int]:
    """A motion over all cells of a component: on to the nearest one not yet visited."""
    beside = {x: sorted(graph.adj[x]) for x in part}
    missing = {cell[x] for x in part} - {cell[begin]}
    nodes = [begin]
    while missing:
        before: dict[int, int] = {nodes[-1]: -1}
        queue = deque([nodes[-1]])
        while queue:
            x = queue.popleft()
            if cell[x] in missing:
                break
            for y in beside[x]:
                if y not in before:
                    before[y] = x
                    queue.append(y)
        way = [x]
        while before[way[-1]] != nodes[-1]:
            way.append(before[way[-1]])
        nodes += way[::-1]
        missing -= {cell[y] for y in way}
    return nodes


def _in_order(
    graph: nx.Graph, cell: Sequence[int], count: int, begin: int | None
) -> list[int] | None:
    """A motion over the first `count` cells in their order: over each one in place, and onwards."""
    before: dict[int, int] = {}
    layer = [x for x in graph.nodes if cell[x] == 0] if begin is None else [begin]
    before |= dict.fromkeys(layer, -1)
    for here in range(count):
        queue = deque(layer)
        while queue:
            x = queue.popleft()
            for y in graph.neighbors(x):
                if cell[y] == here and y not in before:
                    before[y] = x
                    layer.append(y)
                    queue.append(y)
        if not layer:
            return None
        if here == count - 1:
            break
        ahead = []
        for x in layer:
            for y in graph.neighbors(x):
                if cell[y] == here + 1 and y not in before:
                    before[y] = x
                    ahead.append(y)
        layer = ahead
    way = [layer[0]]
    while before[way[-1]] >= 0:
        way.append(before[way[-1]])
    return way[::-1]
