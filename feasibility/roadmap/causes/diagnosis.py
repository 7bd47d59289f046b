"""Why a cell is missed: which constraint must be relaxed for the arm to cover it, and by how much.

For a cell that no component reaches four relaxed problems are solved, each by Newton from random
starts and a descent on the constraint that was dropped:

- limits, cone and roll dropped: how near does the tool point get?   -> out of reach, by how much
- cone and roll dropped: how small does the angle get?               -> orientation, which angle
- only the range of the roll dropped: at which rolls can the arm be there?   -> orientation
- only the limits dropped: how little does a joint have to pass its limit?  -> which joint, how far

Where dropping either the cone or the limits would be enough, the cause is the cone if the tool
point is reached inside the limits, and the detail names both. A cell that another component reaches
is disconnected: the detail says what that component covers and what stops the motion. So is a cell
with a valid configuration that the search had not found, as after a search that was stopped early.
"""

from dataclasses import replace

import numpy as np

from coverable.arrays import Array
from coverable.kernels import allocating_entry
from feasibility.collisions.problem_bodies import Pair
from feasibility.cone import angle_of
from feasibility.cut_tree import CutTree
from feasibility.roadmap.causes.collision import colliding, proved_collision
from feasibility.roadmap.causes.disconnection import disconnected
from feasibility.roadmap.causes.relaxed import STARTS, other_rolls, solutions, with_cone
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.linear_steps import cholesky_solve
from feasibility.roadmap.motions.search_arrays import SearchArrays, with_free_roll
from feasibility.roadmap.motions.self_motion import connect
from feasibility.roadmap.motions.working_memory import NEXT, place, put
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.rounds import evenly
from feasibility.verdict import Cause, CauseKind
from robots.chain import jacobians
from robots.kinematics import Kinematics
from robots.robot import Robot

MOST_EXAMINED = 400  # cells that are diagnosed one by one
ENOUGH = 5  # solutions among which the least violation is taken
UNPROVED = "not proved: off its target, within the tolerance, the tool point may do better"
MOST_DECIMALS = 6


@allocating_entry
def nearest_point(arrays, work, cell, guesses):  # noqa: ANN001, ANN201
    """Smallest distance of the tool point from the target, by damped descent from guesses."""
    n = guesses.shape[1]
    best = np.inf
    q, step = np.empty(n), np.empty(n)
    square, pull = np.empty((4, 4)), np.empty(4)
    look_at(arrays, work, cell)
    for g in range(guesses.shape[0]):
        put(q, guesses[g])
        damping = 0.1
        place(arrays, work, NEXT, q)
        error = work.error[1, 0]
        for _ in range(80):
            jacobians(
                arrays.chain, work.origins[1], work.axes[1], work.point[1], work.axis[1],
                work.point_rows, work.axis_rows,
            )  # fmt: skip
            trace = 0.0
            for i in range(3):
                pull[i] = work.target[0, i] - work.point[1, i]
                for k in range(i + 1):
                    total = 0.0
                    for j in range(n):
                        total += work.point_rows[i, j] * work.point_rows[k, j]
                    square[i, k] = total
                trace += square[i, i]
            for i in range(3):
                square[i, i] += damping * trace + 1e-12
            if not cholesky_solve(square, pull, 3):
                break
            for j in range(n):
                step[j] = q[j]
                for k in range(3):
                    step[j] += work.point_rows[k, j] * pull[k]
                step[j] = min(max(step[j], arrays.lower[j]), arrays.upper[j])
            place(arrays, work, NEXT, step)
            if work.error[1, 0] < error:
                gain = error - work.error[1, 0]
                error = work.error[1, 0]
                put(q, step)
                damping *= 0.5
                if gain < 1e-7 * arrays.scale:
                    break
            else:
                damping = 4.0 * damping + 1e-3
                place(arrays, work, NEXT, q)
                if damping > 1e3:
                    break
        best = min(best, error)
    return best


def _wrapped(robot: Robot, q: Array) -> Array:
    """q with each revolute joint at the winding that passes its limits least."""
    best, least = q, np.full(robot.n, np.inf)
    for k in (-1.0, 0.0, 1.0):
        value = q + np.where(robot.prismatic, 0.0, 2.0 * np.pi * k)
        past = np.abs(value - np.clip(value, robot.lower, robot.upper))
        best = np.where(past < least, value, best)
        least = np.minimum(past, least)
    return best


