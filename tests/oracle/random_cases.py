"""Random problems with the oracles' answers, kept only where the answer does not hang by a hair.

A case is *sure* when verdict and number of covered cells stay the same on both domains, at two
resolutions, with the cone 2 % and every limit 0.5 degrees tighter and wider, and with the surface
moved by the task's tolerance along its normal and in four directions of space. Run this file to
draw the cases again and to write the JSON files beside it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import puma_oracle
import ur5_oracle
from numpy.typing import NDArray
from oracle_cases import Answer, Problem, patch
from puma_oracle import Resolution

HERE = Path(__file__).parents[1] / "questions"
TOLERANCE = 1e-3  # [m] the complete search's default
TABLE_1 = (
    ((-180, 180),) * 6,
    ((-170, 170), (-170, 75), (-180, 175), (-135, 190), (-100, 90), (-90, 90)),
    ((-90, 10), (-170, 75), (-180, 90), (-135, 170), (-100, 90), (-90, 90)),
    ((-110, 145), (-110, 75), (-110, 40), (-150, 120), (-45, 140), (-180, 180)),
)
SHIFTS = (
    TOLERANCE
    / np.sqrt(3.0)
    * np.array([(0, 0, 0), (1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
)
MOST_STEPS = 6
FEASIBLE, UNREACHABLE, DISCONNECTED = "feasible", "unreachable", "disconnected"
FOUND = "found"  # a file of sure cases that are added by hand, not drawn


def kind_of(found: Answer, cells: int) -> str:
    """Which of the three sorts of problem an answer makes."""
    if found.feasible:
        return FEASIBLE
    return DISCONNECTED if found.reachable == cells else UNREACHABLE


def _moved(problem: Problem, shift: np.ndarray) -> Problem:
    """The problem with its surface moved, m."""
    plain = problem.plain()
    plain["position"] = tuple(float(x) for x in np.array(problem.position) + shift)
    return Problem.read(plain)


def puma_first(problem: Problem) -> Answer:
    """A quick answer, to sort by."""
    return puma_oracle.solve(problem, "net", Resolution(rows=5.0, turn_deg=5.0))


def puma_variants(problem: Problem) -> Iterator[tuple[Problem, str, Resolution]]:
    """What a sure case must answer alike, the likeliest to differ first."""
    fine = Resolution(rows=12.0, turn_deg=2.0, samples=3000)
    coarse = Resolution(rows=5.0, turn_deg=5.0)
    tight = problem.varied(cone=0.98, limits_deg=-0.5)
    wide = problem.varied(cone=1.02, limits_deg=0.5)
    yield tight, "net", Resolution()
    yield wide, "patch", Resolution()
    yield problem, "net", fine
    yield problem, "patch", fine
    yield problem, "patch", coarse
    for shift in SHIFTS[1:]:
        yield _moved(tight, shift), "net", Resolution()
        yield _moved(wide, shift), "patch", Resolution()
    for sign in (-1.0, 1.0):
        yield tight.varied(standoff=sign * TOLERANCE), "net", Resolution()
        yield wide.varied(standoff=sign * TOLERANCE), "patch", Resolution()


def puma_sure(problem: Problem, first: Answer) -> bool:
    """Whether every variant gives the first answer."""
    return all(puma_oracle.solve(p, on, how) == first for p, on, how in puma_variants(problem))


def _round(values: Any) -> Any:
    """Numbers as the file holds them."""
    return tuple(round(float(x), 4) for x in values)


def draw_surface(rng: np.random.Generator, span: tuple[float, float]) -> dict[str, Any]:
    """Shape, ranges and side of a random patch whose sides are about `span` m long."""
    kind = str(rng.choice(["sphere", "cylinder", "hyperboloid", "plane"], p=[0.3, 0.3, 0.1, 0.3]))
    side = str(rng.choice(["inside", "outside"]))
    if kind == "plane":
        u, v, size = (0.0, span[0]), (0.0, span[1]), ()
    elif kind == "sphere":
        radius = float(rng.uniform(0.25, 1.2))
        wide = np.minimum(np.degrees(np.array(span) / radius), 120.0)
        middle = rng.uniform(60, 120)
        u = (max(middle - wide[0] / 2, 5), min(middle + wide[0] / 2, 175))
        v, size = (0.0, wide[1]), (radius,)
    else:
        radius = float(rng.uniform(0.2, 1.0))
        start = rng.uniform(-180, 180)
        u = (start, start + min(np.degrees(span[0] / radius), 300.0))
        low = rng.uniform(-0.5, 0.3)
        v = (low, low + span[1])
        size = (radius,) if kind == "cylinder" else (radius, float(rng.uniform(0.3, 1.0)))
    return {"kind": kind, "side": side, "size": _round(size), "u": _round(u), "v": _round(v)}


def draw_limits(rng: np.random.Generator) -> tuple[tuple[float, float], ...]:
    """A set of Table I, or random limits around it, some wider than a turn."""
    if rng.random() < 0.5:
        return tuple(_round(pair) for pair in TABLE_1[rng.integers(4)])
    low, high = -rng.uniform(40, 190, 6), rng.uniform(40, 190, 6)
    free = rng.random(6) < 0.2
    low, high = np.where(free, -200.0, low), np.where(free, 200.0, high)
    return tuple(_round(pair) for pair in zip(low, high, strict=True))


def centred(problem: Problem, place: NDArray[np.float64]) -> Problem:
    """The problem with the middle of its patch at a place (m)."""
    middle = problem.targets(*np.array([r.mean() for r in problem.ranges])[:, None])[0][0]
    return Problem.read({**problem.plain(), "position": _round(place - middle)})


def draw(rng: np.random.Generator) -> Problem:
    """A random problem, its patch around a random place at 0.3 to 1.4 m from the shoulder."""
    hard = rng.random() < 0.6  # large patches and narrow cones, which fall apart more often
    made = draw_surface(rng, tuple(rng.uniform(0.4 if hard else 0.1, 1.0, 2) ** 1.3))
    direction = rng.normal(size=3)
    place = direction / np.linalg.norm(direction) * rng.uniform(0.3, 1.35)
    problem = Problem(
        **made,
        position=(0.0, 0.0, 0.0),
        rpy_deg=_round(rng.uniform(-180, 180, 3)),
        cells=(int(rng.integers(3, 7)), int(rng.integers(3, 9))),
        standoff=round(float(rng.choice([0.0, 0.005, rng.uniform(0, 0.03)])), 4),
        cone_deg=round(float(np.exp(rng.uniform(np.log(3), np.log(30 if hard else 90)))), 2),
        limits_deg=draw_limits(rng),
    )
    return centred(problem, place)


def draw_ur5(rng: np.random.Generator) -> Problem:
    """A random small patch for the UR5, clear of its first axis; half turns, or a little else."""
    made = draw_surface(rng, tuple(rng.uniform(0.15, 0.6, 2)))
    direction = rng.normal(size=3)
    place = direction / np.linalg.norm(direction) * rng.uniform(0.35, 0.85) + (0.0, 0.0, 0.09)
    limits = np.tile((-180.0, 180.0), (6, 1))
    if rng.random() < 0.5:
        limits[:5, 0], limits[:5, 1] = -rng.uniform(60, 180, 5), rng.uniform(60, 180, 5)
    elif rng.random() < 0.4:
        limits[3:] = (-360.0, 360.0)
    problem = Problem(
        **made,
        position=(0.0, 0.0, 0.0),
        rpy_deg=_round(rng.uniform(-180, 180, 3)),
        cells=(int(rng.integers(3, 5)), int(rng.integers(3, 6))),
        standoff=round(float(rng.uniform(0, 0.02)), 4),
        cone_deg=round(float(np.exp(rng.uniform(np.log(18), np.log(70)))), 2),
        limits_deg=tuple(_round(pair) for pair in limits),
    )
    problem = centred(problem, place)
    points, _ = problem.targets(*patch(problem, 9).uv.T)
    near = np.hypot(points[:, 0], points[:, 1]).min() < ur5_oracle.CLEARANCE + 0.03
    return draw_ur5(rng) if near else problem


def ur5_first(problem: Problem) -> Answer:
    """A quick answer, to sort by."""
    return ur5_oracle.solve(problem, "net", ur5_oracle.Resolution(steps=5.0, pieces=4))


def ur5_sure(problem: Problem, first: Answer) -> bool:
    """As `puma_sure`, with wider margins, because psi is sampled and the reach enters the mask."""
    tight = problem.varied(cone=0.94, limits_deg=-2.0)
    wide = problem.varied(cone=1.06, limits_deg=2.0)
    usual, fine = ur5_oracle.Resolution(), ur5_oracle.Resolution(steps=12.0, pieces=9, refine=5)
    asked = [(tight, "net", usual), (wide, "patch", usual), (problem, "patch", fine)]
    for shift in 3.0 * SHIFTS[1:]:
        asked += [(_moved(tight, shift), "net", usual), (_moved(wide, shift), "patch", usual)]
    return all(ur5_oracle.solve(p, on, how) == first for p, on, how in asked)


def tightened(rng: np.random.Generator, problem: Problem, least: float = 3.0) -> Problem:
    """The problem with a narrower cone, or with narrower limits of one joint."""
    plain = problem.plain()
    if rng.random() < 0.5:
        plain["cone_deg"] = round(max(problem.cone_deg * rng.uniform(0.3, 0.8), least), 2)
    else:
        limits, joint = [list(pair) for pair in problem.limits_deg], rng.integers(5)
        end = rng.integers(2)
        limits[joint][end] = round(limits[joint][end] * float(rng.uniform(0.3, 0.8)), 4)
        plain["limits_deg"] = limits
    return Problem.read(plain)


class Drawing(NamedTuple):
    """How the cases of one arm are drawn."""

    draw: Callable[[np.random.Generator], Problem]
    first: Callable[[Problem], Answer]
    is_sure: Callable[[Problem, Answer], bool]
    least_cone_deg: float
    """Where tightening the cone ends."""


ARMS = {
    "puma560": Drawing(draw, puma_first, puma_sure, 3.0),
    "ur5": Drawing(draw_ur5, ur5_first, ur5_sure, 15.0),
}
JOBS = [
    # arm, sort, seed, cases wanted, problems drawn at most
    ("puma560", DISCONNECTED, 22, 90, 4000),
    ("puma560", FEASIBLE, 20, 90, 4000),
    ("puma560", UNREACHABLE, 21, 90, 4000),
    ("ur5", DISCONNECTED, 25, 14, 400),
    ("ur5", FEASIBLE, 23, 16, 400),
    ("ur5", UNREACHABLE, 24, 14, 400),
]


def collect(arm: str, sort: str, seed: int, wanted: int, most: int) -> int:
    """Draw until there are enough sure cases of one sort, and write them; returns how many."""
    how, rng = ARMS[arm], np.random.default_rng(seed)
    kept: list[dict[str, Any]] = []
    for _ in range(most):
        problem = how.draw(rng)
        cells = problem.cells[0] * problem.cells[1]
        found = how.first(problem)
        # Few random problems fall apart with every cell in reach; those that are feasible often do
        # when they are tightened step by step.
        steps = MOST_STEPS if sort == DISCONNECTED else 0
        while found.feasible and steps > 0:
            problem, steps = tightened(rng, problem, how.least_cone_deg), steps - 1
            found = how.first(problem)
        # Patches of which nothing can be reached say little; a few are enough.
        dull = found.reachable == 0 and rng.random() < 0.9
        if kind_of(found, cells) == sort and not dull and how.is_sure(problem, found):
            kept.append({**problem.plain(), **found._asdict()})
            write(HERE / f"{arm}_{sort}.json", kept)
        if len(kept) == wanted:
            break
    return len(kept)


def write(path: Path, cases: list[dict[str, Any]]) -> None:
    """One case a line, so that a change shows."""
    lines = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def collect_found(
    search: Callable[[np.random.Generator], Any],
    wanted: int,
    seed: int,
    path: Path,
    kept: list[dict[str, Any]],
) -> int:
    """Add what a search finds until so many are new, writing all; returns how many were drawn."""
    rng, drawn, most = np.random.default_rng(seed), 0, len(kept) + wanted
    while len(kept) < most:
        found, drawn = search(rng), drawn + 1
        if found is not None:
            rest = found._asdict()
            kept.append({**rest.pop("problem").plain(), **rest})
            write(path, kept)
    return drawn


def read_found(kind: type[Any], path: Path) -> list[Any]:
    """The stored named tuples of a kind, whose first field is the problem."""
    found = []
    for case in json.loads(path.read_text(encoding="utf-8")):
        rest = [case.pop(field) for field in kind._fields[1:]]
        found.append(kind(Problem.read(case), *rest))
    return found


def read(arm: str) -> list[tuple[Problem, Answer]]:
    """The stored cases of an arm: sort by sort, then those that a search once got wrong."""
    found = []
    for sort in (FEASIBLE, UNREACHABLE, DISCONNECTED, FOUND):
        path = HERE / f"{arm}_{sort}.json"
        if sort == FOUND and not path.exists():
            continue
        for case in json.loads(path.read_text(encoding="utf-8")):
            said = Answer(*(case.pop(field) for field in Answer._fields))
            found.append((Problem.read(case), said))
    return found


def main() -> None:
    """Draw everything again, or the files whose names are given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", help="such as ur5_feasible; default: all")
    asked = parser.parse_args().files
    jobs = [job for job in JOBS if not asked or f"{job[0]}_{job[1]}" in asked]
    with ProcessPoolExecutor() as pool:
        for job, count in zip(jobs, pool.map(collect, *zip(*jobs, strict=True)), strict=True):
            sys.stderr.write(f"{job[0]}_{job[1]}: {count} cases\n")


if __name__ == "__main__":
    main()
