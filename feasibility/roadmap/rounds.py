"""Steps 7 and 8 of the search: what is tried where the seeds over the middle cell do not do.

7. Branch and bound over every cell that no component has reached: it either proves that no
   configuration covers the cell, or finds one (which becomes a seed). Before that, whether the tool
   collides over the cell in every pose, whatever the arm does; and after it, over a few cells,
   whether something collides wherever the tool is there.
8. Rounds: seed cells that the best component misses; explore self-motions at the border of the
   largest components, to find configurations that reach further; bridge two components, and explore
   self-motions over cells that both cover. The search is exhausted when some rounds in a row have
   gained nothing.
"""

from collections.abc import Callable, Collection

import numpy as np

from coverable.arrays import Ints
from feasibility.roadmap.connecting import border, bridge, explore_self_motions, improvable
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.proofs.branching import BoxStack, root_box
from feasibility.roadmap.proofs.branching import rule as examine_cell
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.rulings import prove_collisions, rule, tool_collides
from feasibility.roadmap.search import PIVOT_SEEDS, seed_middle

TOP = 5  # components that a round works on
RESTARTS = 6  # cells seeded anew before a search counts as exhausted
IDLE_ROUNDS = 24  # rounds without gain after which the search is exhausted
SETTLED_ROUNDS = 12  # the same once a proof decides the verdict, and only more cells can be gained
PARTED_ROUNDS = 3  # the same once a cut tree parts the components found
MOST_ROUNDS = 200
SEEDS = 6  # guesses at a missed cell, each round
FIRST_BOXES = 1000  # boxes for each cell that no component has reached
MORE_BOXES = 20_000  # boxes once Newton has failed there too
DEEP_BOXES = 2_000_000  # boxes for the few cells that are examined until one is proved
DEEP_CELLS = 3
ARM_CELLS = 4  # for which a collision of any part of the arm is tried to be proved
MOST_RULED = 500  # cells examined in a row without reaching any; on a fine grid the rest are alike
NEWTON_STARTS, LAST_STARTS = 25, 1000


def explore(exploration: Exploration, between: Callable[[int], None] | None = None) -> None:
    """Run the search to its end, from step 6 on; the exploration holds the result.

    Args:
        exploration: the search.
        between: called after so many rounds without gain, to try something else.

    Raises:
        OutOfTime: the deadline passed; the exploration holds what was found until then.
    """
    if not seed_middle(exploration):
        go_on(exploration, between)


def go_on(exploration: Exploration, between: Callable[[int], None] | None) -> None:
    """`explore`, from step 7 on."""
    _unreached(exploration)
    _rounds(exploration, between)


def suspect(exploration: Exploration, cells: Collection[int]) -> bool:
    """Is one of a few cells proved uncoverable, by what is cheapest to try?"""
    arrays, robot = exploration.arrays, exploration.robot
    distance = robot.distance_from_base(arrays.points[list(cells)])
    for cell, away in zip(cells, distance.tolist(), strict=True):
        if away > robot.reach + arrays.tolerance:
            exploration.rulings[cell] = Ruling.PROVED
        elif not tool_collides(exploration, cell):
            boxes = root_box(arrays)
            ruled, _ = examine_cell(arrays, exploration.work, cell, boxes, FIRST_BOXES)
            exploration.boxes += int(boxes.counts[1])
            if ruled is Ruling.PROVED:
                exploration.rulings[cell] = ruled
        if exploration.proved:
            return True
    return False


def _unreached(exploration: Exploration) -> None:
    """Step 7: a ruling on every cell that no component has reached."""
    distance = exploration.robot.distance_from_base(exploration.arrays.points)
    beyond = distance > exploration.robot.reach + exploration.arrays.tolerance
    # The furthest first: the proof names it, and who proves it again looks at the fewest boxes.
    for cell in np.argsort(-distance, kind="stable")[: beyond.sum()].tolist():
        exploration.rulings[cell] = Ruling.PROVED
    if exploration.early and exploration.proved:
        return
    open_boxes: dict[int, BoxStack] = {}
    in_vain = 0
    for cell in evenly(np.flatnonzero(~exploration.reached & ~beyond)).tolist():
        if exploration.reached[cell]:
            in_vain = 0
            continue  # reached from a cell examined before it
        in_vain += 1
        if in_vain > MOST_RULED:
            break
        if exploration.early and exploration.proved:
            return
        if tool_collides(exploration, cell):
            continue
        boxes = root_box(exploration.arrays)
        if rule(exploration, cell, boxes, FIRST_BOXES) is Ruling.OPEN:
            if exploration.add_seeds(cell, exploration.guesses(NEWTON_STARTS)) == 0:
                open_boxes[cell] = boxes
        elif exploration.rulings[cell] is Ruling.UNKNOWN:
            exploration.add_seeds(cell, exploration.guesses(NEWTON_STARTS))
    for cell, boxes in open_boxes.items():
        if not exploration.reached[cell]:
            rule(exploration, cell, boxes, MORE_BOXES)
    if exploration.proved:
        return
    _at_the_target(exploration)
    _where_the_arm_collides(exploration)
    if exploration.proved:
        return
    # One proof is enough for the verdict: examine the furthest of the remaining cells deeper.
    left = [cell for cell in open_boxes if not exploration.reached[cell]]
    left = [cell for cell in left if exploration.rulings[cell] is Ruling.OPEN]
    for cell in sorted(left, key=lambda cell: -distance[cell])[:DEEP_CELLS]:
        if rule(exploration, cell, open_boxes[cell], DEEP_BOXES) is Ruling.PROVED:
            return
        if not exploration.reached[cell]:  # a box was too thin to say: it can be by a hair
            exploration.add_seeds(cell, exploration.guesses(LAST_STARTS))


