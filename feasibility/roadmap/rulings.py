"""Rulings on cells: proved uncoverable, or reached by a configuration that becomes a seed."""

from functools import partial

import numpy as np

from feasibility.roadmap.exploration import BUDGET, Exploration
from feasibility.roadmap.proofs.branching import BoxStack
from feasibility.roadmap.proofs.branching import rule as examine_cell
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.seeds import wound


def tool_collides(exploration: Exploration, cell: int) -> bool:
    """Is it proved that the tool collides in every pose over a cell? Sets its ruling."""
    blockers = exploration.blockers
    tick = partial(exploration.tick, "proving that the tool collides")
    if blockers is None or not blockers.tool_collides(exploration.arrays, cell, tick):
        return False
    exploration.rulings[cell] = Ruling.PROVED
    return True


def prove_collisions(exploration: Exploration, cell: int) -> None:
    """Try to prove that something of the arm collides wherever the tool is over a cell."""
    blockers = exploration.blockers
    if blockers is None:
        return
    tick, left = partial(exploration.tick, "proving that the arm collides"), blockers.left
    if blockers.arm_collides(exploration.arrays, exploration.work, cell, tick):
        exploration.rulings[cell] = Ruling.PROVED
    tick(left - blockers.left)


def rule(exploration: Exploration, cell: int, boxes: BoxStack, most: int) -> Ruling:
    """Branch and bound on one cell; a configuration that it finds becomes a seed."""
    ruling, examined = Ruling.OPEN, int(boxes.counts[1])
    while ruling is Ruling.OPEN and boxes.counts[1] < most:
        budget = exploration.clock.affordable(min(most, BUDGET))
        ruling, q = examine_cell(exploration.arrays, exploration.work, cell, boxes, budget)
        exploration.tick("proving cells out of reach")
    exploration.boxes += int(boxes.counts[1]) - examined
    exploration.rulings[cell] = ruling
    # A box left undecided is mostly at the border of the tolerance: a good start for Newton.
    # (Boxes of a prismatic joint without limits have no middle.)
    if ruling in (Ruling.REACHED, Ruling.UNKNOWN) and np.isfinite(q).all():
        exploration.add_seeds(cell, wound(exploration.arrays, q)[None])
    return ruling
