"""The motion over most cells out of some of those that are known: they make a roadmap."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Mask
from feasibility.demands.rated_graph import Edge, RatedGraph
from feasibility.paths.motion_graph import MotionGraph
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.ordered_run import layers_of
from feasibility.roadmap.walk import covering_walk, route_walk
from feasibility.verdict import Walk
from surfaces.adjacency import components


class BestMotion(NamedTuple):
    """A motion over as many cells as some motions allow."""

    covered: Mask
    """(N,) the cells that it visits."""
    walk: Callable[[], Walk]
    """Makes it."""


def best_motion(rated: RatedGraph, edges: Sequence[Edge]) -> BestMotion:
    """The best motion made of some, from the start of the arm on where it has one.

    Cells that have an order are visited in it.
    """
    cells, begin = len(rated.cells), rated.begin
    roadmap = roadmap_of(rated.graph, range(len(rated.graph.cell)), edges, cells)
    if rated.cells.in_order:
        run = layers_of(roadmap, begin)
        over = np.arange(cells) <= run.furthest
        return BestMotion(over, lambda: route_walk(roadmap, run.start, run.route))
    root = roadmap.largest if begin is None else roadmap.root_of(begin)
    return BestMotion(roadmap.cover[root], lambda: covering_walk(roadmap, root, begin))


def roadmap_of(
    graph: MotionGraph, nodes: Iterable[int], edges: Sequence[Edge], cells: int
) -> Roadmap:
    """A roadmap of some nodes, numbered in this order, and motions between them.

    Each connected part is a component, and no node is queued.
    """
    number = {node: k for k, node in enumerate(nodes)}
    ends = np.array([(number[x], number[y]) for x, y in edges], dtype=np.int64).reshape(-1, 2)
    part = components(ends, len(number)).tolist()
    roadmap = Roadmap(cells)
    for _ in range(max(part, default=-1) + 1):
        roadmap.add_component()
    for node, root in zip(number, part, strict=True):
        q = graph.q[node]
        roadmap.add_node(graph.cell[node], q, np.zeros_like(q), root)
    for x, y in edges:
        roadmap.add_edge(number[x], number[y], graph.motion(x, y)[1:])
    roadmap.largest = int(np.argmax([*roadmap.size, 0]))
    roadmap.queue.clear()
    return roadmap
