"""From components to a plan: cells shared out, walks for every patch, the moves between them.

A verdict's search works on its largest components. A division goes on with the components that the
best cover of all reached cells uses: cells that only some of them reach are seeded, and each two of
them may join. A round has gained something when the cover has fewer components, or one of them
covers more. Some rounds in a row without gain end it.

Several components may cover the cells of a patch; they differ in how the arm holds itself. A patch
gets walks of some of them, each from several starts, and the itinerary picks those between which
the arm has to move least.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.division.between_patches import clear_moves
from feasibility.division.division import Plan, SubPatch
from feasibility.division.reconfiguration import itinerary
from feasibility.division.set_covering import set_cover
from feasibility.division.sharing import TIME_LIMIT, fewest_patches, pieces_in
from feasibility.roadmap.expansion import UNTRIED
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.rounds import improve
from feasibility.roadmap.walk import Links, links_of, patch_walk
from feasibility.speed.motion_rates import replay_at_rates
from feasibility.task import Task
from feasibility.verdict import Walk

MOST_COMPONENTS = 4  # components that walks of one patch are made of
MOST_NEAR = 3  # starts of one component's walks that are near other patches
DRY_ROUNDS = 10  # rounds without gain after which components are taken as they are
MOST_ROUNDS = 60
SEEDS = 6  # guesses at a cell, each round
TOP = 6  # components of a cover that one round works on
LEAST_SECONDS = 0.3  # for the cover of a division
COVER_SECONDS = 2.0  # for the cover of one round, which need not be the best
ELSEWHERE = 2  # state of a pair of cells that is not to be joined


@dataclass(frozen=True, eq=False, slots=True)
class _Option:
    """A component that covers one patch, and where walks over the patch may begin."""

    patch: int
    wanted: Mask
    """(N,) cells of the patch."""
    links: Links
    nodes: list[int]
    """Nodes of the component over these cells."""
    q: Array
    """Their configurations."""


def plan_of(exploration: Exploration, task: Task, left: float = np.inf) -> Plan:
    """Walks for the fewest patches, in the best order, each replayed, and moves between them.

    `left` are seconds for the proof that they are the fewest.
    """
    robot, cells = exploration.robot, exploration.cells
    roots, covers = cover_table(exploration)
    partition = fewest_patches(covers, cells.pairs, min(TIME_LIMIT, max(left, LEAST_SECONDS)))
    if len(partition) == 0:
        return Plan((), (), partition.bound)
    wanted = [partition.patch == p for p in range(len(partition))]
    chosen = itinerary(robot, _choices(exploration, wanted, roots, covers, task.requires_rates))
    patches = []
    for p, walk in zip(chosen.order, chosen.walks, strict=True):
        mine = wanted[p]
        certificate, refusal = replay_at_rates(robot, cells, task, walk, mine)
        patches.append(
            SubPatch(
                cells=np.flatnonzero(mine),
                area=float(cells.areas[mine].sum()),
                pieces=pieces_in(mine, cells.pairs),
                walk=walk,
                certificate=certificate,
                refusal=refusal,
            )
        )
    moves = clear_moves(robot, cells, task, exploration.arrays.collisions, chosen.moves)
    return Plan(tuple(patches), moves, partition.bound)


def _choices(
    exploration: Exploration,
    wanted: Sequence[Mask],
    roots: list[int],
    covers: Mask,
    at_speed: bool,
) -> list[list[Walk]]:
    """For each patch walks of the components that cover it, from several starts."""
    fitting = []
    for mine in wanted:
        rows = np.flatnonzero(covers[:, mine].all(axis=1))
        most = MOST_COMPONENTS if len(wanted) > 1 else 1
        fitting.append([roots[row] for row in rows[:most].tolist()])
        for component in () if at_speed else fitting[-1]:  # of those at a speed all is known
            connect_pairs(exploration, component, mine)
    roadmap = exploration.roadmap
    links = {root: links_of(roadmap, root) for root in {r for own in fitting for r in own}}
    options = []
    for p, (mine, own) in enumerate(zip(wanted, fitting, strict=True)):
        for component in own:
            nodes = [node for node in links[component] if mine[roadmap.cell[node]]]
            q = np.array([roadmap.q[node] for node in nodes])
            options.append(_Option(p, mine, links[component], nodes, q))
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
        starts = [min(option.nodes, key=lambda node: len(option.links[node]))]
        near = []
        for other, tree in zip(options, trees, strict=True):
            if other.patch != option.patch:
                distance, _ = tree.query(option.q, p=np.inf)
                near.append((float(distance.min()), option.nodes[int(np.argmin(distance))]))
        starts += [x for _, x in sorted(near)[:MOST_NEAR]]
        result.append(list(dict.fromkeys(starts)))
    return result


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
        cover = set_cover(covers[:, exploration.reached], left)
        chosen = [roots[row] for row in cover.rows]
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
