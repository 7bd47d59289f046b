"""The JSON of all commands: their keys in order, types, and where Python has the same value.

`conforms(value, schema)` looks at keys and types, `conforms(value, schema, source)` compares each
number with the Python result too. A schema is a dict of keys, a list of one inner schema, a type,
or one of the classes here; `of(get, inner)` says where the source of a part is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np

UNKNOWN: Any = object()
"""In place of a source: types alone are looked at."""


class OneOf:
    """One of some words."""

    def __init__(self, *words: str) -> None:
        self.words = words


class Maybe:
    """What the inner schema says, or null where there is no finite value."""

    def __init__(self, inner: Any) -> None:
        self.inner = inner


class Perhaps(Maybe):
    """A key that is there only where its source is not None."""


class Named:
    """An object of any keys, with values that the inner schema says."""

    def __init__(self, inner: Any) -> None:
        self.inner = inner


class Same:
    """Any JSON, equal to the source."""


class Rest:
    """All further keys of an object are those of the source, with its values."""


class ProofTree:
    """A cut with the nodes below and above it, or a leaf with its cell; of (node, owner)."""


class Of:
    """The source of a part, and its schema."""

    def __init__(self, get: str | Callable[[Any], Any], inner: Any) -> None:
        self.get, self.inner = get, inner

    def source(self, of: Any) -> Any:
        """Of this part; UNKNOWN of an unknown whole."""
        if of is UNKNOWN:
            return UNKNOWN
        if callable(self.get):
            return self.get(of)
        return reduce(lambda one, name: one and getattr(one, name), self.get.split("."), of)


of = Of


def index(cells: Any, k: int) -> list[int]:
    """A cell as people count it: row and column of a grid, else its number."""
    shape = getattr(cells, "shape", None)
    return [int(k)] if shape is None or len(shape) < 2 else [*map(int, divmod(k, shape[1]))]


def deg(name: str) -> Callable[[Any], float | None]:
    """An attribute in rad, in degrees."""
    return lambda one: None if getattr(one, name) is None else math.degrees(getattr(one, name))


class Measured:
    """A certificate with the arm and the motion q that it is of."""

    def __init__(self, certificate: Any, robot: Any = None, q: Any = None) -> None:
        self.certificate, self.robot, self.q = certificate, robot, q

    def __getattr__(self, name: str) -> Any:
        return getattr(self.certificate, name)

    @property
    def limit_margin_deg(self) -> float:
        """Of the joints that turn."""
        if self.q is None or np.ndim(self.q) != 2:
            return math.degrees(self.min_limit_margin)
        off = np.minimum(self.q - self.robot.lower, self.robot.upper - self.q)
        return math.degrees(off[:, ~self.robot.prismatic].min(initial=np.inf))


def measured(one: Any) -> Measured | None:
    """Of a verdict or what became of a claim."""
    if one.certificate is None:
        return None
    q = one.q if hasattr(one, "q") else None if one.witness is None else one.witness.q
    return Measured(one.certificate, one.robot, q)


CERTIFICATE = {
    "waypoints": of("waypoints", int),
    "max_position_error_m": of("max_position_error", Maybe(float)),
    "max_angle_deg": of(deg("max_angle"), Maybe(float)),
    "max_roll_deg": of(deg("max_roll"), Perhaps(float)),
    "max_speed_m_per_s": of("max_speed", Perhaps(Maybe(float))),
    "stops_in_place": of("stops_in_place", Perhaps(int)), "corners": of("corners", Perhaps(int)),
    "min_singular_value": of("min_singular_value", Perhaps(float)),
}  # fmt: skip
CLEARANCE = {
    "min_clearance_m": of("min_clearance", Perhaps(float)),
    "measured_clearance_m": of("measured_clearance", Perhaps(float)),
    "nearest_pair": of("nearest_pair", Perhaps([str])),
}  # fmt: skip
OF_MOTION = {
    **CERTIFICATE, "min_limit_margin_deg": of("limit_margin_deg", Maybe(float)), **CLEARANCE,
}  # fmt: skip
SECONDS = {"load_s": float, "search_s": float, "certify_s": float, "total_s": float}
CAUSE = {
    "cell": of(lambda one: index(one[1].cells, one[0].cell), [int]),
    "cause": of(
        lambda one: str(one[0].kind),
        OneOf("out_of_reach", "joint_limits", "orientation", "collision", "disconnected"),
    ),
    "proved": of(lambda one: one[0].proved, bool),
    "detail": of(lambda one: one[0].detail, str),
    "pair": of(lambda one: one[0].pair, Perhaps([str])),
    "clearance_m": of(lambda one: one[0].clearance, Perhaps(float)),
}  # fmt: skip


def causes(name: str) -> Of:
    """Causes of missed cells, each beside what has the cells."""
    return of(lambda one: [(cause, one) for cause in getattr(one, name)], [CAUSE])


PROOF = {
    "kind": of(lambda one: one[0].kind, OneOf("cell", "cut")),
    "opened": of(
        lambda one: {one[1].robot.joint_names[j]: value for j, value in one[0].opened}, Named(float)
    ),
    "tree": of(lambda one: (one[0].root, one[1]), ProofTree()),
}  # fmt: skip


def proof(of_whom: Any) -> Any:
    """A proof beside what has arm and cells; None where there is none."""
    return None if of_whom.proof is None else (of_whom.proof, of_whom)


TREATED = of("treated", Maybe({
    "lower": of("lower", float), "upper": of("upper", float), "twice": of("twice", float),
    "area_m2": of("area", float), "footprint_m": of("footprint", [float]),
    "untreated": of("untreated", [{
        "centre": of(lambda one: one.centre.tolist(), [float]), "area_m2": of("area", float),
    }]),
    "notes": of("notes", [str]),
}))  # fmt: skip


def checked(one: Any) -> list[str]:
    """What is checked, by the case: the words of CONTRACT."""
    asked = one.collision if hasattr(one, "arms") else one.task.collision
    if asked is None:
        return []
    parts = ("self", asked.self_), ("surface", asked.surface), ("scene", len(asked.scene) > 0)
    return [name for name, there in parts if there]


COLLISIONS = of(checked, [str])
END = {"robot": of("robot.name", str), "version": str}
CHECK = {
    "verdict": of("answer", OneOf("feasible", "infeasible", "undecided")),
    "evidence": of("evidence", OneOf("witness", "proof", "exhausted", "budget")),
    "cells": of(lambda one: len(one.cells), int),
    "covered": of(lambda one: int(one.covered.sum()), int),
    "edges": of(lambda one: one.graph.number_of_edges(), int),
    "uncovered": causes("causes"), "certificate": of(measured, Maybe(OF_MOTION)),
    "collisions": COLLISIONS, "unchecked_links": of("unchecked_links", [str]),
    "pairs_left_out": of("pairs_left_out", [{
        "pair": of(lambda one: [one.first, one.second], [str]),
        "why": of("why", str), "rate": of("rate", Perhaps(float)),
    }]),
    "proof": of(proof, Maybe(PROOF)), "treated": TREATED, "timing": SECONDS,
    "robot": of("robot.name", str), "method": of("method", OneOf("complete", "greedy")),
    "seed": of("seed", int), "version": str,
    "message": str,  # beyond CONTRACT: what was found, in sentences
}  # fmt: skip
WITNESS = {
    "joints": of("robot.joint_names", [str]),
    "q": of(lambda one: one.witness.q.tolist(), [[float]]),
    "cell": of(lambda one: [None if k < 0 else int(k) for k in one.witness.cell], [Maybe(int)]),
}  # fmt: skip
VERIFY = {
    "verdict": of(
        lambda one: "does not hold" if one.faults else "holds", OneOf("holds", "does not hold")
    ),
    "claim": of("claim", OneOf("motion", "witness", "tree", "proof")),
    "cells": of(lambda one: len(one.cells), int),
    "reached": of(lambda one: None if one.reached is None else int(one.reached.sum()), Maybe(int)),
    "missed": of(
        lambda one: [] if one.reached is None else
        [index(one.cells, k) for k, reached in enumerate(one.reached) if not reached], [[int]],
    ),
    "refusals": of("faults", [{
        "row": of(lambda one: None if one.row < 0 else one.row + 1, Maybe(int)),
        "share": of(lambda one: None if one.row < 0 else one.share, Maybe(float)),
        "text": of("text", str),
    }]),
    "certificate": of(measured, Maybe(OF_MOTION)), "proof": of(proof, Maybe(PROOF)),
    "boxes": of(lambda one: None if one.proof is None else one.boxes, Maybe(int)),
    "treated": TREATED, "not_judged": of("not_judged", [str]),
    "in_time": of(lambda one: not one.late, bool),
    "collisions": of(
        lambda one: [] if "collisions" in one.not_judged else checked(one), [str]
    ),
    "notes": [str],
    **END,
}  # fmt: skip


def by_joint(get: Callable[[Any], Any]) -> Of:
    """Values by the joints' names."""
    return of(
        lambda one: dict(zip(one.path.robot.joint_names, get(one).tolist(), strict=True)),
        Named(float),
    )


