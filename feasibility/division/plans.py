"""From components to plans: cells shared out, walks for every patch, the moves between them.

Several components may cover the cells of a patch; they differ in how the arm holds itself. A patch
gets walks of some of them, each from several starts, and the itinerary picks those between which
the arm has to move least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification import replay
from feasibility.division.components import connect_pairs, cover_table
from feasibility.division.connected_labels import count_of
from feasibility.division.division import Plan, SubPatch
from feasibility.division.partition import Partition, fewest_patches
from feasibility.division.reconfiguration import itinerary
from feasibility.roadmap import Exploration, Links, links_of, patch_walk
from feasibility.task import Task
from feasibility.verdict import Walk

MOST_COMPONENTS = 4  # components that walks of one patch are made of
MOST_NEAR = 3  # starts of one component's walks that are near other patches


@dataclass(frozen=True, eq=False, slots=True)
class _Option:
    """A component that covers one patch, and where walks over the patch may begin."""

    patch: int
    wanted: NDArray[np.bool_]
    """(N,) cells of the patch."""
    links: Links
    nodes: NDArray[np.int64]
    """Nodes of the component over these cells."""
    q: NDArray[np.float64]
    """Their configurations."""


def plans(exploration: Exploration, task: Task) -> tuple[Plan, Plan]:
    """The plan with the fewest motions, and the one with connected patches (maybe the same)."""
    roots, covers = cover_table(exploration)
    cover = fewest_patches(
        covers, np.ones(len(exploration.cells), dtype=bool), exploration.cells.pairs
    )
    fewest = plan_of(exploration, task, cover.fewest, roots, covers)
    if cover.connected is cover.fewest:
        return fewest, fewest
    return fewest, plan_of(exploration, task, cover.connected, roots, covers)


def plan_of(
    exploration: Exploration,
    task: Task,
    partition: Partition,
    roots: list[int],
    covers: NDArray[np.bool_],
) -> Plan:
    """Walks for every patch, in the best order, each replayed.

    Args:
        exploration: the search.
        task: the task.
        partition: the patches.
        roots: the K components that `partition.rows` counts.
        covers: (K, N) the cells that each covers.
    """
    robot, cells = exploration.robot, exploration.cells
    if len(partition) == 0:
        return Plan((), (), partition.bound)
    wanted = [partition.patch == p for p in range(len(partition))]
    chosen = itinerary(robot, _choices(exploration, wanted, roots, covers))
    patches = []
    for p, walk in zip(chosen.order, chosen.walks, strict=True):
        mine = wanted[p]
        replayed = replay(robot, cells, task, walk, mine)
        patches.append(
            SubPatch(
                cells=np.flatnonzero(mine),
                area=float(cells.areas[mine].sum()),
                pieces=count_of(np.where(mine, 0, -1), cells.pairs),
                walk=walk,
                certificate=replayed.certificate,
                refusal=replayed.refusal,
            )
        )
    return Plan(tuple(patches), chosen.moves, partition.bound)


def _choices(
    exploration: Exploration,
    wanted: Sequence[NDArray[np.bool_]],
    roots: list[int],
    covers: NDArray[np.bool_],
) -> list[list[Walk]]:
    """For each patch walks of the components that cover it, from several starts."""
    fitting = []
    for mine in wanted:
        rows = np.flatnonzero(covers[:, mine].all(axis=1))
        most = MOST_COMPONENTS if len(wanted) > 1 else 1
        fitting.append([roots[row] for row in rows[:most].tolist()])
        for component in fitting[-1]:
            connect_pairs(exploration, component, mine)
    roadmap = exploration.roadmap
    links = {root: links_of(roadmap, root) for root in {r for own in fitting for r in own}}
    options = []
    for p, (mine, own) in enumerate(zip(wanted, fitting, strict=True)):
        for component in own:
            nodes = np.flatnonzero(links[component].inside)
            nodes = nodes[mine[roadmap.cell[nodes]]]
            options.append(_Option(p, mine, links[component], nodes, roadmap.q[nodes]))
    choices: list[list[Walk]] = [[] for _ in wanted]
    for option, starts in zip(options, _starts(options), strict=True):
        choices[option.patch] += [
            patch_walk(roadmap, option.links, option.wanted, start) for start in starts
        ]
    return choices


def _starts(options: Sequence[_Option]) -> list[list[int]]:
    """Nodes that are worth starting the walks of each option from.

    One is a node with the fewest edges, because corners are best begun with. The others come
    nearest to a node of another patch, so that the arm need not move far from one to the next.
    """
    from scipy.spatial import cKDTree

    trees = [cKDTree(option.q) for option in options]
    result = []
    for option in options:
        degrees = np.diff(option.links.indptr)[option.nodes]
        starts = [int(option.nodes[np.argmin(degrees)])]
        near = []
        for other, tree in zip(options, trees, strict=True):
            if other.patch != option.patch:
                distance, _ = tree.query(option.q, p=np.inf)
                near.append((float(distance.min()), int(option.nodes[np.argmin(distance)])))
        starts += [x for _, x in sorted(near)[:MOST_NEAR]]
        result.append(list(dict.fromkeys(starts)))
    return result
