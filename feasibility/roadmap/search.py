"""The complete search: does one component of the roadmap cover every cell?

In this order, because each step is cheap where the next one is dear:

1. Seed a pivot cell in the middle, and spread each seed at once into the cells that its component
   does not cover yet. Most feasible cases end here.
2. Rule on every cell that nothing has reached: branch and bound either proves that no
   configuration covers it, or finds one (which becomes a seed).
3. Rounds: seed cells that the best component misses; stir the fibres at the border of the largest
   components, where a configuration may hide that reaches further; stir where two of them meet.
   The search is exhausted when some rounds in a row have gained nothing.

The verdict does not lean on the order or on luck where a witness or a proof is at hand; where
neither is, it says "exhausted", and what was tried.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.branch_and_bound import Boxes, Ruling, root_box
from feasibility.roadmap.exploration import Explorer
from feasibility.roadmap.graph import EDGES, NODES, root_of
from feasibility.roadmap.self_motion import roomy

PIVOT_SEEDS = 8
TOP = 5  # components that a round works on
DRY_ROUNDS = 24  # rounds without gain after which the search is exhausted
SETTLED_ROUNDS = 12  # the same once a proof has settled the verdict: only more cells are at stake
MOST_ROUNDS = 200
SEEDS = 6  # guesses at a missed cell, each round
FIRST_BOXES = 1000  # boxes for each cell that nothing has reached
MORE_BOXES = 20_000  # boxes once Newton has failed there too
DEEP_BOXES = 2_000_000  # boxes for the few cells that are looked at until one is proved
DEEP_CELLS = 3
MOST_RULED = 500  # cells ruled on in a row without reaching any; on a fine grid the rest are alike
NEWTON_STARTS = 25


def explore(explorer: Explorer) -> None:
    """Run the search to its end; the explorer holds the result.

    Raises:
        OutOfTime: the deadline passed; what was found until then stands.
    """
    if len(explorer.cells) == 0 or _pivot(explorer):
        return
    _unreached(explorer)
    _rounds(explorer)


def _pivot(explorer: Explorer) -> bool:
    """Step 1; True when one component covers every cell."""
    pivot = explorer.cells.middle
    explorer.tick("looking for configurations")
    guesses = explorer.guesses(PIVOT_SEEDS)
    room = roomy(explorer.problem, explorer.work, pivot, guesses)
    # The one with most room first: it is the least likely to get stuck.
    for k in np.argsort(-room, kind="stable"):
        if room[k] >= 0.0:
            explorer.plant(pivot, guesses[k : k + 1])
        if explorer.complete:
            return True
    return False


def _unreached(explorer: Explorer) -> None:
    """Step 2: a ruling on every cell that nothing has reached."""
    distance = np.linalg.norm(
        explorer.problem.points - explorer.robot.model.jointPlacements[1].translation, axis=1
    )
    beyond = distance > explorer.robot.reach + explorer.problem.tolerance
    for cell in np.flatnonzero(beyond).tolist():
        explorer.rulings[cell] = Ruling.PROVED
    open_boxes: dict[int, Boxes] = {}
    fruitless = 0
    for cell in evenly(np.flatnonzero(~explorer.reached & ~beyond)).tolist():
        if explorer.reached[cell]:
            fruitless = 0
            continue  # reached from a cell ruled on before it
        fruitless += 1
        if fruitless > MOST_RULED:
            break
        boxes = root_box(explorer.problem)
        if explorer.rule(cell, boxes, FIRST_BOXES) is Ruling.OPEN:
            if explorer.plant(cell, explorer.guesses(NEWTON_STARTS)) == 0:
                open_boxes[cell] = boxes
        elif explorer.rulings[cell] is Ruling.UNKNOWN:
            explorer.plant(cell, explorer.guesses(NEWTON_STARTS))
    for cell, boxes in open_boxes.items():
        if not explorer.reached[cell]:
            explorer.rule(cell, boxes, MORE_BOXES)
    if Ruling.PROVED in explorer.rulings.values():
        return
    # One proof is enough for the verdict: look deeper at the furthest of what is left.
    left = [c for c in open_boxes if explorer.rulings[c] is Ruling.OPEN and not explorer.reached[c]]
    for cell in sorted(left, key=lambda c: -distance[c])[:DEEP_CELLS]:
        if explorer.rule(cell, open_boxes[cell], DEEP_BOXES) is Ruling.PROVED:
            return


def evenly(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same cells in an order whose every beginning is spread over all of them."""
    golden = 0.5 * (np.sqrt(5.0) - 1.0)
    return cells[np.argsort(np.modf(golden * np.arange(len(cells)))[0], kind="stable")]


def _rounds(explorer: Explorer) -> None:
    """Step 3: rounds of seeding and stirring, until some in a row have gained nothing."""
    dry = 0
    enough = SETTLED_ROUNDS if Ruling.PROVED in explorer.rulings.values() else DRY_ROUNDS
    for _ in range(MOST_ROUNDS):
        roots = explorer.roots()
        if not roots or explorer.covered[explorer.reached].all():
            return  # nothing is missed that anything reaches
        before = _standing(explorer)
        _round(explorer, roots[:TOP])
        explorer.rounds += 1
        dry = dry + 1 if _standing(explorer) == before else 0
        if explorer.complete or dry >= enough:
            return


def _standing(explorer: Explorer) -> tuple[int, ...]:
    """What a round must change to have gained something."""
    roots = explorer.roots()[:TOP]
    return tuple(int(explorer.roadmap.size[r]) for r in roots)


def _round(explorer: Explorer, top: list[int]) -> None:
    """One round: seed what the best component misses, stir borders and meeting places."""
    rng = explorer.rng
    missed = np.flatnonzero(~explorer.covered & explorer.reached)
    if len(missed):
        explorer.plant(int(rng.choice(missed)), explorer.guesses(SEEDS))
    for component in top:
        if explorer.complete:
            return
        explorer.tick("stirring the borders of components")
        border = explorer.border(component)
        if len(border):
            explorer.stir(int(rng.choice(border)))
    for a in range(len(top)):
        for b in range(a):
            one, other = (int(root_of(explorer.roadmap, top[k])) for k in (a, b))
            # Every pair every round would cost too much where there are many.
            if one == other or (len(top) > 3 and rng.random() > 0.3):
                continue
            explorer.tick("joining components where they meet")
            explorer.meet(one, other)
            shared = np.flatnonzero(explorer.covers(one) & explorer.covers(other))
            if explorer.complete:
                return
            if len(shared):
                explorer.stir(int(rng.choice(shared)))


def close(explorer: Explorer) -> None:
    """Try to join every neighbouring pair of cells of the best component (graph G's edges).

    Raises:
        OutOfTime: the deadline passed.
    """
    if explorer.roadmap.counters[NODES] == 0:
        return
    explorer.join(explorer.pairs, explorer.best)


def pair_edges(explorer: Explorer) -> dict[tuple[int, int], int]:
    """One edge of the best component for each pair of cells that has any."""
    roadmap, best = explorer.roadmap, explorer.best
    edges: dict[tuple[int, int], int] = {}
    for e in range(roadmap.counters[EDGES]):
        x, y = roadmap.ends[e]
        i, j = int(roadmap.cell[x]), int(roadmap.cell[y])
        if i != j and root_of(roadmap, roadmap.component[x]) == best:
            edges.setdefault((min(i, j), max(i, j)), e)
    return edges