TRAJECTORY = {
    "duration_s": of(lambda one: one.run.time[-1] - one.run.time[0], float),
    "samples": of(lambda one: len(one.run.time), int),
    "tool_way_m": of("run.tool_way", float),
    "max_tool_speed": of(lambda one: one.most.tool_speed * one.limits.tool_speed, float),
    "max_velocity": by_joint(lambda one: one.most.velocity * one.limits.velocity),
    "max_acceleration": by_joint(lambda one: one.most.acceleration * one.limits.acceleration),
    "limits": {
        "tool_speed": of("limits.tool_speed", float),
        "velocity": by_joint(lambda one: one.limits.velocity),
        "acceleration": by_joint(lambda one: one.limits.acceleration),
    },
}  # fmt: skip
LAYOUT = {
    "count": of("count", int),
    "stretches": of(lambda one: len(one.stretches), int),
    "by": of("by", str), "pitch_m": of("pitch", float), "spacing_m": of("spacing", float),
    "widest_m": of("widest", float), "length_m": of("length", float),
    "dropped_m": of("dropped", float), "beyond_border_m": of("beyond_border", float),
    "notes": [str],
}  # fmt: skip


def travel(one: Any) -> dict[str, dict[str, float]]:
    """How far each joint goes, from the walk itself."""
    robot, ways = one.path.robot, np.abs(np.diff(one.path.walk.q, axis=0)).sum(axis=0)
    return {
        name: {"travel_m": way} if slides else {"travel_deg": math.degrees(way)}
        for name, way, slides in zip(robot.joint_names, ways, robot.prismatic, strict=True)
    }


