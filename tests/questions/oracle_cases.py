"""Problems for the oracles: a patch, a task and limits as plain numbers, over the referee's forms.

A `net` is the cells' centres and straight lines between neighbours: where a search from centre to
centre can be. A `patch` is a fine grid over whole cells: wherever a tool could go on the surface.

Stored problems were drawn at random, and kept only where the answer stays the same on both domains,
at two resolutions, and with cone, limits and place of the surface a little tighter, wider and
elsewhere; those of "apart" are without that filter, with the oracles' answers to a little tighter
and wider ones.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from referee import Floats, Form, turn

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Problem:
    """One question: can the arm cover these cells in one motion? Lengths in m, angles in deg."""

    kind: str  # 'sphere', 'cylinder', 'hyperboloid' or 'plane'
    size: tuple[float, ...]  # Sphere, cylinder: (radius,); hyperboloid: (waist, flare); plane: ()
    u: tuple[float, float]
    v: tuple[float, float]
    position: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]
    side: str
    cells: tuple[int, int]
    standoff: float
    cone_deg: float
    limits_deg: tuple[tuple[float, float], ...]  # (lower, upper) of each joint, base to tip

    @staticmethod
    def read(plain: dict[str, Any]) -> Problem:
        made = dict(plain)
        for name in ("size", "u", "v", "position", "rpy_deg", "cells"):
            made[name] = tuple(made[name])
        made["limits_deg"] = tuple(tuple(pair) for pair in made["limits_deg"])
        return Problem(**made)

    @property
    def limits(self) -> Floats:
        """(n, 2) rad."""
        return np.radians(np.array(self.limits_deg, dtype=float))

    @property
    def ranges(self) -> tuple[Floats, Floats]:
        """Ranges of u and of v, rad or m."""
        u, v = np.array(self.u, dtype=float), np.array(self.v, dtype=float)
        return (
            u if self.kind == "plane" else np.radians(u),
            np.radians(v) if self.kind == "sphere" else v,
        )

    def targets(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Target points (k, 3) m and approach directions (k, 3) at parameters (k,)."""
        turned, outside = turn(np.radians(self.rpy_deg)), self.side == "outside"
        form = Form(self.kind, self.size, *self.ranges, outside, self.position, turned)
        there = form.at(u, v)
        return there.points + form.sign * self.standoff * there.normals, -form.sign * there.normals


class Domain(NamedTuple):
    """Samples of the parameters, and which of them are next to each other."""

    uv: Floats  # (S, 2) rad or m
    links: Ints  # (L, 2) pairs of samples
    centres: Ints  # (N,) the sample at each cell's centre, row by row


def _pairs(nu: int, nv: int) -> Ints:
    """Pairs of 8-neighbours in a grid that closes nowhere, (M, 2) flat indices."""
    at = np.arange(nu * nv).reshape(nu, nv)
    found = [
        (at[:-1], at[1:]),
        (at[:, :-1], at[:, 1:]),
        (at[:-1, :-1], at[1:, 1:]),
        (at[:-1, 1:], at[1:, :-1]),
    ]
    return np.concatenate([np.stack([a.ravel(), b.ravel()], 1) for a, b in found])


def _middles(problem: Problem, refine: int) -> Floats:
    """(S, 2) middles of `refine` x `refine` parts of every cell, row by row."""
    lines = []
    for (low, high), count in zip(problem.ranges, problem.cells, strict=True):
        lines.append(low + (high - low) * (np.arange(count * refine) + 0.5) / (count * refine))
    return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 2)


def patch(problem: Problem, refine: int) -> Domain:
    """A grid of `refine` x `refine` samples a cell (odd: the centres are among them)."""
    (nu, nv), uv = problem.cells, _middles(problem, refine)
    at = np.arange(len(uv)).reshape(nu * refine, nv * refine)
    half = refine // 2
    return Domain(uv, _pairs(*at.shape), at[half::refine, half::refine].ravel())


def net(problem: Problem, pieces: int) -> Domain:
    """Centres, and the lines between neighbours cut into so many pieces."""
    centres = _middles(problem, 1)
    a, b = _pairs(*problem.cells).T
    part = np.arange(1, pieces)[:, None] / pieces
    between = centres[a, None] * (1.0 - part) + centres[b, None] * part
    inner = len(centres) + np.arange(len(a) * (pieces - 1)).reshape(len(a), -1)
    chains = np.column_stack([a, inner, b])
    links = np.stack([chains[:, :-1], chains[:, 1:]], -1).reshape(-1, 2)
    samples = np.concatenate([centres, between.reshape(-1, 2)])
    return Domain(samples, links, np.arange(len(centres)))


class Answer(NamedTuple):
    feasible: bool  # One component covers every cell
    covered: int  # Cells of the best single component
    reachable: int  # Cells that some component covers


def read(arm: str) -> list[tuple[Problem, Answer]]:
    """The stored problems of an arm, feasible ones first, then those with cells out of reach, then
    those that fall apart, then those that a search once got wrong."""
    found = []
    for case in json.loads(Path(__file__).with_name(f"{arm}.json").read_text("utf-8")):
        said = Answer(*(case.pop(field) for field in Answer._fields))
        found.append((Problem.read(case), said))
    return found


def answer(cells: int, cell: Ints, component: Ints) -> Answer:
    """Count, from every (cell, component) that occurs."""
    if len(cell) == 0:
        return Answer(cells == 0, 0, 0)
    pairs = np.unique(np.stack([component, cell], 1), axis=0)
    best = int(np.unique(pairs[:, 0], return_counts=True)[1].max())
    return Answer(best == cells, best, len(np.unique(cell)))
