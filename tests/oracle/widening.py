"""Random cases of many arms, and the same with a limit, the cone or the tolerance widened."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from draw_tolerance_needed import narrowed_limits
from following import Arm
from set_down import KINDS, built, random_shape, rounded, set_down

from feasibility import CauseKind, Search, Verdict, check
from feasibility.verdict import Answer
from robots import load_robot

ARMS = ("puma560", "ur5", "panda", "kinova", "so101", "z1", "xarm7", "talos_left", "ur3_limited")
WIDENINGS = ("limit", "cone", "tolerance")


def random_case(rng: np.random.Generator, number: int) -> dict[str, Any]:
    """Tables of a case: a patch around the tool of a random configuration, cone 0.5 to 90 degrees.

    Nothing is known of its answer; about half have cells that cannot be covered.
    """
    name = ARMS[number % len(ARMS)]
    limits = narrowed_limits(rng, load_robot(name))
    shape = rng.integers(2, 5, 2).tolist()
    tables: dict[str, Any] = {
        "robot": {"name": name} | ({"limits_deg": limits} if limits else {}),
        "surface": rounded(random_shape(rng, str(rng.choice(KINDS)), rng.uniform(0.08, 0.45, 2)))
        | {"cells": shape},
        "task": {
            "standoff": round(float(rng.choice([0.0, rng.uniform(0.0, 0.05)])), 5),
            "cone_deg": round(float(np.exp(rng.uniform(np.log(0.5), np.log(90.0)))), 3),
            "tolerance": round(float(np.exp(rng.uniform(np.log(3e-4), np.log(5e-3)))), 6),
        },
    }
    arm = Arm(built(tables).robot)
    point, axis, _, _ = arm.tool(arm.random(rng))
    return set_down(tables, rng.uniform(0.0, 1.0, 2), point, axis, rng.normal(size=3))


def widened(rng: np.random.Generator, tables: dict[str, Any], what: str) -> dict[str, Any]:
    """The case with one thing wider: a joint's limit by up to 90 degrees, or a factor up to 3."""
    wide = copy.deepcopy(tables)
    limits = wide["robot"].get("limits_deg", {})
    if what == "limit" and limits:
        name = str(rng.choice(sorted(limits)))
        more = round(float(rng.uniform(1.0, 90.0)), 3)
        end = int(rng.integers(2))
        limits[name][end] = round(limits[name][end] + (more if end else -more), 3)
        return wide
    key = "tolerance" if what == "tolerance" else "cone_deg"
    most = 180.0 if key == "cone_deg" else np.inf
    wide["task"][key] = round(min(wide["task"][key] * float(rng.uniform(1.05, 3.0)), most), 7)
    return wide


def case_of(number: int) -> tuple[dict[str, Any], np.random.Generator]:
    """A random case by its number, and the generator for what is made of it."""
    rng = np.random.default_rng([51, number])
    return random_case(rng, number), rng


def decided(tables: dict[str, Any], seed: int = 0) -> Verdict:
    """The verdict."""
    return check(*built(tables)[:3], Search(seed=seed))


def lost(narrow: Verdict, wide: Verdict) -> str:
    """What a wider case has lost, in words; empty if nothing."""
    if narrow.feasible and wide.answer is Answer.INFEASIBLE:
        return "feasible turned infeasible"
    if wide.n_covered < narrow.n_covered:
        return f"covered fell from {narrow.n_covered} to {wide.n_covered} ({wide.answer})"
    ruled_out = {
        cause.cell
        for cause in wide.causes
        if cause.proved and cause.kind is not CauseKind.DISCONNECTED
    }
    both = ruled_out & set(np.flatnonzero(narrow.covered).tolist())
    return f"cells {sorted(both)} were covered and are proved uncoverable" if both else ""