PATH = {
    "verdict": OneOf("feasible"), "order": of("path.order", str),
    "cells": of(lambda one: int(one.path.needed.sum()), int),
    "visits": of(lambda one: [int(k) for k in one.path.walk.cell if k >= 0], [int]),
    "length_m": of("path.figures.length", float),
    "covered_m": of(lambda one: one.path.figures.length - one.path.figures.revisited, float),
    "revisited_m": of("path.figures.revisited", float),
    "revisited_share": of("path.figures.revisited_share", float),
    "joint_travel": of(travel, Named(Named(float))),
    "margins": of("path.figures", {
        "limit_deg": of(deg("turn_margin"), Maybe(float)),
        "limit_m": of("slide_margin", Maybe(float)),
        "cone_deg": of(deg("cone_margin"), Maybe(float)),
        "singular_value": of("singular_value", Maybe(float)),
    }),
    "certificate": of("path.certificate", {**CERTIFICATE, **CLEARANCE}),
    "treated": TREATED, "passes": of("passes", Maybe(LAYOUT)), "trajectory": TRAJECTORY,
    "rates": of(lambda one: one.rates and one, Perhaps({
        "holds": of("rates.accepted", bool), "why_not": of("rates.refusals", [str]),
        "speed_m_per_s": of("path.task.speed", Perhaps(float)),
        "stops": of("rates.stops", [{
            "why": of("why", str), "cell": [int],
        }]),
        "waiting_s": of("rates.waiting", float), "share_at_speed": float,
        "min_singular_value": of("rates.sigma", float),
    })),
    "ends": of("ends", Perhaps({
        "approach_m": of("approach", float), "from_home": of("from_home", bool),
        "entry": of(lambda one: one.entry.tolist(), [[float]]),
        "exit": of(lambda one: one.exit.tolist(), [[float]]),
    })),
    "collisions": of(lambda one: checked(one.path), [str]),
    "robot": of("path.robot.name", str), "version": str,
}  # fmt: skip
RUNS = {
    "verdict": of("along.verdict.answer", OneOf("infeasible", "undecided")),
    "evidence": of("along.verdict.evidence", str), "message": of("along.verdict.message", str),
    "passes": of("along.passes", LAYOUT),
    "runs": of(lambda one: [(run, timed, one.found) for run, timed in
                            zip(one.found.runs, one.timed, strict=True)], [{
        "stretches": of(lambda one: [1 + k for k in one[2].stretches_of(one[0])], [int]),
        "poses": of(lambda one: one[0].walk.cell[one[0].walk.cell >= 0][[0, -1]].tolist(), [int]),
        "length_m": of(lambda one: one[0].figures.length, float),
        "duration_s": of(lambda one: one[1].time[-1] - one[1].time[0], float),
        "certificate": of(lambda one: one[0].certificate, {**CERTIFICATE, **CLEARANCE}),
    }]),
    "cuts": of(lambda one: [(cut, one.found) for cut in one.found.cuts], [{
        "stretch": of(lambda one: None if one[0].stretch < 0 else 1 + one[0].stretch, Maybe(int)),
        "along_m": of(lambda one: one[0].along, float),
        "poses": of(lambda one: [one[0].pose, one[0].next_pose], [int]),
        "cause": of(lambda one: one[0].cause, str),
        "joints": of(lambda one: one[1].robot.joint_names, [str]),
        "waypoints": of(lambda one: one[0].move.waypoints.tolist(), [[float]]),
        "clear": of(lambda one: not one[0].move.refusal, bool),
        "refusal": of(lambda one: one[0].move.refusal, str),
    }]),
    "left_out_m": of(lambda one: sum(gap.length for gap in one.found.gaps), float),
    "left_out": of("found.gaps", [{
        "stretches": of(lambda one: [1 + k for k in one.stretches], [int]),
        "length_m": of("length", float), "cause": of("cause", str), "proved": of("proved", bool),
    }]),
    "refused": of("found.refusals", [str]), "treated": TREATED,
    "collisions": of(lambda one: checked(one.along), [str]),
    "robot": of("found.robot.name", str), "version": str,
}  # fmt: skip
NO_PATH = {**CHECK, "trajectory": Maybe(dict)}


