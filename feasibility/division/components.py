"""Components for a division: those that fill the gaps of the others.

The search for a verdict works on its largest components. A division goes on with the components
that the best cover of all reached cells uses: cells that only some of them reach are seeded, and
each two of them may join. A round has gained something when the cover has fewer components, or one
of them covers more. Some rounds in a row without gain end it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.division.set_covering import set_cover
from feasibility.roadmap import Exploration, improve

DRY_ROUNDS = 10  # rounds without gain after which components are taken as they are
MOST_ROUNDS = 60
SEEDS = 6  # guesses at a cell, each round
TOP = 6  # components of a cover that one round works on
COVER_SECONDS = 2.0  # for the cover of one round, which need not be the best
ELSEWHERE = 2  # state of a pair of cells that is not to be joined


def cover_table(exploration: Exploration) -> tuple[list[int], NDArray[np.bool_]]:
    """The root components, and (K, N) the cells that each covers."""
    roots = [r for r in exploration.roots() if exploration.roadmap.size[r] > 0]
    return roots, exploration.roadmap.cover[roots].astype(bool)


def collect_components(exploration: Exploration) -> None:
    """Improve the components that the best cover uses, until some rounds in a row gain nothing.

    Raises:
        OutOfTime: the deadline passed; what was found until then is kept.
    """
    dry, before = 0, (0, 0, 0)
    for _ in range(MOST_ROUNDS):
        chosen = _chosen(exploration)
        sizes = sum(int(exploration.roadmap.size[root]) for root in chosen)
        state = (int(exploration.reached.sum()), -len(chosen), sizes)
        dry = dry + 1 if state == before else 0
        before = state
        if len(chosen) < 2 or dry >= DRY_ROUNDS:
            return
        _round(exploration, chosen)
        exploration.rounds += 1


def _chosen(exploration: Exploration) -> list[int]:
    """Components of a least cover of all reached cells."""
    roots, covers = cover_table(exploration)
    left = min(COVER_SECONDS, exploration.clock.left)
    return [roots[row] for row in set_cover(covers[:, exploration.reached], left).rows]


def _round(exploration: Exploration, chosen: list[int]) -> None:
    """One round: seed a cell that few of the components reach, and improve some of them."""
    rng = exploration.rng
    exploration.tick("looking for components that cover more")
    counts = exploration.roadmap.cover[chosen].sum(axis=0)
    rare = np.flatnonzero(exploration.reached & (counts < len(chosen)))
    exploration.add_seeds(int(rng.choice(rare)), exploration.guesses(SEEDS))
    improve(exploration, rng.permutation(chosen)[:TOP].tolist())


def connect_pairs(exploration: Exploration, component: int, wanted: NDArray[np.bool_]) -> None:
    """Look for a motion of a component between every two neighbouring cells that are wanted."""
    pairs = exploration.cells.pairs
    state = np.zeros(len(pairs) + 1, dtype=np.int64)
    state[:-1][~wanted[pairs].all(axis=1)] = ELSEWHERE
    exploration.join(state, component)
