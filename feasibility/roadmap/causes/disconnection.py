"""Why the best motion misses a cell that another one covers: where it stopped, or a proved cut."""

from feasibility.collisions.problem_bodies import Pair
from feasibility.cut_tree import CutTree, Leaf
from feasibility.cut_words import nowhere
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import Blocked
from feasibility.roadmap.motions import search_arrays as stop
from feasibility.verdict import Cause, CauseKind


def disconnected(
    exploration: Exploration, cell: int, proof: CutTree | None = None, pairs: tuple[Pair, ...] = ()
) -> Cause:
    """Why the best component misses a cell that another one covers; proved where a cut parts them.

    `proof` is that no motion covers every cell; `pairs` have to stay clear of each other.
    """
    roadmap, robot = exploration.roadmap, exploration.robot
    roots = {roadmap.root_of(node) for node in reversed(roadmap.over[cell])}
    other = max(roots, key=lambda root: roadmap.size[root])
    detail = (
        f"reached by another motion only, which covers {roadmap.size[other]} of "
        f"{len(exploration.cells)} cells"
    )
    parted = "" if proof is None else _parted(exploration, proof, other, roots)
    if parted:
        return Cause(cell, CauseKind.DISCONNECTED, True, f"{detail}; {parted}")
    code, joint, stopped = roadmap.blocked.get(cell, Blocked(-1, -1, -1))
    name = robot.joint_names[joint] if joint < robot.n else ""
    met = pairs[joint] if code == stop.COLLISION and 0 <= joint < len(pairs) else None
    reason = {
        stop.LIMIT: f"{name} stops at its limit" if joint >= 0 else "a joint stops at its limit",
        stop.CONE: "the tool axis stops at the boundary of the cone",
        stop.ROLL: "the roll of the tool stops at the end of its range",
        stop.SINGULAR: "the arm stops at a singularity",
        stop.COLLISION: _stopped_by(met),
        stop.LONG: "the motion takes too many steps",
        stop.FOLD: "the surface is creased, or its offset folds",
    }.get(code)
    if reason and roadmap.root(stopped) == exploration.best:
        detail += f"; on the way there from the covered cells {reason}"
        pair = None if met is None else (met.first, met.second)
        return Cause(cell, CauseKind.DISCONNECTED, False, detail, pair)
    return Cause(cell, CauseKind.DISCONNECTED, False, detail)


def _stopped_by(pair: Pair | None) -> str:
    """That a pair stopped a motion, in words; empty where it is not known."""
    if pair is None:
        return ""
    names = f"{pair.first} and {pair.second}"
    if pair.clearance > 0.0:
        return f"{names} would come nearer than {1e3 * pair.clearance:g} mm"
    return f"{names} would collide"


def _parted(exploration: Exploration, proof: CutTree, other: int, roots: set[int]) -> str:
    """Which cut keeps the best component from another one; empty where none parts it from `roots`.

    All of a component is on one side of each cut of its region: one configuration is enough.
    """
    best = exploration.posture(exploration.best)
    cuts = {root: proof.path_to(best, exploration.posture(root))[1] for root in roots}
    cut = cuts[other]
    if isinstance(cut, Leaf) or any(isinstance(one, Leaf) for one in cuts.values()):
        return ""
    where = "on the surface" if cut is proof.root else "in that part of the joint space"
    above = proof.folded(best)[cut.joint] > cut.value
    side = "above" if above else "below"
    return f"{nowhere(cut, exploration.robot, where)}, and the best motion is {side}"