def joints_moved(move: Any) -> list[dict[str, Any]]:
    """How far each joint goes, from both ends."""
    by = zip(move.joint_names, move.prismatic, move.end - move.start, strict=True)
    return [{"joint": name, **({"by_m": d} if slides else {"by_deg": math.degrees(d)})}
            for name, slides, d in by]  # fmt: skip


DIVIDE = {
    "answer": OneOf("complete", "partial", "undecided"),
    "cells": of(lambda one: len(one.cells), int),
    "covered": of(lambda one: len({k for p in one.plan.patches for k in p.cells.tolist()}), int),
    "ended": of("ended", bool),
    "optimal": of(lambda one: one.ended and one.plan.optimal, bool),
    "at_least": of("plan.bound", int),
    "patches": of(lambda one: [(patch, one) for patch in one.plan.patches], [{
        "cells": of(lambda one: [index(one[1].cells, k) for k in one[0].cells], [[int]]),
        "area_m2": of(lambda one: float(one[1].cells.areas[one[0].cells].sum()), float),
        "pieces": of(lambda one: one[0].pieces, int),
        "accepted": of(lambda one: one[0].accepted, bool),
        "refusal": of(lambda one: one[0].refusal or None, Maybe(str)),
        "certificate": of(lambda one: one[0].certificate, {
            **CERTIFICATE, "min_limit_margin": of("min_limit_margin", Maybe(float)), **CLEARANCE,
        }),
    }]),
    "moves": of(lambda one: [(k, move, one) for k, move in enumerate(one.plan.moves)], [{
        "from": of(lambda one: one[0], int),
        "to": of(lambda one: one[0] + 1, int),
        "start": of(lambda one: one[2].patches[one[0]].walk.q[-1].tolist(), [float]),
        "end": of(lambda one: one[2].patches[one[0] + 1].walk.q[0].tolist(), [float]),
        "waypoints": of(lambda one: one[1].waypoints.tolist(), [[float]]),
        "refusal": of(lambda one: one[1].refusal or None, Maybe(str)),
        "min_clearance_m": Perhaps(Maybe(float)), "measured_clearance_m": Perhaps(Maybe(float)),
        "nearest_pair": Perhaps([str]),
        "joints": of(lambda one: joints_moved(one[1]), [Same()]),
    }]),
    "patch_of_cell": of(lambda one: [
        next((k for k, patch in enumerate(one.plan.patches) if cell in patch.cells), -1)
        for cell in range(len(one.cells))], [int]),
    "proved_at_least": of("at_least", int), "proof": of(proof, Maybe(PROOF)),
    "apart": of(lambda one: [(part, one) for part in one.apart], [{
        "cells": of(lambda one: [index(one[1].cells, one[0].cell),
                                 index(one[1].cells, one[0].other)], [[int]]),
        "proof": of(lambda one: (one[0].proof, one[1]), Maybe(PROOF)),
    }]),
    "left_out": causes("left_out"),
    "unsettled": of(lambda one: [index(one.cells, k) for k in one.unsettled], [[int]]),
    "collisions": COLLISIONS, "lacking": of("lacking", Maybe(str)), "message": of("message", str),
    "timing": {"load_s": float, "search_s": float, "divide_s": float, "total_s": float},
    "robot": of("robot.name", str), "seed": of("seed", int), "version": str,
}  # fmt: skip


