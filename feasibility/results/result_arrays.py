"""The arrays of a result file: graphs, and what identifies the robot and the cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints
from feasibility.results.archive import Archive, Fields
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    import networkx as nx


def ragged(name: str, rows: Sequence[Ints]) -> dict[str, NDArray]:
    """Arrays of cells as `name_lengths` and `name_values`."""
    return {
        f"{name}_lengths": np.array([len(row) for row in rows], dtype=np.int64),
        f"{name}_values": np.concatenate([np.empty(0, np.int64), *rows]).astype(np.int64),
    }


def unpack_ragged(archive: Archive, name: str, count: int) -> tuple[Ints, ...]:
    """The arrays of cells that `ragged` wrote.

    Raises:
        ArchiveError: they are damaged.
    """
    lengths = archive.array(f"{name}_lengths", np.int64, (None,))
    values = read_cells(archive, f"{name}_values", count)
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

    nodes = read_cells(archive, f"{name}_nodes", count)
    at = read_cells(archive, f"{name}_q_cell", count)
    q = archive.array(f"{name}_q", np.float64, (len(at), n))
    edges = read_cells(archive, f"{name}_edges", count, (None, 2))
    lengths = archive.array(f"{name}_motion_lengths", np.int64, (len(edges),))
    rows = archive.array(f"{name}_motions", np.float64, (None, n))
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
        graph.add_edge(a, b, **({"motion": motion} if len(motion) else {}))
    return graph


def read_cells(
    archive: Archive, name: str, count: int, shape: tuple[int | None, ...] = (None,), low: int = 0
) -> Ints:
    """An array of cells, each from `low` to `count` - 1.

    Raises:
        ArchiveError: it holds anything else.
    """
    cells = archive.array(name, np.int64, shape)
    if ((cells < low) | (cells >= count)).any():
        raise archive.error(f"{name!r} holds numbers that are no cells of {count}")
    return cells


def _cut(archive: Archive, name: str, lengths: Ints, values: NDArray) -> list[NDArray]:
    """Cut values into pieces of the given lengths, which must use them up."""
    limit = len(values)
    if ((lengths < 0) | (lengths > limit)).any() or sum(lengths.tolist()) != limit:
        raise archive.error(f"{name!r} does not fit the {limit} rows that there are")
    return np.split(values, np.cumsum(lengths)[:-1]) if len(lengths) else []


CLOSE = 1e-9  # [m], [1]: tool points, axes, centres and normals that count as the same


def probes(robot: Robot) -> Array:
    """(n + 4, 6) numbers that tell one arm from another: limits, tool points and axes.

    The limits fill the first n rows (2 of 6 columns, infinite ones as 0 with a flag beside them);
    tool points and axes at four configurations the rest.
    """
    from robots.kinematics import Kinematics

    n = robot.n
    low, high = np.clip(robot.lower, -3.0, 3.0), np.clip(robot.upper, -3.0, 3.0)
    limits = np.zeros((n, 6))
    for column, bound in enumerate((robot.lower, robot.upper)):
        limits[:, column] = np.where(np.isfinite(bound), bound, 0.0)
        limits[:, 2 + column] = np.isfinite(bound)
    share = np.modf(0.17 + 0.23 * np.arange(4)[:, None] + 0.31 * np.arange(n))[0]
    points, axes = Kinematics(robot).tools(low + share * (high - low))
    return np.vstack([limits, np.hstack([points, axes])])


def check_robot(robot: Robot, fields: Fields, archive: Archive) -> None:
    """Refuse a robot that is no longer the one that the result was found for."""
    same = fields.get("joints", list, "an array") == list(robot.joint_names)
    if same and fields.text("tool_frame") == robot.tool_frame:
        stored = archive.array("probes", np.float64, (robot.n + 4, 6))
        same = bool(np.abs(stored - probes(robot)).max() <= CLOSE)
    if not same:
        raise archive.error(
            f"was found for another {robot.name!r} than the one that is loaded now (its joints, "
            "limits or geometry have changed); run the check again"
        )


def places(cells: Cells) -> Array:
    """(N, 6) centre (m) and outward normal of each cell."""
    return np.hstack([cells.centres, cells.normals])


def check_cells(cells: Cells, label: str, archive: Archive) -> None:
    """Refuse cells that are not the ones that the result was found for.

    A mesh file may have changed since, and so may how surfaces are cut.

    Args:
        cells: as the case makes them now.
        label: what the surface is called.
        archive: the file, with the array `places`.

    Raises:
        ArchiveError: they differ.
    """
    stored = archive.array("places", np.float64, (None, 6))
    if stored.shape != (len(cells), 6):
        how = f"has {len(cells):,} cells now, and had {len(stored):,} then"
    elif len(stored) and np.abs(stored - places(cells)).max() > CLOSE:
        how = "has its cells in other places now"
    else:
        return
    raise archive.error(
        f"was found for another surface than the one that is loaded now: {label} {how}; run the "
        "check again"
    )