def _past_limits(exploration: Exploration, relaxed: SearchArrays, cell: int, found: Array) -> str:
    """Which joints pass their limits, and how far, in words; empty when none has to.

    Of the configurations found (k, n) over a cell, from which self-motions lead towards the limits,
    the one that passes them least.
    """
    robot = exploration.robot
    best, least = found[0], np.inf
    for q in found:
        here = _wrapped(robot, q)
        goal = np.clip(here, robot.lower, robot.upper)
        look_at(relaxed, exploration.work, cell)
        motion, _ = connect(relaxed, exploration.work, here, goal)
        here = _wrapped(robot, motion[-1]) if len(motion) else here
        past = float(np.abs(here - np.clip(here, robot.lower, robot.upper)).sum())
        if past < least:
            best, least = here, past
    limit = np.clip(best, robot.lower, robot.upper)
    parts = []
    for j in np.argsort(-np.abs(best - limit)):
        if abs(best[j] - limit[j]) > 1e-6:
            scale, unit = (1e3, "mm") if robot.prismatic[j] else (np.degrees(1.0), "deg")
            parts.append(
                f"{robot.joint_names[j]} would need {scale * best[j]:.1f} {unit}; "
                f"it stops at {scale * limit[j]:.1f} {unit}"
            )
    return ", and ".join(parts)


def _smallest_angle(exploration: Exploration, relaxed: SearchArrays, cell: int) -> float:
    """Smallest angle (rad) between tool axis and approach direction with the point reached."""
    approach = relaxed.approaches[cell]
    work = exploration.work
    found = solutions(relaxed, work, cell, exploration.guesses(2 * STARTS), STARTS)
    _, axes = Kinematics(exploration.robot).tools(found)
    chords = [float(np.linalg.norm(axis - approach)) for axis in axes]
    low, high = 0.0, 2.0 * np.arcsin(min(0.5 * min(chords, default=2.0), 1.0))
    # Bisect on the cone: is there a configuration inside a narrower one?
    for _ in range(9):
        middle = 0.5 * (low + high)
        narrowed = with_cone(relaxed, 2.0 * np.sin(0.5 * middle))
        if len(solutions(narrowed, work, cell, exploration.guesses(STARTS))):
            high = middle
        else:
            low = middle
    return high


def decimals(value: float, bound: float, least: int) -> int:
    """Number of decimals, at least `least`, that distinguish a value from the bound it passes.

    Example:
        >>> decimals(3.02, 3.0, 1)
        2
    """
    for count in range(least, MOST_DECIMALS):
        if f"{value:.{count}f}" != f"{bound:.{count}f}":
            return count
    return MOST_DECIMALS


def diagnose(exploration: Exploration, cell: int) -> Cause:
    """Why no component of a finished search reaches a cell.

    The relaxed problems hold the tool point at its target, as the search does. A proof takes the
    full tolerance into account; without one the detail says that this was not done.

    It is proved where branch and bound or the reach bound ruled the cell out, or the tool collides
    in every pose over it.
    """
    cause = proved_collision(exploration, cell) or _cause(exploration, cell)
    settled = cause.proved or cause.kind is CauseKind.DISCONNECTED
    if settled or not exploration.arrays.cone_chord > 0.0:
        return cause
    return replace(cause, detail=f"{cause.detail}; {UNPROVED}")