class Number:
    """A value of a quantity under a key with its unit: `given_deg`, `given_m`; none without."""

    def __init__(self, get: Callable[[Any], Any]) -> None:
        self.get = get


def finding(get: Callable[[Any], Any]) -> Of:
    """A verdict at one value of a threshold's quantity."""
    return of(
        lambda one: None if get(one) is None else (one.quantity, get(one)),
        Maybe({
            "value": Number(lambda one: (one[0], one[1].value)),
            "verdict": of(lambda one: str(one[1].answer), str),
            "evidence": of(lambda one: str(one[1].evidence), str),
            "detail": of(lambda one: one[1].detail, str),
            "unaided": of(lambda one: one[1].unaided, Maybe(bool)),
        }),
    )  # fmt: skip


EXPLAIN = {
    "case": str, "verdict": of("verdict.answer", str), "evidence": of("verdict.evidence", str),
    "cells": of(lambda one: len(one.verdict.cells), int),
    "covered": of(lambda one: int(one.verdict.covered.sum()), int),
    "thresholds": of("thresholds", [{
        "quantity": of("quantity.name", str), "key": str, "kind": of("quantity.kind", str),
        "given": Number(lambda one: (one.quantity, one.quantity.given)),
        "furthest": Number(lambda one: (one.quantity, one.quantity.end)),
        "resolution": Number(lambda one: (one.quantity, one.resolution)),
        "feasible": finding(lambda one: one.feasible),
        "other": finding(lambda one: one.other),
        "until": Maybe(dict), "tried": of("tried", str), "opens": Maybe(str), "sentence": str,
    }]),
    "useful": {"sentence": str, "set": [str]},
    "pair": Maybe([dict]),
    "joints": [{"joint": str, "limits": str, "used": str}],
    "rates": of("rates", Maybe({
        "largest_speed_m_per_s": of("largest", Maybe(float)),
        "witness_speed_m_per_s": of("witness.speed", Maybe(float)),
        "min_singular_value": of("witness.sigma", Maybe(float)),
        "stops_in_place": of(lambda one: sum(s.why == "in place" for s in one.witness.stops), int),
        "corners": of(lambda one: sum(s.why == "corner" for s in one.witness.stops), int),
    })),
    "not_looked_at": of("left_out", [str]),
    "dropped": of(lambda one: one.dropped and (one.dropped, one.verdict), Maybe({
        "cells": of(lambda one: [index(one[1].cells, k) for k in one[0].cells], [[int]]),
        "area_m2": of(lambda one: one[1].cells.areas[one[0].cells].sum(), float),
        "share": of(lambda one: one[1].cells.areas[one[0].cells].sum() / one[1].cells.areas.sum(),
                    float),
        "waypoints": of(lambda one: one[0].waypoints, Maybe(int)),
    })),
    "collisions": of(lambda one: checked(one.verdict), [str]),
    "evaluations": int, "seconds": float, "robot": of("verdict.robot.name", str),
    "seed": of("verdict.seed", int), "version": str,
}  # fmt: skip
TRIAL = {
    "position": of(lambda one: list(one.pose.position), [float]),
    "rpy_deg": of(lambda one: list(one.pose.rpy_deg), [float]),
    "stage": of("stage", str),
    **{name: of(name, float) for name in ("in_reach", "probed", "share", "margin")},
    "margins": of(
        "margins", Maybe({name: of(name, float) for name in ("limits", "cone", "reach")})
    ),
    "cells": of(lambda one: one.covers.shape[1], int),
    "verdict": of("answer", Maybe(str)), "evidence": of("evidence", Maybe(str)),
    "message": of("message", str), "causes": of("causes", Named(int)),
}  # fmt: skip
SEARCHED = ("search", "check")
PLACE = {
    "answer": of("found.answer", str), "evidence": of("found.evidence", str),
    "message": of("found.message", str),
    "region": of(
        lambda one: dict(zip(("x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg"),
                             map(list, one.found.region.ranges), strict=True)), Named([float]),
    ),
    "placements": of(
        lambda one: [t for t in one.found.trials if t.answer == "feasible"], [TRIAL]
    ),
    "best": of("found.best", Maybe(TRIAL)),
    "share": of(lambda one: one.found.best.share
                if one.found.best is not None and one.found.best.stage in SEARCHED else None,
                Maybe(float)),
    "collisions": of(lambda one: checked(one.found), [str]),
    "cause": of("found.cause", Maybe(str)), "causes": of("found.causes", Named(int)),
    "stations": of("plan", Maybe({
        "optimal": of("stations.optimal", bool), "at_least": of("stations.bound", int),
        "left_out": of(lambda one: one.stations.left_out.tolist(), [int]),
        "not_judged": of("not_judged", [str]),
        "stations": of(lambda one: list(zip(one.stations.stations, one.trials, one.refusals,
                                            strict=True)), [{
            "position": of(lambda one: list(one[1].pose.position), [float]),
            "rpy_deg": of(lambda one: list(one[1].pose.rpy_deg), [float]),
            "cells": of(lambda one: one[0].cells.tolist(), [int]),
            "certified": of(lambda one: not one[2], bool),
        }]),
    })),
    "map": Maybe(dict), "statistics": of("found.statistics", Named(int)), "timing": Named(float),
    "robot": of("found.robot.name", str), "version": str,
}  # fmt: skip
STUDY = {
    "study": str, "description": str,
    "parameters": of(lambda one: list(one.study.labels), [str]),
    "collisions": [str],
    "tasks": of(lambda one: len(one.rows), int),
    "verdicts": of(lambda one: {word: sum(row.result["verdict"] == word for row in one.rows) for
                                word in ("feasible", "infeasible", "undecided")}, Named(int)),
    "failed": of(lambda one: sum(row.status == "failed" for row in one.rows), int),
    "rows": of("rows", [{
        "parameters": of("parameters", Same()), "status": of("status", str), "seconds": float,
        "...": of("result", Rest()),
    }]),
    "version": str,
}  # fmt: skip
ARM = ("robot", "joints", "reach_m", "verdict", "evidence", "message", "share", "covered", "cells",
       "cause", "patches", "patches_share", "critical_cone_deg", "margins",
       "unchecked_links")  # fmt: skip
