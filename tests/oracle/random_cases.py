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
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import puma_oracle
from oracle_cases import Answer, Problem
from puma_oracle import Resolution

HERE = Path(__file__).parent
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
FEASIBLE, UNREACHABLE, DISCONNECTED = "feasible", "unreachable", "disconnected"


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


def variants(problem: Problem) -> Iterator[tuple[Problem, str, Resolution]]:
    """What a sure case must answer alike, the likeliest to differ first."""
    fine = Resolution(rows=12.0, turn_deg=2.0)
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


def sure(problem: Problem, first: Answer) -> bool:
    """Whether every variant gives the first answer."""
    return all(puma_oracle.solve(p, on, how) == first for p, on, how in variants(problem))


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
    middle = problem.targets(*np.array([r.mean() for r in problem.ranges])[:, None])[0][0]
    plain = problem.plain()
    plain["position"] = _round(place - middle)
    return Problem.read(plain)


def collect(
    seed: int,
    wanted: dict[str, int],
    drawn: Callable[[np.random.Generator], Problem],
    solve: Callable[[Problem], Answer],
    is_sure: Callable[[Problem, Answer], bool],
) -> list[dict[str, Any]]:
    """Draw until there are enough sure cases of each sort; the list that JSON holds."""
    rng = np.random.default_rng(seed)
    count = dict.fromkeys(wanted, 0)
    kept, tried, started = [], 0, time.monotonic()
    while any(count[sort] < wanted[sort] for sort in wanted):
        problem = drawn(rng)
        cells = problem.cells[0] * problem.cells[1]
        found = solve(problem)
        sort = kind_of(found, cells)
        tried += 1
        if tried % 200 == 0:
            sys.stderr.write(f"{tried} drawn, {count}, {time.monotonic() - started:.0f} s\n")
        # Patches of which nothing can be reached say little; a few are enough.
        if count[sort] >= wanted[sort] or (found.reachable == 0 and rng.random() < 0.9):
            continue
        if not is_sure(problem, found):
            continue
        count[sort] += 1
        kept.append({"sort": sort, **problem.plain(), **found._asdict()})
    return kept


def write(path: Path, cases: list[dict[str, Any]]) -> None:
    """One case a line, so that a change shows."""
    lines = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def read(name: str) -> list[tuple[Problem, Answer]]:
    """The stored cases of one file, such as 'puma_cases.json'."""
    found = []
    for case in json.loads((HERE / name).read_text(encoding="utf-8")):
        case.pop("sort")
        said = Answer(*(case.pop(field) for field in Answer._fields))
        found.append((Problem.read(case), said))
    return found


def main() -> None:
    """Draw everything again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=100, help="PUMA cases of each sort")
    each = parser.parse_args().each
    wanted = dict.fromkeys((FEASIBLE, UNREACHABLE, DISCONNECTED), each)
    write(HERE / "puma_cases.json", collect(20, wanted, draw, puma_oracle.solve, sure))


if __name__ == "__main__":
    main()