def _cause(exploration: Exploration, cell: int) -> Cause:
    """The cause, its detail without the remark that it is not proved."""
    arrays, robot, work = exploration.arrays, exploration.robot, exploration.work
    proved = exploration.rulings.get(cell) is Ruling.PROVED
    unlimited = arrays._replace(
        lower=np.where(robot.prismatic, robot.lower, -np.inf),
        upper=np.where(robot.prismatic, robot.upper, np.inf),
    )
    slack_cone = with_free_roll(with_cone(arrays, np.inf))
    anything = with_free_roll(with_cone(unlimited, np.inf))
    guesses = exploration.guesses(STARTS)
    if not arrays.cone_chord > 0.0 and not proved:
        detail = "a cone of 0 degrees leaves no margin in which a motion could be certified"
        return Cause(cell, CauseKind.ORIENTATION, False, detail)
    if not len(solutions(anything, work, cell, guesses)):
        distance = nearest_point(unlimited, work, cell, guesses[:6])
        return Cause(cell, CauseKind.OUT_OF_REACH, proved, _short(exploration, cell, distance))
    found = solutions(unlimited, work, cell, guesses, ENOUGH)
    past = _past_limits(exploration, unlimited, cell, found) if len(found) else ""
    rolls = other_rolls(exploration, cell)
    if rolls:
        detail = f"{rolls}; or {past}" if past else rolls
        return Cause(cell, CauseKind.ORIENTATION, proved, detail)
    if len(solutions(slack_cone, work, cell, guesses)):
        angle = np.degrees(_smallest_angle(exploration, slack_cone, cell))
        alpha = np.degrees(angle_of(arrays.cone_chord))
        if angle <= alpha and not proved:
            detail = "the arm has a configuration there, but the search ended before it was reached"
            return Cause(cell, CauseKind.DISCONNECTED, False, detail)
        fine = decimals(angle, alpha, 1)
        detail = f"the tool tilts {angle:.{fine}f} deg there at best, the cone allows {alpha:g} deg"
        if past:
            detail += f"; or {past}"
        return Cause(cell, CauseKind.ORIENTATION, proved, detail)
    if not past:
        found = solutions(anything, work, cell, guesses, ENOUGH)
        past = _past_limits(exploration, anything, cell, found)
        past = (
            f"for the tool point alone {past}; no configuration was found inside the cone"
            if past
            else "the target lies past the limits by no more than the tolerance"
        )
    return Cause(cell, CauseKind.JOINT_LIMITS, proved, past)


def _short(exploration: Exploration, cell: int, distance: float) -> str:
    """By how much (m) the tool point falls short of a cell, in words."""
    reach = exploration.robot.reach
    away = float(exploration.robot.distance_from_base(exploration.arrays.points[cell]))
    short, far = decimals(1e3 * distance, 0.0, 0), decimals(away, reach, 3)
    bound = (
        f"the arm reaches at most {reach:.{far}f} m"
        if away > reach
        else f"within its outer reach of {reach:.{far}f} m, but no configuration brings the tool "
        "point there"
    )
    return (
        f"the tool point stays {1e3 * distance:.{short}f} mm short; the target is {away:.{far}f} m "
        f"from the first joint, {bound}"
    )


def cause_of(exploration: Exploration, cell: int, pairs: tuple[Pair, ...] = ()) -> Cause:
    """Why no component reaches a cell, see `diagnose`; or a collision of some of `pairs`."""
    return colliding(exploration, cell, pairs) or diagnose(exploration, cell)


def causes_of(
    exploration: Exploration, proof: CutTree | None = None, pairs: tuple[Pair, ...] = ()
) -> tuple[Cause, ...]:
    """One cause for each cell that the best component misses, in order of index.

    On fine grids `MOST_EXAMINED` cells, spread evenly, are diagnosed one by one. The others are
    given the cause of the nearest of these, and their details say so.

    Args:
        exploration: a finished search.
        proof: that no motion covers every cell.
        pairs: that have to stay clear of each other.

    Raises:
        OutOfTime: the deadline passed.
    """
    reached, points = exploration.reached, exploration.arrays.points
    missed = np.flatnonzero(~exploration.covered)
    causes: dict[int, Cause] = {}
    for cell in missed[reached[missed]].tolist():
        causes[cell] = disconnected(exploration, cell, proof, pairs)
    lost = missed[~reached[missed]]
    examined = evenly(lost)[:MOST_EXAMINED]
    for cell in examined.tolist():
        exploration.tick("finding causes")
        causes[cell] = cause_of(exploration, cell, pairs)
    for cell in lost.tolist():
        if cell not in causes:
            near = int(examined[np.argmin(np.linalg.norm(points[examined] - points[cell], axis=1))])
            proved = exploration.rulings.get(cell) is Ruling.PROVED
            index = list(exploration.cells.unravel(near))
            alike = causes[near].detail.removesuffix(f"; {UNPROVED}")
            detail = f"like {index}, the nearest cell examined: {alike}"
            causes[cell] = replace(causes[near], cell=cell, proved=proved, detail=detail)
    return tuple(causes[cell] for cell in missed.tolist())
