"""Roadmaps of feasible cases, broken in two, so that a proof seems to be there to be found."""

from __future__ import annotations

import numpy as np
from oracle_build import built
from random_cases import read

from feasibility.roadmap.cuts import Prover, components_of, places_on
from feasibility.roadmap.cuts.gaps import Component
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import arrays_of
from feasibility.roadmap.search import seed_middle


def stored(arm, feasible):
    """The stored problems of an arm that are feasible, or fall apart with every cell in reach."""
    cells = [(p, truth) for p, truth in read(arm) if truth.feasible == feasible]
    return [p for p, t in cells if feasible or t.reachable == p.cells[0] * p.cells[1]]


def covering(robot, problem):
    """The search of a feasible problem and its covering component; None where it takes longer."""
    robot, cells, task = built(problem, robot)
    arrays = arrays_of(robot, cells, task)
    exploration = Exploration(robot, cells, arrays, 0)
    if not seed_middle(exploration):
        return None
    return exploration, places_on(cells.surface, task), components_of(exploration.roadmap)[0]


def halves(component, rng):
    """Two parts of a component, a band apart along a random joint, that each miss a cell."""
    along = component.q[:, rng.integers(component.q.shape[1])]
    low, high = np.quantile(along, np.sort(rng.uniform(0.2, 0.8, 2)))
    parts = []
    for part in (along <= low, along >= high):
        cover = np.ones(len(component.cover), dtype=bool)
        cover[rng.integers(len(cover))] = False
        parts.append(Component(component.q[part], cover))
    return parts


def proved_wrongly(robot, problem, rng, newton, budget, tick=lambda: None):
    """Does any of two attempts on a broken roadmap end in a proof? None where there is nothing."""
    found = covering(robot, problem)
    if found is None:
        return None
    exploration, places, component = found
    prover = Prover(exploration.arrays, places, rng, newton=newton)
    parts = halves(component, rng)
    return any(prover.attempt(parts, budget, tick).tree is not None for _ in range(2))
