"""The verifier of cut trees: what must accept a proof that no single motion covers every cell.

It shares no code with the search that guessed the tree, nor with its proofs of cells and cuts;
kinematics are Pinocchio's. A tree (see
`feasibility.cut_tree`) proves its claim if, with M the configurations inside the limits with the
tool on the surface, within tolerance and cone, and its roll in the range,

    no q in M and in the region of a cut has q_j = t, and
    no q in the region of a leaf has the tool at its cell's target, and held likewise.

A tree of one leaf needs nothing of the surface but the cell's target, so no bounds of it. It proves
its claim too where that is out of reach, and where the tool collides in every pose within tolerance
and cone of it, whatever the arm does (`collisions/every_pose.py`). And where bodies are to stay
clear of each other, M and leaves hold only what is clear.

Both say that a region is empty, which `empty_region` proves by bounds (`linear_models`,
`box_exclusion`). A joint that the tree opens at t is to have no q in M at any
t + 2 pi k; all turns place the tool alike, so one of them stands for all, and t .. t + 2 pi for the
joint's interval. A joint that slides without limits may be as far out as the tool can reach.

A tree comes from a file, so anything may be in it: what is no tree is refused with the reason.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.every_pose import never_clear
from feasibility.certification.collisions.everywhere import Overlapping
from feasibility.certification.cut_proofs.box_exclusion import TURN, JointRegion
from feasibility.certification.cut_proofs.empty_region import Claim, Emptiness, ProofCheck
from feasibility.certification.cut_proofs.linear_models import (
    Allowed,
    Parts,
    cell_parts,
    target_parts,
)
from feasibility.certification.cut_proofs.parts_agreement import disagreement
from feasibility.certification.cut_proofs.refutation import Refuter
from feasibility.certification.lever_bounds import out_of_line, stretched_length
from feasibility.collisions.asked_bodies import gather
from feasibility.cut_tree import Cut, CutTree, Leaf, malformed
from feasibility.cut_words import joint_value, place_of
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.parts import SurfaceParts
from surfaces.surface import SurfaceError

MOST_BOXES = 2_000_000
WITHOUT_BODIES = 250_000  # boxes after which it is looked into whether bodies overlap
MOST_SLIDES = 6  # joints that slide, of which all ends are looked at
CLOSE = 1e-9  # m, rounding of distances
FINE = 0.25  # of tolerance and cone, that the finest parts of the surface may be off by
NARROWEST = 1e-6  # a chord that parts of the surface are made for, at least


def verify_proof(
    robot: Robot,
    cells: Cells,
    task: Task,
    tree: CutTree,
    tick: Callable[[], object] = lambda: None,
    most: int = MOST_BOXES,
) -> ProofCheck:
    """Is it proved that no motion of the robot covers every cell?

    Args:
        robot, cells, task: the case; limits, tolerance, cone and roll are used exactly.
        tree: the proof.
        tick: called first, and every few thousand boxes; what it raises ends the verification.
        most: how many boxes may be looked at altogether.
    """
    fault = out_of_line(robot) or malformed(robot, len(cells), tree)
    if fault:
        return ProofCheck(0, (fault,))
    tick()
    if isinstance(tree.root, Leaf):
        point, approach = (each[tree.root.cell] for each in task.targets(cells)[:2])
        if too_far(robot, point, task.effective_tolerance):
            return ProofCheck(0)
        bodies = gather(robot, cells.surface, task.collision, task.standoff)
        if bodies is not None:
            most_off = task.cone, task.effective_tolerance
            alone = never_clear(robot, bodies, *most_off, point, approach, tick)
            if alone.confirmed:
                return ProofCheck(alone.boxes)
        return verify_on(robot, cells, task, tree, None, tick, most)
    cone = max(min(task.cone_chord, 1.0), NARROWEST)
    try:
        parts = cells.surface.parts(FINE * task.effective_tolerance, FINE * cone)
    except SurfaceError as error:
        return ProofCheck(0, (f"the surface has no bounds to prove anything with: {error}",))
    return verify_on(robot, cells, task, tree, parts, tick, most)


def too_far(robot: Robot, target: Array, tolerance: float) -> bool:
    """Is a target (3,) m further from the arm's first axis than the arm is long?

    Points on the axes of two joints that turn, one behind the other, keep their distance, whatever
    the joints do; where joints slide between them, it is convex in these, so largest at ends of
    strokes. The tool is no further from the first point than all of these together. Any points will
    do; those are looked for that leave the target furthest out. (The search asks `robots/reach.py`;
    this is written again so that a fault there is no fault here.)
    """
    moves = robot.lower < robot.upper
    turns, slides = (np.flatnonzero(moves & kind) for kind in (~robot.prismatic, robot.prismatic))
    strokes = np.column_stack([robot.lower, robot.upper])[slides]
    if len(slides) > MOST_SLIDES or not np.isfinite(strokes).all():
        return False
    q = np.tile(np.where(moves, 0.0, robot.lower), (2 ** len(slides), 1))
    q[:, slides] = list(itertools.product(*strokes))
    kinematics = Kinematics(robot)
    points, axes = kinematics.joints(q).points[:, 1 + turns], kinematics.twists(q)[:, 3:, turns]
    tool = kinematics.tools(q)[0][:, None]

    def beyond(along: Array) -> float:
        string = np.concatenate([points + along[:, None] * axes.swapaxes(1, 2), tool], axis=1)
        first = string[:, 0].mean(axis=0)
        links = np.linalg.norm(np.diff(string, axis=1), axis=2).max(axis=0).sum()
        from_first = np.linalg.norm(string[:, 0] - first, axis=1).max()
        return float(np.linalg.norm(target - first) - links - from_first)

    from scipy.optimize import minimize

    best = np.zeros(len(turns))
    if len(turns):
        best = minimize(lambda along: -beyond(along), best, method="Powell").x
    return beyond(best) > tolerance + CLOSE


def verify_on(
    robot: Robot,
    cells: Cells,
    task: Task,
    tree: CutTree,
    parts: SurfaceParts | None,
    tick: Callable[[], object] = lambda: None,
    most: int = MOST_BOXES,
) -> ProofCheck:
    """The same, with the surface's parts given; the tree is well formed.

    Where it is one leaf they may be None: then nothing is asked of the surface, nor is it where
    joints are opened, as a turn of each is all that there is.
    """
    held, first, fault = cell_parts(task.targets(cells)), 0, ""
    if parts is not None:
        fault, first = disagreement(cells, parts), len(parts)
        held = held.join(target_parts(parts, cells, task), held)
    whole = tree.root.cell if parts is None and isinstance(tree.root, Leaf) else 0
    one = held.of(slice(whole, whole + 1))
    limits, endless = _finite_slides(robot, one, task.effective_tolerance)
    if fault or endless:
        return ProofCheck(0, (fault or endless,))
    allowed = Allowed.by(task, robot, limits.low, limits.high)

    claims = list(_claims(robot, cells, tree, limits, first))
    if parts is None:
        claims = [one for one in claims if one.cell is not None]
    refuter = Refuter(robot, cells, task, allowed.length)
    bodies = gather(robot, cells.surface, task.collision, task.standoff)

    def tested(boxes: int, overlapping: Overlapping | None = None) -> ProofCheck:
        return Emptiness(Kinematics(robot), held, allowed, tick, overlapping).test(
            claims, refuter, boxes
        )

    found = tested(most if bodies is None else min(most, WITHOUT_BODIES))
    if not found.accepted and bodies is not None:
        found = tested(most, Overlapping(robot, bodies))
    return found


def _finite_slides(robot: Robot, surface: Parts, tolerance: float) -> tuple[JointRegion, str]:
    """The limits, those of one joint that slides freely bounded by reach; or why that fails."""
    low, high = robot.lower.copy(), robot.upper.copy()
    (free,) = np.nonzero(robot.prismatic & ~np.isfinite(high - low))
    if len(free) > 1:
        names = " and ".join(robot.joint_names[j] for j in free)
        return JointRegion(low, high), f"{names} slide without limits, which no bound covers"
    for j in free:
        # p is the sum of the links' vectors and of the slides', so |q_j| <= |p| + all the others.
        root = np.linalg.norm(surface.slopes[0, :, :3], axis=1).sum() + surface.radius[0, 0]
        furthest = float(np.linalg.norm(surface.centre[0, :3]) + root) + tolerance
        reach = 1.001 * (furthest + stretched_length(robot, without=int(j))) + 1e-6
        low[j], high[j] = max(low[j], -reach), min(high[j], reach)
    return JointRegion(low, high), ""


def _claims(
    robot: Robot, cells: Cells, tree: CutTree, limits: JointRegion, first: int
) -> Iterator[Claim]:
    """Everything that a tree claims to be empty: joints opened, cuts and leaves.

    The part `first` is the first cell's target, the part 0 the surface.
    """
    low, high = limits.low.copy(), limits.high.copy()
    for joint, value in tree.opened:
        at = limits.low.copy(), limits.high.copy()
        at[0][joint] = at[1][joint] = value
        place = f"{robot.joint_names[joint]} = {joint_value(robot, joint, value)}"
        yield Claim(f"the opening {place}", JointRegion(*at), None, 0)
        low[joint], high[joint] = value, value + TURN
    waiting: list[tuple[Cut | Leaf, JointRegion]] = [(tree.root, JointRegion(low, high))]
    leaves = 0
    while waiting:
        node, region = waiting.pop()
        if isinstance(node, Leaf):
            leaves += 1
            name = list(cells.unravel(node.cell))
            yield Claim(f"leaf {leaves} (cell {name})", region, node.cell, first + node.cell)
            continue
        joint, value = node.joint, node.value
        what = f"the cut {place_of(node, robot)}"
        yield Claim(what, region.within(joint, value, value), None, 0)
        waiting.append((node.above, region.within(joint, value, np.inf)))
        waiting.append((node.below, region.within(joint, -np.inf, value)))