COMPARE = {
    "case": of("case", str),
    "collisions": of(lambda one: checked(one), [str]),
    "robots": of("arms", [{**{name: of(name, Same()) for name in ARM}, "seconds": float}]),
    "ranking": of(lambda one: [arm.robot for arm in one.ranked], [str]),
    "version": str,
}  # fmt: skip


def close(value: Any, source: Any) -> bool:
    """Equal, numbers to rounding."""
    if isinstance(source, (float, np.floating)) or isinstance(value, float):
        return type(value) in (int, float) and math.isclose(value, source, rel_tol=1e-6,
                                                            abs_tol=1e-9)  # fmt: skip
    if isinstance(value, dict):
        return value.keys() == source.keys() and all(close(value[k], source[k]) for k in value)
    if isinstance(value, list):
        return len(value) == len(source) and all(map(close, value, source))
    return bool(value == source)


def conforms(value: Any, schema: Any, source: Any = UNKNOWN, path: str = "$") -> None:
    """Fail unless `value` has exactly the keys and types of the schema, and the source's values."""
    __tracebackhide__ = True
    if isinstance(schema, Of):
        conforms(value, schema.inner, schema.source(source), path)
    elif isinstance(schema, Maybe):
        there = source is not None and (source is UNKNOWN or _finite(source))
        if source is not UNKNOWN:
            assert (value is not None) == there, f"{path}: {value!r}, and not {source!r}"
        if value is not None:
            conforms(value, schema.inner, source, path)
    elif isinstance(schema, OneOf):
        assert value in schema.words, f"{path}: {value!r}"
        _same(value, source, path)
    elif isinstance(schema, Named):
        assert isinstance(value, dict), f"{path}: {value!r}"
        if source is not UNKNOWN:
            assert list(value) == list(map(str, source)), f"{path}: {list(value)}"
        for key, item in value.items():
            part = UNKNOWN if source is UNKNOWN else source[key]
            conforms(item, schema.inner, part, f"{path}.{key}")
    elif isinstance(schema, ProofTree):
        _conforms_node(value, source, path)
    elif isinstance(schema, dict):
        _conforms_object(value, schema, source, path)
    elif isinstance(schema, list):
        assert isinstance(value, list), f"{path}: {value!r}"
        parts = [UNKNOWN] * len(value) if source is UNKNOWN else list(source)
        assert len(parts) == len(value), f"{path}: {len(value)} items, and not {len(parts)}"
        for k, (item, part) in enumerate(zip(value, parts, strict=True)):
            conforms(item, schema[0], part, f"{path}[{k}]")
    elif isinstance(schema, (Same, Rest)):
        _same(value, source, path)
    elif schema is float:
        assert type(value) in (int, float), f"{path}: {value!r}"
        assert math.isfinite(value), f"{path}: {value!r}"
        _same(value, source, path)
    else:
        assert type(value) is schema, f"{path}: {value!r}"
        _same(value, source, path)


