"""Random PUMA problems that are feasible over the patch, and not along the curves between centres.

Large cells, and limits that are tightened until the oracle says that all cells can be reached, but
not in one motion along the curves between centres. The oracle is then asked about the whole patch.
What it joins there is made an explicit motion (`puma_motion`), for limits and a cone tighter than
the problem's, and measured on samples many times finer than the oracle's grid. So these cases are
feasible by a motion that was checked, and the oracle's own resolution does not matter.

Run this file to draw the cases again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import puma_motion
import puma_oracle
from oracle_cases import Problem
from puma_oracle import Resolution
from random_cases import (
    HERE,
    _round,
    centred,
    collect_found,
    draw_surface,
    puma_first,
    read_found,
    tightened,
)

FINE = Resolution(rows=12.0, turn_deg=2.0)
COARSE = Resolution(samples=1500)
JOBS = ((33, 79), (133, 21))  # seed, cases wanted
SAMPLES = 24  # between nodes of the oracle's graph, when a motion is measured
MOST_JUMP = 0.12  # [rad] of a joint between samples
TIGHT_CONE, TIGHT_LIMITS_DEG = 0.985, -0.2


class Between(NamedTuple):
    """A feasible problem, and what its motion keeps."""

    problem: Problem
    on_net: int
    """Cells of the best component along the curves."""
    cone_room: float
    """rad, least room of the motion to the cone's rim."""
    limit_room: float
    """rad, least room to a limit of joints 1 to 5."""


def draw_large_cells(rng: np.random.Generator) -> Problem:
    """A random problem of few large cells, its patch at 0.3 to 1.2 m from the shoulder."""
    made = draw_surface(rng, tuple(rng.uniform(0.3, 1.0, 2)))
    direction = rng.normal(size=3)
    place = direction / np.linalg.norm(direction) * rng.uniform(0.3, 1.2)
    low, high = -rng.uniform(30, 190, 6), rng.uniform(30, 190, 6)
    problem = Problem(
        **made,
        position=(0.0, 0.0, 0.0),
        rpy_deg=_round(rng.uniform(-180, 180, 3)),
        cells=(int(rng.integers(2, 5)), int(rng.integers(2, 5))),
        standoff=round(float(rng.choice([0.0, rng.uniform(0, 0.03)])), 4),
        cone_deg=round(float(np.exp(rng.uniform(np.log(3), np.log(40)))), 2),
        limits_deg=tuple(_round(pair) for pair in zip(low, high, strict=True)),
    )
    return centred(problem, place)


def moves(problem: Problem) -> tuple[float, float] | None:
    """Room to cone and limits of one motion over all cells; None if the patch gives none."""
    tight = problem.varied(cone=TIGHT_CONE, limits_deg=TIGHT_LIMITS_DEG)
    for how in (COARSE, puma_oracle.STANDARD):
        if not puma_oracle.solve(tight, "patch", how).feasible:
            return None
    motions = puma_motion.spanning(tight, fine=SAMPLES, on="patch")
    if len(motions) < problem.cells[0] * problem.cells[1]:
        return None
    kept = [puma_motion.measure(problem, motion) for motion in motions.values()]
    starts = np.array([motion.q[0] for motion in motions.values()])
    cone, limits = min(k.cone for k in kept), min(k.limits for k in kept)
    together = np.ptp(starts, axis=0).max() < 1e-9
    smooth = max(k.jump for k in kept) < MOST_JUMP
    return (cone, limits) if together and smooth and cone > 0.0 and limits > 0.0 else None


def search(rng: np.random.Generator) -> Between | None:
    """One random problem tightened until its curves fall apart; None unless its patch holds."""
    problem = draw_large_cells(rng)
    found = puma_first(problem)
    for _ in range(6):
        if not found.feasible:
            break
        problem = tightened(rng, problem)
        found = puma_first(problem)
    if found.feasible or found.reachable < problem.cells[0] * problem.cells[1]:
        return None
    room = moves(problem)
    if room is None:
        return None
    on_net = puma_oracle.solve(problem.varied(cone=1.01, limits_deg=0.1), "net", FINE)
    return None if on_net.feasible else Between(problem, on_net.covered, *room)


def read_between(path: Path = HERE / "between_curves.json") -> list[Between]:
    """The stored cases."""
    return read_found(Between, path)


def main() -> None:
    """Draw and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE / "between_curves.json")
    out, kept = parser.parse_args().out, list[dict[str, Any]]()
    for seed, wanted in JOBS:
        drawn = collect_found(search, wanted, seed, out, kept)
        sys.stderr.write(f"{wanted} of {drawn} drawn\n")


if __name__ == "__main__":
    main()
