"""Random problems of which every cell can be reached, but not all in one motion, or hardly.

From the generators of `random_cases`, without its filter for cases where all methods agree: what
the oracle's quick look at the net calls disconnected, after tightening. For PUMA and UR5 the
oracle's answers on the whole patch are kept, once for a little tighter and once for a little wider
limits and cone: "feasible" for the tighter one makes any "infeasible" wrong, "not feasible" for the
wider one makes any "feasible" doubtful. For the panda there is no oracle: random problems with
narrowed limits, of which a short search reaches every cell and joins not all.

Run this file to draw the cases again.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import puma_oracle
import ur5_oracle
from following import Arm, settled
from oracle_build import built
from oracle_cases import Problem
from random_cases import (
    ARMS,
    DISCONNECTED,
    HERE,
    MOST_STEPS,
    _round,
    centred,
    collect_found,
    draw_surface,
    kind_of,
    read_found,
    tightened,
)

from feasibility import CauseKind, check
from robots import load_robot

STARTS = 12
JOBS = {
    # arm: (seed, problems wanted) of each run
    "puma560": ((41, 120),),
    "ur5": ((42, 19), (142, 14), (905, 45)),
    "panda": ((43, 34), (906, 11)),
}


class Apart(NamedTuple):
    """A problem that seems to fall apart."""

    problem: Problem
    tight_feasible: bool | None
    """Whether the oracle joins all on the patch of a slightly tighter problem; None: not known."""
    wide_feasible: bool | None
    """The same of a slightly wider one."""


def on_patch(arm: str, problem: Problem) -> Apart:
    """The problem, with the oracle's answers for a tighter and a wider one."""
    if arm == "puma560":
        tight, wide = problem.varied(0.98, -0.5), problem.varied(1.02, 0.5)
        ask = puma_oracle.solve
    elif arm == "ur5":
        tight, wide = problem.varied(0.94, -2.0), problem.varied(1.06, 2.0)
        ask = ur5_oracle.solve
    else:
        return Apart(problem, None, None)
    return Apart(problem, bool(ask(tight, "patch").feasible), bool(ask(wide, "patch").feasible))


def draw_by_oracle(rng: np.random.Generator, arm: str) -> Apart | None:
    """One problem that the oracle's net calls disconnected, or None."""
    how = ARMS[arm]
    problem = how.draw(rng)
    found = how.first(problem)
    for _ in range(MOST_STEPS):
        if not found.feasible:
            break
        problem = tightened(rng, problem, how.least_cone_deg)
        found = how.first(problem)
    if kind_of(found, problem.cells[0] * problem.cells[1]) != DISCONNECTED:
        return None
    return on_patch(arm, problem)


def reached_alone(problem: Problem, rng: np.random.Generator) -> bool:
    """Whether inverse kinematics from a few random starts reaches every cell of the panda's."""
    robot, cells, task = built(problem, load_robot("panda"))
    arm, targets = Arm(robot), task.targets(cells)
    chord = task.cone_chord + 1e-6
    for point, approach in zip(targets.points, targets.approaches, strict=True):
        for _ in range(STARTS):
            found = arm.tool(settled(arm, arm.random(rng), point, approach, task.cone))
            off = np.linalg.norm(found[0] - point), np.linalg.norm(found[1] - approach)
            if off[0] < 1e-5 and off[1] <= chord:
                break
        else:
            return False
    return True


def narrower(rng: np.random.Generator, problem: Problem) -> Problem:
    """The problem with a narrower cone, or with one end of a joint's range moved inwards."""
    plain = problem.plain()
    if rng.random() < 0.5:
        plain["cone_deg"] = round(max(problem.cone_deg * rng.uniform(0.4, 0.8), 3.0), 2)
    else:
        limits, joint = [list(pair) for pair in problem.limits_deg], rng.integers(7)
        moved = (limits[joint][1] - limits[joint][0]) * float(rng.uniform(0.15, 0.5))
        end = int(rng.integers(2))
        limits[joint][end] = round(limits[joint][end] + (-moved if end else moved), 4)
        plain["limits_deg"] = limits
    return Problem.read(plain)


def draw_panda(rng: np.random.Generator) -> Apart | None:
    """One problem for the panda that a search reaches all cells of, without joining all."""
    robot = load_robot("panda")
    made = draw_surface(rng, tuple(rng.uniform(0.1, 0.6, 2)))
    direction = rng.normal(size=3)
    place = direction / np.linalg.norm(direction) * rng.uniform(0.25, 0.8) + (0.0, 0.0, 0.33)
    low, high = np.degrees(robot.lower), np.degrees(robot.upper)
    width, narrow = high - low, rng.random(7) < 0.6
    inner = np.where(narrow, width * rng.uniform(0.25, 0.8, 7), width)
    low = low + (width - inner) * rng.uniform(0.0, 1.0, 7)
    problem = Problem(
        **made,
        position=(0.0, 0.0, 0.0),
        rpy_deg=_round(rng.uniform(-180, 180, 3)),
        cells=(int(rng.integers(2, 5)), int(rng.integers(2, 6))),
        standoff=round(float(rng.uniform(0, 0.02)), 4),
        cone_deg=round(float(np.exp(rng.uniform(np.log(3), np.log(40)))), 2),
        limits_deg=tuple(_round(pair) for pair in zip(low, low + inner, strict=True)),
    )
    problem = centred(problem, place)
    for _ in range(MOST_STEPS):
        if not reached_alone(problem, rng):
            return None
        verdict = check(*built(problem, robot))
        if not verdict.feasible:
            break
        problem = narrower(rng, problem)
    alone = all(cause.kind is CauseKind.DISCONNECTED for cause in verdict.causes)
    return None if verdict.feasible or not alone else Apart(problem, None, None)


def draw(rng: np.random.Generator, arm: str) -> Apart | None:
    """One problem that seems to fall apart, or None."""
    return draw_panda(rng) if arm == "panda" else draw_by_oracle(rng, arm)


def read_apart(arm: str) -> list[Apart]:
    """The stored problems of an arm."""
    return read_found(Apart, HERE / f"{arm}_apart.json")


def main() -> None:
    """Draw and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arms", nargs="*", default=list(JOBS))
    for arm in parser.parse_args().arms:
        path, kept = HERE / f"{arm}_apart.json", list[dict[str, Any]]()
        for seed, wanted in JOBS[arm]:
            drawn = collect_found(partial(draw, arm=arm), wanted, seed, path, kept)
            sys.stderr.write(f"{arm}: {wanted} of {drawn} drawn\n")


if __name__ == "__main__":
    main()
