"""Stored problems of random patches and limits, and what the oracles say of them.

Drawn at random and kept only where verdict and number of covered cells stay the same on both
domains of the oracles, at two resolutions, with the cone 2 % (UR5: 6 %) and every limit 0.5 (2)
degrees tighter and wider, and with the surface moved by the task's tolerance (UR5: three times
that) along its normal and in four directions of space. Those of "apart" are without that filter:
what an oracle says of a little tighter and of a little wider limits and cone is kept with them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from oracle_cases import Answer, Problem

HERE = Path(__file__).parent
TABLE_1 = (
    ((-180, 180),) * 6,
    ((-170, 170), (-170, 75), (-180, 175), (-135, 190), (-100, 90), (-90, 90)),
    ((-90, 10), (-170, 75), (-180, 90), (-135, 170), (-100, 90), (-90, 90)),
    ((-110, 145), (-110, 75), (-110, 40), (-150, 120), (-45, 140), (-180, 180)),
)


class Between(NamedTuple):
    """A problem that is feasible over the patch, and not along the curves between centres."""

    problem: Problem
    on_net: int
    """Cells of the best component along the curves."""
    cone_room: float
    limit_room: float
    """rad, least room of the oracle's motion to the cone's rim and to a limit."""


def lines(name: str) -> list[dict[str, Any]]:
    """What a file holds."""
    return json.loads((HERE / f"{name}.json").read_text("utf-8"))


def read(arm: str) -> list[tuple[Problem, Answer]]:
    """The stored problems of an arm, feasible ones first, then those with cells out of reach, then
    those that fall apart, then those that a search once got wrong."""
    found = []
    for case in lines(arm):
        said = Answer(*(case.pop(field) for field in Answer._fields))
        found.append((Problem.read(case), said))
    return found


def read_between() -> list[Between]:
    """The stored problems whose motions run beside the curves."""
    found = []
    for case in lines("between_curves"):
        rest = [case.pop(field) for field in Between._fields[1:]]
        found.append(Between(Problem.read(case), *rest))
    return found


def draw(rng: np.random.Generator, arm: str = "puma560") -> Problem:
    """One of the stored problems, at random."""
    problems = read(arm)
    return problems[int(rng.integers(len(problems)))][0]


def draw_ur5(rng: np.random.Generator) -> Problem:
    """The same for the UR5."""
    return draw(rng, "ur5")
