"""The JSON of `coverable check --json` as CONTRACT words it, and a check against it."""

from __future__ import annotations

import math
from typing import Any


class OneOf:
    """One of some words."""

    def __init__(self, *words):
        self.words = words


class Maybe:
    """Null, or what the inner schema says."""

    def __init__(self, inner):
        self.inner = inner


class Named:
    """An object of any keys, with values that the inner schema says."""

    def __init__(self, inner):
        self.inner = inner


class ProofTree:
    """A cut with the nodes below and above it, or a leaf with its cell."""


SECONDS = {"load_s": float, "search_s": float, "certify_s": float, "total_s": float}
CHECK = {
    "verdict": OneOf("feasible", "infeasible", "undecided"),
    "evidence": OneOf("witness", "proof", "exhausted", "budget"),
    "cells": int,
    "covered": int,
    "edges": int,
    "uncovered": [
        {
            "cell": [int],
            "cause": OneOf(
                "out_of_reach", "joint_limits", "orientation", "collision", "disconnected"
            ),
            "proved": bool,
            "detail": str,
        }
    ],
    "certificate": Maybe(
        {
            "waypoints": int,
            "max_position_error_m": float,
            "max_angle_deg": float,
            "min_limit_margin_deg": Maybe(float),
        }
    ),
    "collisions": [str],
    "unchecked_links": [str],
    "pairs_left_out": [{"pair": [str], "why": str}],
    "proof": Maybe({"kind": OneOf("cell", "cut"), "opened": Named(float), "tree": ProofTree()}),
    "treated": Maybe(
        {
            "lower": float,
            "upper": float,
            "twice": float,
            "area_m2": float,
            "footprint_m": [float],
            "untreated": [{"centre": [float], "area_m2": float}],
            "notes": [str],
        }
    ),
    "timing": SECONDS,
    "robot": str,
    "method": OneOf("complete", "greedy"),
    "seed": int,
    "version": str,
    "message": str,  # beyond CONTRACT: what was found, in sentences
}


def conforms(value: Any, schema: Any, path: str = "$") -> None:
    """Fail unless `value` has exactly the keys and types of the schema, in its order."""
    if isinstance(schema, Maybe):
        if value is not None:
            conforms(value, schema.inner, path)
    elif isinstance(schema, OneOf):
        assert value in schema.words, f"{path}: {value!r}"
    elif isinstance(schema, Named):
        assert isinstance(value, dict), f"{path}: {value!r}"
        for key, item in value.items():
            conforms(item, schema.inner, f"{path}.{key}")
    elif isinstance(schema, ProofTree) and "cell" in value:
        conforms(value, {"cell": [int]}, path)
    elif isinstance(schema, ProofTree):
        sides = {"below": ProofTree(), "above": ProofTree()}
        cuts = (
            {"joint": str, "value_deg": float, **sides},
            {"joint": str, "value_m": float, **sides},
            {"weights": Named(float), "value": float, **sides},
        )
        conforms(value, next(cut for cut in cuts if list(cut) == list(value)), path)
    elif isinstance(schema, dict):
        assert isinstance(value, dict), f"{path}: {value!r}"
        assert list(value) == list(schema), f"{path}: {list(value)}"
        for key, inner in schema.items():
            conforms(value[key], inner, f"{path}.{key}")
    elif isinstance(schema, list):
        assert isinstance(value, list), f"{path}: {value!r}"
        for k, item in enumerate(value):
            conforms(item, schema[0], f"{path}[{k}]")
    elif schema is float:
        assert type(value) in (int, float), f"{path}: {value!r}"
        assert math.isfinite(value), f"{path}: {value!r}"
    else:
        assert type(value) is schema, f"{path}: {value!r}"
