"""Cases read once and placed, against each read by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from feasibility.cases import TABLES, Case, CaseError, load_case, toml_document
from feasibility.studies import case_of

POSES = (
    {"position": [0.1, 2, -0.3], "rpy_deg": [10, 20.5, -170]},
    {"position": (0.0, 0.0, 1.0)},
    {"rpy_deg": [0, 0, 90]},
    {"position": None},
    {},
)
WRONG: tuple[Any, ...] = ([0, 0], [0, 0, float("nan")], ["0", 0, 0], 3.0, [0, 0, 1e300], True, {})


def by_itself(tables: dict[str, Any]) -> Case:
    """What reading the tables as text gives."""
    return Case.from_toml(toml_document({t: tables[t] for t in TABLES if t in tables}))


def at(tables: dict[str, Any], pose: dict[str, Any]) -> dict[str, Any]:
    """The tables with the surface somewhere else."""
    surface = {k: v for k, v in tables["surface"].items() if k not in ("position", "rpy_deg")}
    return {**tables, "surface": {**surface, **pose}}


@pytest.mark.parametrize("name", ["paper/4a", "paper/5e"])
def test_a_placed_case_is_the_case_read_by_itself(name: str) -> None:
    tables = load_case(name).to_tables()
    for pose in POSES:
        given = at(tables, {key: value for key, value in pose.items() if value is not None})
        placed = case_of({**given, "placement": {"pose": 1}})
        assert placed == by_itself(given)
        assert placed.to_toml() == by_itself(given).to_toml()


@pytest.mark.parametrize("key", ["position", "rpy_deg"])
def test_what_is_wrong_is_said_as_in_a_file(key: str) -> None:
    tables = load_case("paper/4a").to_tables()
    case_of(tables)
    for value in WRONG:
        given = at(tables, {key: value})
        given["task"] = {**given["task"], "cone_deg": -1}
        with pytest.raises(CaseError) as expected:
            by_itself(given)
        with pytest.raises(CaseError) as found:
            case_of(given)
        assert str(found.value) == str(expected.value)
        assert key in str(found.value)


def test_a_case_that_is_kept_is_not_changed_by_those_placed() -> None:
    tables = load_case("paper/4a").to_tables()
    rng = np.random.default_rng(6)
    before = case_of(tables).to_toml()
    for _ in range(3):
        moved = case_of(at(tables, {"position": rng.normal(size=3).tolist()}))
        assert moved.to_toml() != before
    assert case_of(tables).to_toml() == before