def _finite(source: Any) -> bool:
    return not isinstance(source, (float, np.floating)) or math.isfinite(source)


def _same(value: Any, source: Any, path: str) -> None:
    if source is not UNKNOWN:
        source = (
            source if isinstance(value, (dict, list)) or not isinstance(value, str) else str(source)
        )
        assert close(value, source), f"{path}: {value!r}, and not {source!r}"


def _conforms_object(value: Any, schema: dict[str, Any], source: Any, path: str) -> None:
    """Keys in their order, but for those that may be missing; `...` stands for all others."""
    assert isinstance(value, dict), f"{path}: {value!r}"
    left = list(value)
    for key, inner in schema.items():
        if key == "...":
            if source is not UNKNOWN:
                rest = inner.source(source)
                assert left == list(rest), f"{path}: {left}"
                timed = [name for name in left if "seconds" in name or name == "timing"]
                for name in set(left) - set(timed):
                    _same(value[name], rest[name], f"{path}.{name}")
            left = []
        elif isinstance(inner, Number):
            left = _number(value, key, inner, source, left, path)
        else:
            part, kind = source if isinstance(inner, dict) else UNKNOWN, inner
            if isinstance(inner, Of):
                part, kind = inner.source(source), inner.inner
            if isinstance(kind, Perhaps):
                there = key in value if part is UNKNOWN else part is not None
                assert (key in value) == there, f"{path}.{key}: there it is {key in value}"
                if not there:
                    continue
                kind = kind.inner
            assert left[:1] == [key], f"{path}: {list(value)}, where {key} should be next"
            left = left[1:]
            conforms(value[key], kind, part, f"{path}.{key}")
    assert not left, f"{path}: {left} should not be there"


