"""Cases with a motion that was there before the surface: feasible by construction.

A case is kept as the tables of its TOML, with the configuration in which its planted motion begins.
The motion itself is made again from that by `following.planted_motion`, and measured densely.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from itertools import count, islice
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from dense_replay import Floats
from following import Arm, Raster, follow, measured, raster

from feasibility.cases import Case
from feasibility.cases.case import Setup
from feasibility.cases.toml import toml_document

HERE = Path(__file__).parents[1] / "questions"
T = TypeVar("T")


class Planted(NamedTuple):
    """A feasible case, and why it is."""

    name: str
    tables: dict[str, Any]
    """The tables `robot`, `surface` and `task` of the case."""
    start: tuple[float, ...]
    """(n,) rad or m: over the first cell of the raster."""
    corner: str
    """Where the raster begins: 'first' or 'last' cell."""
    why: str
    """How the motion was made, and what room it keeps."""

    def toml(self) -> str:
        """The case as a document, with its truth as a comment."""
        return f"# Truth: feasible. {self.why}\n{toml_document(self.tables)}"

    def setup(self, seed: int = 0) -> Setup:
        """What `feasibility.check` is called with."""
        return Case.from_toml(self.toml(), name=self.name).with_overrides(
            [f"search.seed={seed}"]
        ).build()  # fmt: skip


def collect(
    draw: Callable[[np.random.Generator, int], T | None], wanted: int, seed: int
) -> list[T]:
    """Draw, with a counter, until there are enough that came about."""
    rng = np.random.default_rng(seed)
    made = (draw(rng, number) for number in count())
    return list(islice((case for case in made if case is not None), wanted))


def draw_and_write(
    draw: Callable[[np.random.Generator, int], Any], about: str | None, name: str, **defaults: int
) -> None:
    """The command of a file that draws cases: how many, from which seed, and where they go."""
    parser = argparse.ArgumentParser(description=about)
    for option, default in defaults.items():
        parser.add_argument(f"--{option}", type=int, default=default)
    parser.add_argument("--out", type=Path, default=HERE / f"{name}.json")
    asked = parser.parse_args()
    cases = collect(draw, asked.wanted, asked.seed)
    write_cases(asked.out, cases)
    sys.stderr.write(f"{len(cases)} cases\n")


def write_cases(path: Path, cases: Iterable[NamedTuple]) -> None:
    """One case a line, so that a change shows."""
    lines = ",\n".join(json.dumps(case._asdict(), separators=(",", ":")) for case in cases)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def read_planted(name: str) -> list[Planted]:
    """The stored cases of one generator."""
    stored = json.loads((HERE / f"{name}.json").read_text(encoding="utf-8"))
    return [Planted(**{**case, "start": tuple(case["start"])}) for case in stored]


def planted_motion(case: Planted, step: float, share: float) -> tuple[Setup, Raster, Floats]:
    """A case, the raster over its cells and the planted motion over that.

    Args:
        case: the case.
        step: m between places of the raster.
        share: of the cone, that the motion uses.
    """
    setup = case.setup()
    way = raster(setup.cells, setup.task, case.corner, step)
    cone = share * setup.task.cone
    q = follow(Arm(setup.robot), setup.cells, setup.task, way, np.array(case.start), cone)
    assert q is not None
    return setup, way, q


def assert_covers(setup: Setup, way: Raster, q: Floats, share: float) -> None:
    """The motion keeps to `share` of tolerance and cone, and to the limits, between rows too."""
    kept = measured(setup.robot, setup.cells, setup.task, way, q, per_step=20)
    assert kept.distance <= share * setup.task.effective_tolerance
    assert kept.tilt <= share * setup.task.cone
    assert kept.room >= 0.0
    assert np.abs(np.diff(q, axis=0)).max(initial=0.0) < 0.2
    assert set(way.cell[way.cell >= 0].tolist()) == set(range(len(setup.cells)))
