"""What may join components: self-motions over one cell, and bridges between two."""

import numpy as np

from coverable.arrays import Ints
from feasibility.roadmap.expansion import MOST_RIVALS, Grower
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.aiming import aim, stand_still
from feasibility.roadmap.motions.off_target import project_near_cell
from feasibility.roadmap.motions.self_motion import connect

GUESSES = 4  # of one `explore_self_motions`
PATIENCE = 60  # failed connections after which it leaves a pair of components alone
AIM_STEPS = 30  # Newton steps that project a random configuration
BRIDGES = 6  # pairs of nodes that one round tries to bridge
NARROWEST, WIDEST = 0.1, 0.9  # [1] of the curve between two centres: where a bridge is tried


def improvable(exploration: Exploration) -> bool:
    """Could motions along the curves between centres gain anything?

    Not where some component covers all that is reached of each part of the surface, as these
    curves join it: over a sharp crease, or from one piece to another that it does not touch,
    there is no motion.
    """
    reached = exploration.reached
    if exploration.parts.max(initial=0) == 0:
        return exploration.apart
    cover = exploration.roadmap.covers(exploration.roots())
    parts = [(exploration.parts == part) & reached for part in range(exploration.parts.max() + 1)]
    return not all(cover[:, part].all(axis=1).any() for part in parts if part.any())


def border(exploration: Exploration, component: int) -> Ints:
    """Cells of a component with a neighbour that it does not cover."""
    inside = exploration.covers(component)
    indptr, indices = exploration.cells.neighbours
    owners = np.repeat(np.arange(len(exploration.cells)), np.diff(indptr))
    return np.unique(owners[inside[owners] & ~inside[indices]])


def explore_self_motions(exploration: Exploration, cell: int) -> None:
    """Explore the self-motion manifold over one cell, and spread what is new.

    A rapidly exploring random tree for each component: the node nearest to a random configuration
    of the manifold moves towards it as far as it can, and from there tries to join the other
    components. New nodes may reach a neighbouring cell that the old ones could not.
    """
    roadmap, grower = exploration.roadmap, exploration.grower
    for goal in exploration.guesses(GUESSES):
        passed = set[int]()
        if not project_near_cell(exploration.arrays, exploration.work, cell, goal, AIM_STEPS):
            continue
        for _ in range(MOST_RIVALS):
            node = roadmap.nearest(cell, goal, passed)
            if node is None:
                break
            own = roadmap.root_of(node)
            passed.add(own)
            motion, _ = grower.connect(cell, roadmap.q[node], goal)
            if len(motion) < 2:
                continue
            new = grower.add_node(cell, motion[-1], own)
            roadmap.add_edge(node, new, motion)
            joined = grower.join(cell, motion[-1], own, PATIENCE)
            if joined is not None:
                roadmap.add_edge(new, *joined)
    exploration.spread()


def bridge(exploration: Exploration, one: int, other: int, most: int = BRIDGES) -> None:
    """Try to bridge two components between cell centres, the nearest nodes first.

    Two sheets of configurations (two flips of a wrist, say) may touch only where the arm passes a
    singularity, and the target of that singularity may lie between the centres.
    """
    roadmap, rounds, tries = exploration.roadmap, exploration.rounds, 0
    nodes = roadmap.nearest_neighbours(exploration.cells.pairs, one, other)
    for x, y in nodes[: 2 * most * (1 + rounds)]:
        if exploration.tried.get((x, y), 0) > rounds // 4:
            continue
        exploration.tried[x, y] = exploration.tried.get((x, y), 0) + 1
        share = float(exploration.rng.uniform(NARROWEST, WIDEST))
        curve = exploration.curve(roadmap.cell[x], roadmap.cell[y])
        if _bridged(exploration.grower, x, y, curve, share):
            exploration.spread()
            return
        tries += 1
        if tries == most:
            return


def _bridged(grower: Grower, x: int, y: int, curve: int, share: float) -> bool:
    """Could nodes over neighbouring cells be joined at a point of the curve between them?

    Both are tracked to that point, a share of the curve, and a self-motion is tried there.
    """
    roadmap, arrays, work = grower.roadmap, grower.arrays, grower.work
    starts = (0.0, 1.0) if roadmap.cell[x] < roadmap.cell[y] else (1.0, 0.0)
    there = grower.track(curve, (starts[0], share), roadmap.q[x])
    back = None if there is None else grower.track(curve, (starts[1], share), roadmap.q[y])
    if there is None or back is None:
        return False
    aim(arrays, work, curve, share)
    stand_still(arrays, work)
    between, reached = connect(arrays, work, there[-1], back[-1])
    if not reached:
        between, reached = connect(arrays, work, back[-1], there[-1])
        between = np.vstack([between[-2::-1], back[-1]])
    if reached:
        roadmap.add_edge(x, y, np.vstack([there, between, back[-2::-1], roadmap.q[y]]))
    return bool(reached)
