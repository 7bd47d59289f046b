"""Cases as tables, checked; of many that differ in the pose of the surface alone, the rest once."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

from feasibility.cases import TABLES, Case, toml_document
from surfaces import SurfaceError, check_pose

Tables = dict[str, Any]
HOME = {"position": (0.0, 0.0, 0.0), "rpy_deg": (0.0, 0.0, 0.0)}
CASES_KEPT = 32  # that one worker keeps, at home


def case_of(tables: Tables) -> Case:
    """The case of some tables, checked; tables that belong to no case are left out.

    Raises:
        CaseError: with everything that is wrong.
    """
    chosen = {title: tables[title] for title in TABLES if title in tables}
    surface = chosen.get("surface")
    pose = _pose(surface) if isinstance(surface, Mapping) else None
    if not isinstance(surface, Mapping) or pose is None:
        return Case.from_toml(toml_document(chosen))
    home = _at_home(json.dumps({**chosen, "surface": {**surface, **HOME}}, default=str))
    return replace(home, surface=replace(home.surface, **pose))


def _pose(surface: Mapping[str, Any]) -> dict[str, Any] | None:
    """Where the surface stands; None where that is not said, or wrong."""
    pose = {key: surface[key] for key in HOME if surface.get(key) is not None}
    try:
        check_pose(**pose)
    except SurfaceError:
        return None
    return {key: tuple(map(float, pose.get(key, value))) for key, value in HOME.items()}


@lru_cache(maxsize=CASES_KEPT)
def _at_home(tables: str) -> Case:
    """The case of some tables, as JSON; without what is wrong nothing is kept."""
    return Case.from_toml(toml_document(json.loads(tables)))