def _number(value: Any, key: str, inner: Number, source: Any, left: list[str], path: str) -> list:
    """A value with its unit in the key; the keys that are left."""
    if source is UNKNOWN:
        return [name for name in left if name not in (f"{key}_deg", f"{key}_m")]
    quantity, number = inner.get(source)
    if not quantity.unit or number is None:
        return left
    turns = quantity.unit == "rad"
    name = f"{key}_deg" if turns else f"{key}_m"
    assert left[:1] == [name], f"{path}: {list(value)}, where {name} should be next"
    _same(value[name], math.degrees(number) if turns else float(number), f"{path}.{name}")
    return left[1:]


def _conforms_node(value: Any, source: Any, path: str) -> None:
    """A node of a proof's tree; the source is (node, what has arm and cells)."""
    node, owner = (None, None) if source is UNKNOWN else source
    if "cell" in value:
        conforms(value, {"cell": [int]}, path=path)
        if node is not None:
            _same(value["cell"], index(owner.cells, node.cell), f"{path}.cell")
        return
    slides = node is not None and node.joint is not None and owner.robot.prismatic[node.joint]
    cuts = (
        {"joint": str, "value_deg": float, "below": dict, "above": dict},
        {"joint": str, "value_m": float, "below": dict, "above": dict},
        {"weights": Named(float), "value": float, "below": dict, "above": dict},
    )
    conforms(value, next(cut for cut in cuts if list(cut) == list(value)), path=path)
    if node is not None and node.joint is None:
        names = owner.robot.joint_names
        weights = {name: w for name, w in zip(names, node.weights, strict=True) if w}
        _same(value["weights"], weights, f"{path}.weights")
        _same(value["value"], float(node.value), f"{path}.value")
    elif node is not None:
        _same(value["joint"], owner.robot.joint_names[node.joint], f"{path}.joint")
        where = node.value if slides else math.degrees(node.value)
        _same(value["value_m" if slides else "value_deg"], float(where), f"{path}.value")
    for side in ("below", "above"):
        part = UNKNOWN if node is None else (getattr(node, side), owner)
        _conforms_node(value[side], part, f"{path}.{side}")
