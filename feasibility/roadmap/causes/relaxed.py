"""Relaxed problems over one cell, solved by Newton from random starts.

Where the range of the roll alone prevents a cell: at which rolls the arm has it.
"""

import numpy as np

from coverable.arrays import Array
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.projection import PROJECTION_STEPS, project_onto_cell
from feasibility.roadmap.motions.search_arrays import SearchArrays, with_free_roll
from feasibility.roadmap.motions.working_memory import Work
from feasibility.roll import Roll, roll_of
from robots.kinematics import Kinematics

STARTS = 16  # Newton starts for each relaxed problem
MANY = 32  # configurations whose rolls are looked at
GAP = np.radians(15.0)  # between neighbouring rolls of one range
HALVINGS = 9  # of the way from the range to the nearest roll that was seen


def solutions(arrays: SearchArrays, work: Work, cell: int, guesses: Array, most: int = 1) -> Array:
    """(k, n) configurations of a relaxed problem over one cell, from guesses (g, n); k <= most."""
    found: list[Array] = []
    for guess in guesses:
        q = guess.copy()
        if project_onto_cell(arrays, work, cell, q, PROJECTION_STEPS):
            found.append(q)
            if len(found) == most:
                break
    return np.reshape(found, (-1, guesses.shape[1]))


def with_cone(arrays: SearchArrays, chord: float) -> SearchArrays:
    """The same arrays with another cone, for one cell's centre: no curve deviates there."""
    return arrays._replace(cone_chord=chord, inner_cone_chord=chord, settled_chord=chord)


def other_rolls(exploration: Exploration, cell: int) -> str:
    """The nearest rolls at which the arm has the cell, in words; empty where others prevent it."""
    arrays, work = exploration.arrays, exploration.work
    middle, half = arrays.roll.tolist()
    if not half < np.inf:
        return ""
    free = with_cone(with_free_roll(arrays), arrays.cone_chord)
    q = solutions(free, work, cell, exploration.guesses(4 * MANY), MANY)
    off = np.sort(_off_middle(exploration, cell, q))
    if not len(q) or np.abs(off).min() <= half:
        return ""
    nearest = float(off[np.argmin(np.abs(off))])
    low, high = half, abs(nearest)
    for _ in range(HALVINGS):
        tried = 0.5 * (low + high)
        wider = free._replace(roll=np.array([middle, tried]))
        q = solutions(wider, work, cell, exploration.guesses(STARTS))
        if len(q):
            found = float(_off_middle(exploration, cell, q)[0])
            nearest = found if half < abs(found) < abs(nearest) else nearest
            high = min(tried, abs(nearest))
        else:
            low = tried
    ends = sorted((nearest, _far_end(off, nearest)))
    first, last, least, most = (
        f"{np.degrees(middle + end):.1f}".removesuffix(".0") for end in (*ends, -half, half)
    )
    where = f"from {first} to {last} deg" if first != last else f"at {first} deg"
    return f"roll: possible {where}; {least} to {most} deg are allowed"


def _off_middle(exploration: Exploration, cell: int, q: Array) -> Array:
    """(k,) rad, rolls of configurations (k, n) over a cell, from the middle of the range."""
    arrays, robot = exploration.arrays, exploration.robot
    _, axes, x = Kinematics(robot).held(q)
    at = np.ones((len(q), 1))
    rolls = roll_of(x, axes, at * arrays.references[cell], at * arrays.approaches[cell])
    return Roll(float(arrays.roll[0]), 0.0).off(rolls)


def _far_end(off: Array, nearest: float) -> float:
    """The furthest of rolls (k,) that follow the nearest one without a gap."""
    beyond = np.sort(np.abs(off[np.sign(off) == np.sign(nearest)]))
    end = abs(nearest)
    for roll in beyond[beyond > end]:
        if roll - end > GAP:
            break
        end = float(roll)
    return float(np.copysign(end, nearest))
