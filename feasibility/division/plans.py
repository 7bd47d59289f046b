"""From components to a plan: cells shared out, walks for every patch, the moves between them.

A verdict's search works on its largest components. A division goes on with the components that the
best cover of all reached cells uses: cells that only some of them reach are seeded, and each two of
them may join, until the cover has no fewer components, and none covers more, for some rounds.

Several components may cover the cells of a patch; they differ in how the arm holds itself. A patch
gets walks of some of them, each from several starts, and the itinerary picks those between which
the arm has to move least.

Each cell is in exactly one patch. How few components have all the cells is a set cover, solved to
the proven optimum. Patches then grow over the surface, all at the same speed, from the cells that
only one of these components has; so most patches are in one piece.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from coverable.arrays import Ints, Mask
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.motion_rates import replay_at_rates
from feasibility.division.between_patches import clear_moves
from feasibility.division.division import Plan, SubPatch
from feasibility.division.reconfiguration import itinerary, straight_moves
from feasibility.division.set_covering import set_cover
from feasibility.roadmap.expansion import UNTRIED
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.rounds import explore, improve
from feasibility.roadmap.search import exploration_of
from feasibility.roadmap.walk import covering_walk, links_of, patch_walk
from feasibility.search_settings import Search
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.robot import Robot
from surfaces.adjacency import components
from surfaces.cells import Cells

TIME_LIMIT = 10.0  # [s]


class Partition(NamedTuple):
    """Each cell in exactly one patch, each patch inside one component."""

    rows: Ints
    """(P,) the component of each patch, a row of the table; the largest patch first."""
    patch: Ints
    """(N,) the patch of each cell; -1 for cells that nothing covers."""
    bound: int
    """No partition has fewer patches."""


def fewest_patches(covers: Mask, pairs: Ints, time_limit: float = TIME_LIMIT) -> Partition:
    """Share cells out among as few components as possible.

    Args:
        covers, time_limit: of components, see `set_cover`.
        pairs: (M, 2) cells that touch.

    Example:
        >>> covers = np.array([[1, 1, 0], [0, 1, 1]], dtype=bool)
        >>> found = fewest_patches(covers, np.array([[0, 1], [1, 2]]))
        >>> len(found.rows), found.bound, found.patch.tolist()
        (2, 2, [0, 0, 1])
    """
    chosen, bound = set_cover(covers[:, covers.any(axis=0)], time_limit)
    rows = np.array(chosen, dtype=np.int64)
    label = _grown(covers[rows], pairs)
    names, first, sizes = np.unique(label[label >= 0], return_index=True, return_counts=True)
    order = np.lexsort((first, -sizes))  # the largest first, then the one that begins first
    rank = np.full(len(rows) + 1, -1, dtype=np.int64)  # the last one is that of label -1
    rank[names[order]] = np.arange(len(names))
    return Partition(rows[names[order]], rank[label], bound)


def _grown(covers: Mask, pairs: Ints) -> Ints:
    """(N,) a row of `covers` (K, N) for each cell that one has, -1 elsewhere.

    Labels grow from the cells that have no choice. What no label grows into is begun by the row
    that has most of it.
    """
    label = np.full(covers.shape[1], -1, dtype=np.int64)
    alone = covers.sum(axis=0) == 1
    label[alone] = np.nonzero(covers[:, alone].T)[1]
    near: list[list[int]] = [[] for _ in label]
    for i, j in pairs.tolist():
        near[i].append(j)
        near[j].append(i)
    queue = deque(np.flatnonzero(label >= 0).tolist())
    while True:
        while queue:
            i = queue.popleft()
            for j in near[i]:
                if label[j] < 0 and covers[label[i], j]:
                    label[j] = label[i]
                    queue.append(j)
        free = covers & (label < 0)
        if not free.any():
            return label
        k = int(free.sum(axis=1).argmax())
        first = int(free[k].argmax())
        label[first] = k
        queue.append(first)


MOST_COMPONENTS = 4  # components that walks of one patch are made of
MOST_NEAR = 3  # starts of one component's walks that are near other patches
DRY_ROUNDS = 10  # rounds without gain after which components are taken as they are
MOST_ROUNDS = 60
SEEDS = 6  # guesses at a cell, each round
TOP = 6  # components of a cover that one round works on
LEAST_SECONDS = 0.3  # for the cover of a division
COVER_SECONDS = 2.0  # for the cover of one round, which need not be the best
ELSEWHERE = 2  # state of a pair of cells that is not to be joined


def plan_of(
    exploration: Exploration, task: Task, left: float = np.inf, asked: Exploration | None = None
) -> Plan:
    """Walks for the fewest patches, in the best order, each replayed, and moves between them.

    That they are the fewest is proved in so many seconds, if it can be. Where a search held
    something back, `asked` is of the arm and the bodies that are asked about.
    """
    asked = exploration if asked is None else asked
    robot, cells = asked.robot, asked.cells
    roots, covers = cover_table(exploration)
    partition = fewest_patches(covers, cells.pairs, min(TIME_LIMIT, max(left, LEAST_SECONDS)))
    wanted = [partition.patch == p for p in range(len(partition.rows))]
    if not wanted:
        return Plan((), (), partition.bound)
    choices = _choices(exploration, wanted, roots, covers, task.requires_rates)
    order, walks = itinerary(robot, choices)
    patches = []
    for p, walk in zip(order, walks, strict=True):
        mine = wanted[p]
        certificate, refusal = replay_at_rates(robot, cells, task, walk, mine)
        piece = components(cells.pairs[mine[cells.pairs].all(axis=1)], len(cells))
        patches.append(
            SubPatch(
                cells=np.flatnonzero(mine),
                area=float(cells.areas[mine].sum()),
                pieces=len(np.unique(piece[mine])),
                walk=walk,
                certificate=certificate,
                refusal=refusal,
            )
        )
    moves = clear_moves(robot, cells, task, straight_moves(robot, walks))
    return Plan(tuple(patches), moves, partition.bound)


def _choices(
    exploration: Exploration,
    wanted: Sequence[Mask],
    roots: list[int],
    covers: Mask,
    at_speed: bool,
) -> list[list[Walk]]:
    """For each patch walks of the components that cover it, from several starts.

    One start is a node with the fewest edges, because corners are best begun with. The others come
    nearest to a node of another patch, so that the arm need not move far from one to the next.
    """
    from scipy.spatial import cKDTree

    roadmap, most = exploration.roadmap, MOST_COMPONENTS if len(wanted) > 1 else 1
    options = [
        (p, roots[row])
        for p, mine in enumerate(wanted)
        for row in np.flatnonzero(covers[:, mine].all(axis=1))[:most].tolist()
    ]
    for p, component in () if at_speed else options:  # of those at a speed all is known
        connect_pairs(exploration, component, wanted[p])
    links = {root: links_of(roadmap, root) for _, root in options}
    nodes = [[node for node in links[r] if wanted[p][roadmap.cell[node]]] for p, r in options]
    q = [np.array([roadmap.q[node] for node in own]) for own in nodes]
    trees = [cKDTree(rows) for rows in q]
    choices: list[list[Walk]] = [[] for _ in wanted]
    for (p, root), own, rows in zip(options, nodes, q, strict=True):
        near = []
        for (other, _), tree in zip(options, trees, strict=True):
            if other != p:
                away, _ = tree.query(rows, p=np.inf)
                near.append((float(away.min()), own[int(np.argmin(away))]))
        corner = own[int(np.argmin([len(links[root][node]) for node in own]))]
        starts = dict.fromkeys([corner, *(node for _, node in sorted(near)[:MOST_NEAR])])
        choices[p] += [patch_walk(roadmap, links[root], wanted[p], start) for start in starts]
    return choices


def cover_table(exploration: Exploration) -> tuple[list[int], Mask]:
    """The root components, and (K, N) the cells that each covers."""
    roots = [r for r in exploration.roots() if exploration.roadmap.size[r] > 0]
    return roots, exploration.roadmap.covers(roots)


def collect_components(exploration: Exploration) -> None:
    """Improve the components that the best cover uses, until some rounds in a row gain nothing.

    Raises:
        OutOfTime: the deadline passed; what was found until then is kept.
    """
    dry, before, rng = 0, (0, 0, 0), exploration.rng
    for _ in range(MOST_ROUNDS):
        roots, covers = cover_table(exploration)
        left = min(COVER_SECONDS, exploration.clock.left)
        rows, _ = set_cover(covers[:, exploration.reached], left)
        chosen = [roots[row] for row in rows]
        sizes = sum(exploration.roadmap.size[root] for root in chosen)
        state = (int(exploration.reached.sum()), -len(chosen), sizes)
        dry = dry + 1 if state == before else 0
        before = state
        if len(chosen) < 2 or dry >= DRY_ROUNDS:
            return
        exploration.tick("looking for components that cover more")
        counts = exploration.roadmap.covers(chosen).sum(axis=0)
        rare = np.flatnonzero(exploration.reached & (counts < len(chosen)))
        exploration.add_seeds(int(rng.choice(rare)), exploration.guesses(SEEDS))
        improve(exploration, rng.permutation(chosen)[:TOP].tolist())
        exploration.rounds += 1


def connect_pairs(exploration: Exploration, component: int, wanted: Mask) -> None:
    """Look for a motion of a component between every two neighbouring cells that are wanted."""
    pairs = exploration.cells.pairs
    state = np.where(wanted[pairs].all(axis=1), UNTRIED, ELSEWHERE)
    exploration.close_pairs(state, component)


def motion_over(
    robot: Robot, cells: Cells, task: Task, search: Search, cover: Mask, clock: Clock | None = None
) -> tuple[Walk | None, str]:
    """One continuous motion over what a component of a verdict covers (N,), or why there is none.

    Arm, cells, task and search are those of the verdict.
    """
    clock = (Clock() if clock is None else clock).allow(search.evaluations)
    exploration = exploration_of(robot, cells, task, search.seed, clock)
    exploration.early = search.early
    with suppress(OutOfTime):
        explore(exploration)
    exploration.clock = Clock()
    for root in exploration.roots():
        found = exploration.covers(root)
        if (found >= cover).all():
            walk = covering_walk(exploration.roadmap, root)
            refusal = replay_at_rates(robot, cells, task, walk, found)[1]
            return None if refusal else walk, refusal
    return None, "the search did not find this motion again"
