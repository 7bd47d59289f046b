"""The answer where the time limit ran out before a search began: undecided, and why."""

from __future__ import annotations

from typing import Any

from feasibility.cases.case import Case
from feasibility.collisions.words import checked, checked_words
from feasibility.reports.text_and_tables import summary
from feasibility.version import version

HEAD = "undecided: the time limit ran out before the search began."
MORE = "--set search.time_limit=... gives more time; fewer or larger cells need less"


def as_json(case: Case, text: str, seconds: float) -> dict[str, Any]:
    """An object like that of `coverable check --json`, for every command.

    Args:
        case: the question.
        text: what was not done.
        seconds: that the command took.
    """
    counts = case.surface.counts
    cells = 0
    if counts:
        cells = counts[0] * (counts[1] if len(counts) > 1 else 1)
    return {
        "verdict": "undecided",
        "evidence": "budget",
        "cells": cells,
        "covered": 0,
        "edges": 0,
        "uncovered": [],
        "certificate": None,
        "collisions": checked(case.collision),
        "unchecked_links": [],
        "pairs_left_out": [],
        "proof": None,
        "treated": None,
        "timing": {"load_s": seconds, "search_s": 0.0, "certify_s": 0.0, "total_s": seconds},
        "robot": case.robot.name or str(case.robot.urdf),
        "method": case.search.method,
        "seed": case.search.seed,
        "version": version(),
        "message": text,
    }


def as_text(case: Case, text: str) -> str:
    """For people."""
    rows = [("case", f"{case.name}  {case.description}".rstrip()), ("found", text), ("hint", MORE)]
    return "\n".join(summary(HEAD, rows, checked_words(case.collision)))
