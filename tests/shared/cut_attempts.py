"""A short search and attempts at a proof, taking turns; and what a proof states."""

from typing import NamedTuple

import numpy as np

from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.proofs.boxes import place_at_rest
from feasibility.roadmap.proofs.gaps import Component, components_of
from feasibility.roadmap.proofs.prover import Prover
from feasibility.roadmap.proofs.regions import limits_of, turn_from
from feasibility.roadmap.proofs.statements import Budget, Statement
from feasibility.roadmap.proofs.target_places import places_on
from feasibility.roadmap.rounds import improve
from feasibility.roadmap.search import seed_middle
from feasibility.roadmap.seeds import wound


class Proving(NamedTuple):
    exploration: Exploration
    prover: Prover
    attempt: object | None = None
    """The last attempt; None where the search ended before."""

    @property
    def tree(self):
        return None if self.attempt is None else self.attempt.tree

    @property
    def components(self):
        return components_of(self.exploration.roadmap)

    def statements(self):
        """Every node of the tree with its region."""
        region = limits_of(self.prover.arrays, self.prover.places)
        for joint, t in self.tree.opened:
            region = turn_from(region, joint, t)
        waiting = [(region, self.tree.root)]
        while waiting:
            region, node = waiting.pop()
            yield region, node
            if isinstance(node, Cut):
                sides = region.sides(node.joint, node.value)
                waiting += zip(sides, (node.below, node.above), strict=True)

    def ruling(self, region, node, most=200_000):
        """Is the tool nowhere there: over a leaf's cell, or on a cut anywhere on the surface?"""
        if isinstance(node, Leaf):
            return self.ruled(region, place_at_rest(self.prover.arrays, node.cell), 0, most)
        on = region.on(node.joint, node.value)
        return self.ruled(on, self.prover.places, 2, most)

    def ruled(self, region, places, dimension, most=200_000):
        statement = Statement(region, places, dimension)
        work = self.prover.findings.work
        Budget(self.prover.arrays, work, most, nothing).examine(statement, most)
        return statement.ruling


def nothing():
    """A tick that does not stop anything."""


def prove(robot, cells, task, budget=20_000, attempts=8, seed=0):
    """Search from the middle, one round, then attempts whose seeds go back into the search."""
    arrays = arrays_of(robot, cells, task)
    exploration = Exploration(robot, cells, arrays, seed)
    proving = Proving(exploration, Prover(arrays, places_on(cells.surface, task), exploration.rng))
    if seed_middle(exploration):
        return proving
    improve(exploration, exploration.roots()[:5])
    for _ in range(attempts):
        if exploration.complete:
            return proving._replace(attempt=None)
        attempt = proving.prover.attempt(proving.components, budget, nothing)
        proving = proving._replace(attempt=attempt)
        if attempt.tree is not None:
            break
        budget *= 1 if attempt.seeds else 4
        for cell, q in attempt.seeds:
            exploration.add_seeds(cell, wound(arrays, q)[None])
    return proving


def proved_wrongly(robot, cells, task, rng, newton=True, budget=4000):
    """Does one of two attempts on a covering roadmap that is broken in two end in a proof?"""
    arrays = arrays_of(robot, cells, task)
    exploration = Exploration(robot, cells, arrays, 0)
    if not seed_middle(exploration):
        return None
    whole, parts = components_of(exploration.roadmap)[0], []
    along = whole.q[:, rng.integers(whole.q.shape[1])]
    low, high = np.quantile(along, np.sort(rng.uniform(0.2, 0.8, 2)))
    for part in (along <= low, along >= high):
        cover = np.ones(len(whole.cover), dtype=bool)
        cover[rng.integers(len(cover))] = False
        parts.append(Component(whole.q[part], cover))
    prover = Prover(arrays, places_on(cells.surface, task), rng, newton=newton)
    return any(prover.attempt(parts, budget, nothing).tree is not None for _ in range(2))
