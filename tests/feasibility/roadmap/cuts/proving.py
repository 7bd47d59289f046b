"""A short search and attempts at a proof, taking turns; and what a proof states."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.branch_and_bound.boxes import place_at_rest
from feasibility.roadmap.cuts import Prover, components_of, places_on
from feasibility.roadmap.cuts.regions import limits_of, turn_from
from feasibility.roadmap.cuts.statements import Budget, Statement
from feasibility.roadmap.exploration import Exploration, wound
from feasibility.roadmap.motions import arrays_of
from feasibility.roadmap.search import improve, seed_middle


class Proving(NamedTuple):
    """How it ended."""

    exploration: Exploration
    prover: Prover
    attempt: object | None
    """The last attempt; None where the search ended before."""

    @property
    def tree(self):
        return None if self.attempt is None else self.attempt.tree


def nothing():
    """A tick that does not stop anything."""


def prove(robot, cells, task, budget=20_000, attempts=8, seed=0):
    """Search from the middle, one round, then attempts whose seeds go back into the search."""
    arrays = arrays_of(robot, cells, task)
    exploration = Exploration(robot, cells, arrays, seed)
    prover = Prover(arrays, places_on(cells.surface, task), exploration.rng)
    if seed_middle(exploration):
        return Proving(exploration, prover, None)
    improve(exploration, exploration.roots()[:5])
    attempt = None
    for _ in range(attempts):
        if exploration.complete:
            return Proving(exploration, prover, None)
        attempt = prover.attempt(components_of(exploration.roadmap), budget, nothing)
        if attempt.tree is not None:
            break
        budget *= 1 if attempt.seeds else 4
        for cell, q in attempt.seeds:
            exploration.add_seeds(cell, wound(arrays, q)[None])
    return Proving(exploration, prover, attempt)


def root_region(prover, tree):
    """The region of a tree's root."""
    region = limits_of(prover.arrays, prover.places)
    for joint, t in tree.opened:
        region = turn_from(region, joint, t)
    return region


def nodes(region, node):
    """Every node of a tree with its region."""
    yield region, node
    if isinstance(node, Cut):
        below, above = region.sides(np.array(node.weights), node.value)
        yield from nodes(below, node.below)
        yield from nodes(above, node.above)


def statement_of(prover, region, node):
    """What a node states: where the tool is said to be nowhere."""
    if isinstance(node, Leaf):
        arrays = prover.arrays
        places = place_at_rest(arrays, node.cell)
        return Statement(region, places, 0)
    return Statement(region.on(np.array(node.weights), node.value), prover.places, 2)


def ruling(prover, statement, most=200_000):
    """The ruling on a statement."""
    Budget(prover.arrays, prover.findings.work, most, nothing).examine(statement, most)
    return statement.ruling
