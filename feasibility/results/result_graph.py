"""Graphs and lists of arrays as flat arrays of a result file, and back with every index checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from feasibility.results.archive import Archive

if TYPE_CHECKING:
    import networkx as nx


def ragged(name: str, rows: Sequence[NDArray[np.int64]]) -> dict[str, NDArray]:
    """Arrays of cells as `name_lengths` and `name_values`."""
    return {
        f"{name}_lengths": np.array([len(row) for row in rows], dtype=np.int64),
        f"{name}_values": np.concatenate([np.empty(0, np.int64), *rows]).astype(np.int64),
    }


def unpack_ragged(archive: Archive, name: str, count: int) -> tuple[NDArray[np.int64], ...]:
    """The arrays of cells that `ragged` wrote.

    Raises:
        ArchiveError: they are damaged.
    """
    lengths = archive.array(f"{name}_lengths", np.int64, (None,))
    values = archive.array(f"{name}_values", np.int64, (None,))
    _check_cells(archive, f"{name}_values", values, count)
    return tuple(_cut(archive, f"{name}_lengths", lengths, values))


def pack_graph(name: str, graph: nx.Graph, n: int) -> dict[str, NDArray]:
    """Nodes, their configurations, edges, and the motions along them.

    Args:
        name: front part of the arrays' names.
        graph: nodes are cells, with `q` (n,) or None; edges may have `motion` (k, n).
        n: number of joints.
    """
    with_q = [(cell, q) for cell, q in graph.nodes(data="q") if q is not None]
    edges = list(graph.edges(data="motion"))
    motions = [np.empty((0, n)) if motion is None else motion for _, _, motion in edges]
    ends = [(a, b) if graph.is_directed() else (min(a, b), max(a, b)) for a, b, _ in edges]
    return {
        f"{name}_nodes": np.array(list(graph.nodes), dtype=np.int64),
        f"{name}_q_cell": np.array([cell for cell, _ in with_q], dtype=np.int64),
        f"{name}_q": np.array([q for _, q in with_q], dtype=float).reshape(-1, n),
        f"{name}_edges": np.array(ends, dtype=np.int64).reshape(-1, 2),
        f"{name}_motion_lengths": np.array([len(motion) for motion in motions], dtype=np.int64),
        f"{name}_motions": np.concatenate([np.empty((0, n)), *motions]),
    }


def unpack_graph(archive: Archive, name: str, count: int, n: int, tree: bool = False) -> Any:
    """The graph that `pack_graph` wrote.

    Args:
        archive: the file.
        name: front part of the arrays' names.
        count: number of cells.
        n: number of joints.
        tree: make a directed graph.

    Raises:
        ArchiveError: it is damaged.
    """
    import networkx as nx

    nodes = archive.array(f"{name}_nodes", np.int64, (None,))
    at = archive.array(f"{name}_q_cell", np.int64, (None,))
    q = archive.array(f"{name}_q", np.float64, (len(at), n))
    edges = archive.array(f"{name}_edges", np.int64, (None, 2))
    lengths = archive.array(f"{name}_motion_lengths", np.int64, (len(edges),))
    rows = archive.array(f"{name}_motions", np.float64, (None, n))
    for part, cells in (("nodes", nodes), ("q_cell", at), ("edges", edges)):
        _check_cells(archive, f"{name}_{part}", cells, count)
    if not tree and not np.array_equal(np.sort(nodes), np.arange(count)):
        raise archive.error(f"'{name}_nodes' does not hold every cell once")
    if not np.isin(edges, nodes).all() or not np.isin(at, nodes).all():
        raise archive.error(f"'{name}_edges' or '{name}_q_cell' names cells that are no nodes")
    if (edges[:, 0] == edges[:, 1]).any() or (not tree and (edges[:, 0] > edges[:, 1]).any()):
        raise archive.error(f"'{name}_edges' holds pairs that are no edges")
    graph: nx.Graph = nx.DiGraph() if tree else nx.Graph()
    graph.add_nodes_from(nodes.tolist(), q=None)
    for cell, row in zip(at.tolist(), q, strict=True):
        graph.nodes[cell]["q"] = row
    motions = _cut(archive, f"{name}_motion_lengths", lengths, rows)
    for (a, b), motion in zip(edges.tolist(), motions, strict=True):
        if len(motion):
            graph.add_edge(a, b, motion=motion)
        else:
            graph.add_edge(a, b)
    return graph


def _check_cells(archive: Archive, name: str, cells: NDArray[np.int64], count: int) -> None:
    """Refuse numbers that are no cells."""
    if ((cells < 0) | (cells >= count)).any():
        raise archive.error(f"{name!r} holds numbers that are no cells of {count}")


def _cut(archive: Archive, name: str, lengths: NDArray[np.int64], values: NDArray) -> list[NDArray]:
    """Cut values into pieces of the given lengths, which must use them up."""
    limit = len(values)
    if ((lengths < 0) | (lengths > limit)).any() or sum(lengths.tolist()) != limit:
        raise archive.error(f"{name!r} does not fit the {limit} rows that there are")
    return np.split(values, np.cumsum(lengths)[:-1]) if len(lengths) else []
