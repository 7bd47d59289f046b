"""One motion over all cells out of some of the motions that are known."""

from collections.abc import Iterable, Iterator, Sequence

import networkx as nx
import numpy as np

from coverable.arrays import Mask
from feasibility.demands.rated_graph import Edge, RatedGraph


def route(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> list[int] | None:
    """Nodes of one motion over all cells, in order where they have one; None if there is none.

    Only some motions (`edges`) may be used; it begins at the node `begin`, or anywhere.
    """
    graph = _graph(rated, edges, begin)
    if rated.cells.in_order:
        count, nodes = _in_order(graph, rated.graph.cell, begin)
        return nodes if count == len(rated.cells) else None
    best = _largest(graph, rated, begin)
    if len({rated.graph.cell[x] for x in best}) < len(rated.cells):
        return None
    return _visiting(graph, best, rated.graph.cell, min(best) if begin is None else begin)


def _graph(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> nx.Graph:
    """The nodes, all or the first alone, and these motions."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(rated.graph.cell)) if begin is None else [begin])
    graph.add_edges_from(edges)
    return graph


def covered(rated: RatedGraph, edges: Iterable[Edge], begin: int | None) -> Mask:
    """(N,) the most cells that one motion visits."""
    graph, cell = _graph(rated, edges, begin), rated.graph.cell
    found = np.zeros(len(rated.cells), dtype=bool)
    if rated.cells.in_order:
        found[: _in_order(graph, cell, begin)[0]] = True
    else:
        found[[cell[x] for x in _largest(graph, rated, begin)]] = True
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
    missing = {cell[x] for x in part} - {cell[begin]}
    nodes = [begin]
    while missing:
        before: dict[int, int] = {}
        for x, y in nx.bfs_edges(graph, nodes[-1], sort_neighbors=sorted):
            before[y] = x
            if cell[y] in missing:
                break
        path = _back(before, y)[1:]
        nodes += path
        missing -= {cell[y] for y in path}
    return nodes


def _in_order(graph: nx.Graph, cell: Sequence[int], begin: int | None) -> tuple[int, list[int]]:
    """Run over the cells in their order, over each one in place and onwards, as far as that goes.

    Returns:
        How many cells are reached, and the nodes of a motion over these.
    """
    layer = [x for x in graph.nodes if cell[x] == 0] if begin is None else [begin]
    before, seen = dict[int, int](), set(layer)

    def reached(nodes: Iterable[int], over: int) -> Iterator[int]:
        """Nodes over a cell that motions lead to for the first time."""
        for x in nodes:
            for y in graph.neighbors(x):
                if cell[y] == over and y not in seen:
                    seen.add(y)
                    before[y] = x
                    yield y

    count, nodes = 0, list[int]()
    while layer:
        for x in layer:  # which grows
            layer += reached([x], count)
        nodes, count = layer, count + 1
        layer = list(reached(nodes, count))
    return count, _back(before, nodes[0]) if nodes else []


def _back(before: dict[int, int], end: int) -> list[int]:
    """The path to a node, by the node before each."""
    path = [end]
    while path[-1] in before:
        path.append(before[path[-1]])
    return path[::-1]