def _at_the_target(exploration: Exploration) -> None:
    """Look again for cells that are still open, with the cone at the target only.

    Up to here the cone had to hold at the tool point's own closest point on the surface too. Where
    the tool point is off its target by much of the tolerance, that may leave nothing of the cone.
    """
    left = [
        cell
        for cell, ruling in exploration.rulings.items()
        if ruling is not Ruling.PROVED and not exploration.reached[cell]
    ]
    if not left:
        return
    exploration.arrays = exploration.arrays._replace(off_target_cost=0.0)
    for cell in left:
        if not exploration.reached[cell]:
            exploration.add_seeds(cell, exploration.guesses(NEWTON_STARTS))
        if not exploration.reached[cell]:
            rule(exploration, cell, root_box(exploration.arrays), MORE_BOXES)


def _where_the_arm_collides(exploration: Exploration) -> None:
    """Try to prove of a few open cells that something collides wherever the tool is there.

    Over these the tool can be, as far as limits, cone and roll go.
    """
    if exploration.blockers is None:
        return
    open_ = [
        cell
        for cell, ruling in exploration.rulings.items()
        if ruling in (Ruling.REACHED, Ruling.UNKNOWN) and not exploration.reached[cell]
    ]
    for cell in evenly(np.array(open_, dtype=np.int64))[:ARM_CELLS].tolist():
        prove_collisions(exploration, cell)


def evenly(cells: Ints) -> Ints:
    """The same cells in an order of which every first part is spread over all of them."""
    golden = 0.5 * (np.sqrt(5.0) - 1.0)
    return cells[np.argsort(np.modf(golden * np.arange(len(cells)))[0], kind="stable")]


def _rounds(exploration: Exploration, between: Callable[[int], None] | None) -> None:
    """Step 8: rounds of seeding and exploring, until some in a row have gained nothing.

    What is gained are cells of the largest components. A small component that is found, joins
    another, and is found again is no gain, or there would be no end.
    """
    idle, most = 0, exploration.sizes(TOP)
    if exploration.early and exploration.proved:
        return
    for _ in range(MOST_ROUNDS):
        roots = exploration.roots()
        if not roots or not exploration.apart:
            return  # the best component covers every cell that any component covers
        if improvable(exploration):
            _round(exploration, roots[:TOP])
        exploration.rounds += 1
        idle += 1
        if exploration.sizes(TOP) > most:
            idle, most = 0, exploration.sizes(TOP)
        if exploration.complete or idle >= _enough(exploration):
            return
        if exploration.cut_tree is not None or between is None:
            continue
        between(idle)
        if exploration.cut_tree is not None or exploration.sizes(TOP) > most:
            idle, most = 0, max(most, exploration.sizes(TOP))
    exploration.stopped = True


def _enough(exploration: Exploration) -> int:
    """Rounds without gain after which they end; fewer once a proof decides the verdict."""
    if exploration.cut_tree is not None:
        return PARTED_ROUNDS
    return SETTLED_ROUNDS if exploration.proved else IDLE_ROUNDS


def _round(exploration: Exploration, top: list[int]) -> None:
    """One round: seed what the best component misses, and improve the largest ones."""
    missed = np.flatnonzero(~exploration.covered & exploration.reached)
    if len(missed):
        exploration.add_seeds(int(exploration.rng.choice(missed)), exploration.guesses(SEEDS))
    improve(exploration, top)


def improve(exploration: Exploration, components: list[int]) -> None:
    """Explore self-motions at the borders of some components, and bridge each two of them."""
    rng = exploration.rng
    for component in components:
        if exploration.complete:
            return
        exploration.tick("exploring self-motions at borders")
        edge = border(exploration, component)
        if len(edge):
            explore_self_motions(exploration, int(rng.choice(edge)))
    for a in range(len(components)):
        for b in range(a):
            one, other = (exploration.roadmap.root(components[k]) for k in (a, b))
            # Every pair in every round would cost too much where there are many.
            if one == other or (len(components) > 3 and rng.random() > 0.3):
                continue
            exploration.tick("bridging components")
            bridge(exploration, one, other)
            shared = np.flatnonzero(exploration.covers(one) & exploration.covers(other))
            if exploration.complete:
                return
            if len(shared):
                explore_self_motions(exploration, int(rng.choice(shared)))


def restart(exploration: Exploration) -> None:
    """Seed several cells all over the surface anew, as if each were the first."""
    for cell in evenly(np.arange(len(exploration.cells)))[:RESTARTS].tolist():
        exploration.tick("starting anew elsewhere")
        exploration.add_seeds(cell, exploration.guesses(PIVOT_SEEDS))
        if exploration.complete:
            return
