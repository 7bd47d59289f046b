"""How many motions it takes at least, proved: whatever the search found or did not find.

Where a cut tree shows that no motion covers all of some cells, two at least are needed. Where no
two of k cells can be covered by one motion, each pair by a cut tree of its own, k are: a motion
covers one of them at most.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from feasibility.cut_tree import CutTree
from feasibility.division.division import Apart
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.proofs.gaps import components_of
from feasibility.roadmap.proofs.prover import Prover
from feasibility.roadmap.proofs.target_places import places_on
from feasibility.task import Task

ATTEMPTS = 4  # at a proof, each with the configurations that refuted the one before
BOXES = 60_000  # of an attempt
ALL_BOXES = 600_000
MOST_REFUTED = 8  # pairs of cells that one motion may cover after all
MOST_GROUPS = 60  # of cells that the same components cover


@dataclass(frozen=True, eq=False, slots=True)
class ProvedBound:
    """A number of motions that no division goes below, and its proofs, see `Division`."""

    number: int
    """0 for no cells, 1 where nothing is proved."""
    proof: CutTree | None = None
    apart: tuple[Apart, ...] = ()


def prove_apart(exploration: Exploration, task: Task) -> ProvedBound:
    """Prove how many motions it takes to cover the cells that a finished search reaches.

    Configurations that refute a guess become seeds, so the exploration may know more afterwards.

    Raises:
        OutOfTime: the deadline passed.
    """
    reached = exploration.reached
    if not reached.any() or exploration.covered[reached].all():
        return ProvedBound(int(reached.any()))
    rng = np.random.default_rng(exploration.seed)
    prover = Prover(exploration.arrays, places_on(exploration.cells.surface, task), rng)
    before, whole = exploration.boxes, _tree(exploration, prover, None)
    if whole is None:
        return ProvedBound(1)
    apart: dict[tuple[int, int], CutTree] = {}
    refuted: set[tuple[int, int]] = set()
    while len(refuted) <= MOST_REFUTED and exploration.boxes - before < ALL_BOXES:
        pairs = list(combinations(_never_together(exploration, refuted), 2))
        if len(pairs) < 2:
            break
        for pair in pairs:
            tree = apart.get(pair) or _tree(exploration, prover, pair)
            if tree is None:
                refuted.add(pair)
                break
            apart[pair] = tree
        else:
            trees = tuple(Apart(*pair, apart[pair]) for pair in pairs)
            return ProvedBound(len({cell for pair in pairs for cell in pair}), whole, trees)
    return ProvedBound(2, whole)


def _tree(
    exploration: Exploration, prover: Prover, cells: tuple[int, ...] | None
) -> CutTree | None:
    """A proof that no motion covers all of some cells, or all that are reached; or None."""
    for _ in range(ATTEMPTS):
        wanted = exploration.reached.copy()
        if cells is not None:
            wanted[:] = False
            wanted[list(cells)] = True
        # The other cells do not count: every component is taken to cover them.
        known = [c._replace(cover=c.cover | ~wanted) for c in components_of(exploration.roadmap)]
        if any(component.cover.all() for component in known):
            return None
        attempt = prover.attempt(
            known, BOXES, lambda: exploration.tick("proving how many motions it takes")
        )
        exploration.boxes += attempt.boxes
        if attempt.tree is not None or not attempt.seeds:
            return attempt.tree
        for cell, q in attempt.seeds:
            exploration.add_seeds(cell, q[None])
    return None


def _never_together(exploration: Exploration, refuted: set[tuple[int, int]]) -> list[int]:
    """As many cells as can be of which no component found covers two, sorted.

    No pair (a, b), a < b, among them is one of those `refuted`.
    """
    import networkx as nx

    roots = exploration.roots()
    covers = exploration.roadmap.covers(roots)
    reached = np.flatnonzero(exploration.reached)
    kinds, group = np.unique(covers[:, reached], axis=1, return_inverse=True)
    group = group.reshape(-1)
    # Of cells that the same components cover the one that is furthest from all others.
    points, cells = exploration.arrays.points[reached], list[int]()
    for mine in (group == k for k in range(kinds.shape[1])):
        away = np.linalg.norm(points[mine, None] - points[None, ~mine], axis=2)
        cells.append(int(reached[mine][away.min(axis=1, initial=np.inf).argmax()]))
    # Cells that few components cover go together with few others.
    order = np.argsort(kinds.sum(axis=0), kind="stable")[:MOST_GROUPS].tolist()
    graph = nx.Graph()
    graph.add_nodes_from(cells[k] for k in order)
    for i, k in enumerate(order):
        for other in order[:i]:
            a, b = sorted((cells[k], cells[other]))
            if not (kinds[:, k] & kinds[:, other]).any() and (a, b) not in refuted:
                graph.add_edge(a, b)
    clique, _ = nx.max_weight_clique(graph, weight=None)
    return sorted(clique)
