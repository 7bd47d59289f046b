"""What a search that found no covering motion may say: proof, left untried, or exhausted."""

from typing import Any

import numpy as np

from feasibility.cut_tree import CutTree, Leaf
from feasibility.cut_words import joint_value, sentence
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.proving import Proving
from feasibility.targets.blocked import blocked_curves, smoothing_offer


def proof_of(exploration: Exploration) -> CutTree | None:
    """The first cell that is proved uncoverable, or the cut tree; None where there is neither."""
    rulings = exploration.rulings.items()
    cell = next((cell for cell, ruling in rulings if ruling is Ruling.PROVED), None)
    return exploration.cut_tree if cell is None else CutTree(Leaf(cell))


def outcome_of(
    problem: Problem, exploration: Exploration, proving: Proving | None, late: str
) -> dict[str, Any]:
    """The fields of `SearchResult` that say why no motion was found.

    Args:
        problem, exploration: what was searched.
        proving: the attempts at a proof, if there were any.
        late: the limit that ran out, if one did.
    """
    proof, boxes = proof_of(exploration), 0 if proving is None else proving.boxes
    return {
        "proof": proof,
        "proved": "" if proof is None else proved_words(problem, exploration, boxes, proof),
        "unfinished": unfinished_words(problem, exploration, proving, late),
        "exhausted": exhausted_words(problem, exploration, proving),
    }


def proved_words(problem: Problem, exploration: Exploration, examined: int, proof: CutTree) -> str:
    """What is proved: which cells cannot be covered, or which cuts part them (by boxes)."""
    best = f"the best single motion covers {exploration.n_covered} of {len(problem.cells)}"
    if proof.kind == "cut":
        return (
            f"No single motion covers every cell {problem.within}, which is proved: "
            f"{sentence(proof, problem.robot, problem.cells)} ({examined} boxes); {best}."
        )
    proved = sum(ruling is Ruling.PROVED for ruling in exploration.rulings.values())
    how = list[str]()
    blockers, counted = exploration.blockers, 0
    if blockers is not None:
        for found, what in (
            (blockers.tool, "the tool collides {} in every pose, {} boxes of tilt and roll"),
            (blockers.arm, "something collides {} wherever the tool is, {} boxes of the joints"),
        ):
            boxes = [one.boxes for one in found.values() if one.confirmed]
            if boxes:
                over = "there" if proved == len(boxes) else f"over {len(boxes)} of them"
                how.append(what.format(over, sum(boxes)))
                counted += len(boxes)
    if proved > counted:
        how.insert(0, f"reach bound and branch and bound, {exploration.boxes} boxes")
    return (
        f"{proved} cell{'s are' if proved > 1 else ' is'} proved uncoverable {problem.within} "
        f"({'; '.join(how)}); {best}."
    )


def unfinished_words(
    problem: Problem, exploration: Exploration, proving: Proving | None, late: str
) -> str:
    """What is known to be left untried; empty where nothing is. `late`: the limit that ran out."""
    total = len(problem.cells)
    if late:
        return (
            f"The {late} ran out; the best single motion so far covers "
            f"{exploration.n_covered} of {total} cells."
        )
    blocked = blocked_curves(problem.cells, problem.task)
    if blocked:
        offer = smoothing_offer(problem.cells, problem.task, exploration.clock)
        return f"{blocked} {offer}".rstrip()
    missed = np.flatnonzero(~exploration.reached)
    if len(missed):
        named = problem.cells.named(missed, 3)
        return (
            f"{len(missed)} cell{'s were' if len(missed) > 1 else ' was'} neither reached nor "
            f"proved uncoverable {problem.within} ({named}); the best motion covers "
            f"{exploration.n_covered} of {total}."
        )
    if exploration.stopped:
        return (
            f"Every cell is reached, but by no single motion that was found (the best covers "
            f"{exploration.n_covered} of {total}); the search still grew when it was stopped after "
            f"{exploration.rounds} rounds. Another seed may find a motion."
        )
    if proving is None or proving.unable or proving.attempts == 0:
        return ""
    if proving.starved and not proving.alarmed:
        return ""
    kept = [gap for gap in proving.open_gaps if gap.points > 0]
    where = ""
    if kept:
        widest = max(kept, key=lambda gap: gap.high - gap.low)
        robot, joint = problem.robot, widest.joint
        low, high = (joint_value(robot, joint, value) for value in (widest.low, widest.high))
        where = f", such as with {robot.joint_names[joint]} between {low} and {high}"
    return (
        f"Every cell is reached, but by no single motion that was found (the best covers "
        f"{exploration.n_covered} of {total}); nor is there a proof, because the arm has "
        f"configurations on the surface between the parts{where}. A motion through them may have "
        "been missed; another seed or finer cells may find it."
    )


def exhausted_words(problem: Problem, exploration: Exploration, proving: Proving | None) -> str:
    """What was tried in vain."""
    tried = [f"{exploration.rounds} rounds"]
    if exploration.finest > 1:
        tried.append(f"cells cut {exploration.finest} x {exploration.finest}")
    if proving is not None and proving.attempts:
        tried.append(f"{proving.attempts} attempts at a proof, {proving.boxes} boxes")
    nodes = len(exploration.roadmap.cell)
    none, best = "by no single component", "the best"
    if exploration.begun is not None:
        none, best = "not all from the start", "that of the start"
    return (
        f"The search ended without a covering motion {problem.within}: every cell is reached, but "
        f"{none}; {best} covers {exploration.n_covered} of "
        f"{len(problem.cells)} cells ({nodes} nodes, {', '.join(tried)}, seed {exploration.seed})."
    )
