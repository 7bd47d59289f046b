"""What `--json` of every command has to say of a Python answer, key by key and in this order.

Numbers are the answer's own, and null where they are not finite. What Python cannot know, times and
sentences, is a type, or several.
"""

import math
from types import NoneType
from typing import Any

import numpy as np

Json = dict[str, Any]
OBJECT_OR_NULL = (dict, NoneType)
SECONDS = dict.fromkeys(("load_s", "search_s", "certify_s", "total_s"), float)


def agree(value: Any, expected: Any, path: str = "$") -> None:
    """Fail unless a JSON value is what is expected, numbers to rounding."""
    __tracebackhide__ = True
    if isinstance(expected, (type, tuple)):
        kinds = (int, float) if expected is float else expected
        assert isinstance(value, kinds), f"{path}: {value!r}"
        assert not isinstance(value, bool) or expected is bool, f"{path}: {value!r}"
        assert not isinstance(value, float) or math.isfinite(value), f"{path}: {value!r}"
    elif isinstance(expected, dict):
        assert isinstance(value, dict), f"{path}: {value!r}"
        assert list(value) == list(map(str, expected)), f"{path}: {list(value)} not {[*expected]}"
        for key, inner in expected.items():
            agree(value[str(key)], inner, f"{path}.{key}")
    elif isinstance(expected, list):
        assert isinstance(value, list), f"{path}: {value!r}"
        assert len(value) == len(expected), f"{path}: {len(value)} items, and not {len(expected)}"
        for k, (one, inner) in enumerate(zip(value, expected, strict=True)):
            agree(one, inner, f"{path}[{k}]")
    elif isinstance(expected, (float, np.floating)) and math.isfinite(expected):
        assert type(value) in (int, float), f"{path}: {value!r}"
        close = math.isclose(value, expected, rel_tol=1e-6, abs_tol=1e-9)
        assert close, f"{path}: {value!r}, and not {expected!r}"
    elif expected is None or isinstance(expected, (float, np.floating)):
        assert value is None, f"{path}: {value!r}, and not {expected!r}"
    else:
        expected = str(expected) if isinstance(expected, str) else expected
        same = type(value) is type(expected) and value == expected
        assert same, f"{path}: {value!r}, and not {expected!r}"


def there(**parts: Any) -> Json:
    """Keys that are there only where they have a value."""
    return {name: value for name, value in parts.items() if value is not None}


def degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def index(cells: Any, k: int) -> list[int]:
    """A cell as people count it: row and column of a grid, else its number."""
    shape = getattr(cells, "shape", None)
    return [int(k)] if shape is None or len(shape) < 2 else [*map(int, divmod(k, shape[1]))]


def checked(asked: Any) -> list[str]:
    """What is checked, by the case: the words of CONTRACT."""
    if asked is None:
        return []
    parts = ("self", asked.self_), ("surface", asked.surface), ("scene", len(asked.scene) > 0)
    return [name for name, asked_for in parts if asked_for]


def ended(one: Any) -> Json:
    return {"robot": one.robot.name, "version": str}


def bounds(one: Any) -> Json:
    """A certificate, but for limits."""
    return {
        "waypoints": one.waypoints, "max_position_error_m": one.max_position_error,
        "max_angle_deg": degrees(one.max_angle),
        **there(max_roll_deg=degrees(one.max_roll), max_speed_m_per_s=one.max_speed,
                stops_in_place=one.stops_in_place, corners=one.corners,
                min_singular_value=one.min_singular_value),
        "placement_margin": one.placement_margin and {
            "position_m": one.placement_margin.position,
            "angle_deg": degrees(one.placement_margin.angle),
            "pivot": list(one.placement_margin.pivot),
            "bound_by": str(one.placement_margin.bound_by), "cell": list(one.placement_margin.cell),
        },
        **clearances(one),
    }  # fmt: skip


def clearances(one: Any) -> Json:
    pair = None if one.nearest_pair is None else list(one.nearest_pair)
    return there(min_clearance_m=one.min_clearance, measured_clearance_m=one.measured_clearance,
                 nearest_pair=pair)  # fmt: skip


def certificate(one: Any) -> Json | None:
    """Of a verdict or what became of a claim; the margin is that of the joints that turn."""
    if one.certificate is None:
        return None
    q = one.q if hasattr(one, "q") else None if one.witness is None else one.witness.q
    margin = one.certificate.min_limit_margin
    if np.ndim(q) == 2:
        off = np.minimum(q - one.robot.lower, one.robot.upper - q)
        margin = off[:, ~one.robot.prismatic].min(initial=np.inf)
    return {**bounds(one.certificate), "min_limit_margin_deg": degrees(margin)}


def causes(given: Any, cells: Any) -> list[Json]:
    return [
        {
            "cell": index(cells, one.cell), "cause": str(one.kind), "proved": one.proved,
            "detail": one.detail,
            **there(pair=one.pair and list(one.pair), clearance_m=one.clearance),
        }
        for one in given
    ]  # fmt: skip


def proof(tree: Any, owner: Any) -> Json | None:
    """A cut tree, beside what has arm and cells."""
    if tree is None:
        return None
    names = owner.robot.joint_names
    opened = {names[j]: value for j, value in tree.opened}
    return {"kind": str(tree.kind), "opened": opened, "tree": node(tree.root, owner)}


def node(one: Any, owner: Any) -> Json:
    """A leaf with its cell, or a cut with what is below and above it."""
    if hasattr(one, "cell"):
        return {"cell": index(owner.cells, one.cell)}
    names = owner.robot.joint_names
    if owner.robot.prismatic[one.joint]:
        cut = {"joint": names[one.joint], "value_m": one.value}
    else:
        cut = {"joint": names[one.joint], "value_deg": degrees(one.value)}
    return {**cut, "below": node(one.below, owner), "above": node(one.above, owner)}


def treated(one: Any) -> Json | None:
    """The share of the area that a motion treats."""
    return None if one is None else {
        "lower": one.lower, "upper": one.upper, "twice": one.twice, "area_m2": one.area,
        "footprint_m": list(one.footprint),
        "untreated": [{"centre": p.centre.tolist(), "area_m2": p.area} for p in one.untreated],
        "notes": list(one.notes),
    }  # fmt: skip


def of_check(one: Any, printed_walk: bool = False) -> Json:
    walk = {
        "joints": list(one.robot.joint_names), "q": one.witness.q.tolist(),
        "cell": [None if k < 0 else int(k) for k in one.witness.cell],
    } if printed_walk else None  # fmt: skip
    left_out = [
        {"pair": [p.first, p.second], "why": p.why, **there(rate=p.rate)}
        for p in one.pairs_left_out
    ]
    return {
        "verdict": one.answer, "evidence": one.evidence, "cells": len(one.cells),
        "covered": int(one.covered.sum()), "edges": one.graph.number_of_edges(),
        "uncovered": causes(one.causes, one.cells), "certificate": certificate(one),
        "collisions": checked(one.task.collision), "unchecked_links": list(one.unchecked_links),
        "pairs_left_out": left_out, "proof": proof(one.proof, one),
        "treated": treated(one.treated), "timing": SECONDS, "robot": one.robot.name,
        "method": one.method, "seed": one.seed, "version": str,
        "message": str,  # beyond CONTRACT: what was found, in sentences
        **there(witness=walk),
    }  # fmt: skip


def of_verify(one: Any) -> Json:
    reached = one.reached
    missed = [] if reached is None else np.flatnonzero(~reached).tolist()
    known = None if "collisions" in one.not_judged else one.task.collision
    return {
        "verdict": "does not hold" if one.faults else "holds", "claim": str(one.claim),
        "cells": len(one.cells), "reached": None if reached is None else int(reached.sum()),
        "missed": [index(one.cells, k) for k in missed],
        "refusals": [
            {"row": None if f.row < 0 else f.row + 1, "share": None if f.row < 0 else f.share,
             "text": f.text} for f in one.faults
        ],
        "certificate": certificate(one), "proof": proof(one.proof, one),
        "boxes": None if one.proof is None else one.boxes, "treated": treated(one.treated),
        "not_judged": list(one.not_judged), "in_time": not one.late, "collisions": checked(known),
        "notes": list, **ended(one),
    }  # fmt: skip


def of_path(one: Any) -> Json:
    path, figures, rates, ends = one.path, one.path.figures, one.rates, one.ends
    return {
        "verdict": "feasible", "order": path.order, "cells": int(path.needed.sum()),
        "visits": [int(k) for k in path.walk.cell if k >= 0],
        "length_m": figures.length, "covered_m": figures.length - figures.revisited,
        "revisited_m": figures.revisited, "revisited_share": figures.revisited_share,
        "joint_travel": travel(path.robot, path.walk.q),
        "margins": {
            "limit_deg": degrees(figures.turn_margin), "limit_m": figures.slide_margin,
            "cone_deg": degrees(figures.cone_margin), "singular_value": figures.singular_value,
        },
        "certificate": bounds(path.certificate),
        "treated": treated(one.treated), "passes": one.passes and layout(one.passes),
        "trajectory": timed(one),
        **there(
            rates=rates and {
                "holds": rates.accepted, "why_not": list(rates.faults),
                **there(speed_m_per_s=path.task.speed),
                "stops": [{"why": stop.why, "cell": list} for stop in rates.stops],
                "waiting_s": rates.waiting, "share_at_speed": float,
                "min_singular_value": rates.sigma,
            },
            ends=ends and {
                "approach_m": ends.approach, "from_home": ends.from_home,
                "entry": ends.entry.tolist(), "exit": ends.exit.tolist(),
            },
        ),
        "collisions": checked(path.task.collision), **ended(path),
    }  # fmt: skip


def travel(robot: Any, q: np.ndarray) -> Json:
    ways = zip(robot.joint_names, np.abs(np.diff(q, axis=0)).sum(axis=0), robot.prismatic,
               strict=True)  # fmt: skip
    return {
        name: {"travel_m": way} if slides else {"travel_deg": degrees(way)}
        for name, way, slides in ways
    }


def layout(one: Any) -> Json:
    return {
        "count": one.count, "stretches": len(one.stretches), "by": one.by, "pitch_m": one.pitch,
        "spacing_m": one.spacing, "widest_m": one.widest, "length_m": one.length,
        "dropped_m": one.dropped, "beyond_border_m": one.beyond_border, "notes": list,
    }  # fmt: skip


def timed(one: Any) -> Json:
    most, limits, time = one.most, one.limits, one.run.time

    def by_joint(values: np.ndarray) -> Json:
        return dict(zip(one.path.robot.joint_names, values.tolist(), strict=True))

    return {
        "duration_s": time[-1] - time[0], "samples": len(time), "tool_way_m": one.run.tool_way,
        "max_tool_speed": most.tool_speed * limits.tool_speed,
        "max_velocity": by_joint(most.velocity * limits.velocity),
        "max_acceleration": by_joint(most.acceleration * limits.acceleration),
        "limits": {
            "tool_speed": limits.tool_speed, "velocity": by_joint(limits.velocity),
            "acceleration": by_joint(limits.acceleration),
        },
    }  # fmt: skip


def of_runs(one: Any) -> Json:
    found, along = one.found, one.along
    return {
        "verdict": along.verdict.answer, "evidence": along.verdict.evidence,
        "message": along.verdict.message, "passes": layout(along.passes),
        "runs": [
            {
                "stretches": [1 + k for k in found.stretches_of(run)],
                "poses": run.walk.cell[run.walk.cell >= 0][[0, -1]].tolist(),
                "length_m": run.figures.length, "duration_s": moved.time[-1] - moved.time[0],
                "certificate": bounds(run.certificate),
            } for run, moved in zip(found.runs, one.timed, strict=True)
        ],
        "cuts": [
            {
                "stretch": None if cut.stretch < 0 else 1 + cut.stretch, "along_m": cut.along,
                "poses": [cut.pose, cut.next_pose], "cause": cut.cause,
                "joints": list(found.robot.joint_names), "waypoints": cut.move.waypoints.tolist(),
                "clear": not cut.move.refusal, "refusal": cut.move.refusal,
            } for cut in found.cuts
        ],
        "left_out_m": float(sum(gap.length for gap in found.gaps)),
        "left_out": [
            {"stretches": [1 + k for k in gap.stretches], "length_m": gap.length,
             "cause": gap.cause, "proved": gap.proved} for gap in found.gaps
        ],
        "refused": list(found.refusals), "treated": treated(one.treated),
        "collisions": checked(along.task.collision), **ended(found),
    }  # fmt: skip


def of_divide(one: Any) -> Json:
    """The fewest patches; CONTRACT has no words for the answer in Python."""
    plan, cells = one, one.cells
    by_cell = [
        next((k for k, patch in enumerate(plan.patches) if cell in patch.cells), -1)
        for cell in range(len(cells))
    ]
    return {
        "answer": str, "cells": len(cells),
        "covered": len({k for patch in plan.patches for k in patch.cells.tolist()}),
        "ended": one.ended, "optimal": one.ended and len(plan.patches) <= plan.bound,
        "at_least": plan.bound,
        "patches": [
            {
                "cells": [index(cells, k) for k in patch.cells],
                "area_m2": cells.areas[patch.cells].sum(), "pieces": patch.pieces,
                "accepted": patch.accepted, "refusal": patch.refusal or None,
                "certificate": {
                    **bounds(patch.certificate),
                    "min_limit_margin": patch.certificate.min_limit_margin,
                },
            } for patch in plan.patches
        ],
        "moves": [move_between(plan, k) for k in range(len(plan.moves))],
        "patch_of_cell": by_cell, "proved_at_least": one.at_least, "proof": proof(one.proof, one),
        "apart": [
            {"cells": [index(cells, part.cell), index(cells, part.other)],
             "proof": proof(part.proof, one)} for part in one.apart
        ],
        "left_out": causes(one.left_out, cells),
        "unsettled": [index(cells, k) for k in one.unsettled],
        "collisions": checked(one.task.collision), "lacking": one.lacking, "message": one.message,
        "timing": dict.fromkeys(("load_s", "search_s", "divide_s", "total_s"), float),
        "robot": one.robot.name, "seed": one.seed, "version": str,
    }  # fmt: skip


def move_between(plan: Any, k: int) -> Json:
    """From the end of patch k to the start of the next: how far each joint goes, by its ends."""
    move, patches = plan.moves[k], plan.patches
    by = zip(move.joint_names, move.prismatic, move.end - move.start, strict=True)
    return {
        "from": k, "to": k + 1, "start": patches[k].walk.q[-1].tolist(),
        "end": patches[k + 1].walk.q[0].tolist(), "waypoints": move.waypoints.tolist(),
        "refusal": move.refusal or None,
        **({} if move.replayed is None else clearances(move.replayed)),
        "joints": [
            {"joint": name, **({"by_m": d} if slides else {"by_deg": degrees(d)})}
            for name, slides, d in by
        ],
    }  # fmt: skip


def with_unit(quantity: Any, key: str, value: float | None) -> Json:
    """A value under a key with its unit: `given_deg`, `given_m`; none without."""
    if not quantity.unit or value is None:
        return {}
    return {f"{key}_deg": degrees(value)} if quantity.unit == "rad" else {f"{key}_m": float(value)}


def finding(quantity: Any, one: Any) -> Json | None:
    return None if one is None else {
        **with_unit(quantity, "value", one.value), "verdict": one.answer,
        "evidence": one.evidence, "detail": one.detail,
    }  # fmt: skip


def of_explain(one: Any) -> Json:
    verdict, rates, dropped = one.verdict, one.rates, one.dropped
    cells, stops = verdict.cells, [] if rates is None else [s.why for s in rates.witness.stops]
    share = dropped and cells.areas[dropped.cells].sum()
    return {
        "case": str, "verdict": verdict.answer, "evidence": verdict.evidence,
        "cells": len(cells), "covered": int(verdict.covered.sum()),
        "thresholds": [
            {
                "quantity": limit.quantity.name, "key": str, "kind": limit.quantity.kind,
                **with_unit(limit.quantity, "given", limit.quantity.given),
                **with_unit(limit.quantity, "furthest", limit.quantity.end),
                **with_unit(limit.quantity, "resolution", limit.resolution),
                "feasible": finding(limit.quantity, limit.feasible),
                "other": finding(limit.quantity, limit.other),
                "tried": limit.tried, "opens": (str, NoneType),
            } for limit in one.thresholds
        ],
        "useful": {"sentence": str, "set": list}, "pair": (list, NoneType), "joints": list,
        "rates": rates and {
            "largest_speed_m_per_s": rates.largest, "witness_speed_m_per_s": rates.witness.speed,
            "min_singular_value": rates.witness.sigma,
            "stops_in_place": stops.count("in place"), "corners": stops.count("corner"),
        },
        "not_looked_at": list(one.left_out),
        "dropped": dropped and {
            "cells": [index(cells, k) for k in dropped.cells], "area_m2": share,
            "share": share / cells.areas.sum(),
            "waypoints": dropped.witness and len(dropped.witness.q),
        },
        "collisions": checked(verdict.task.collision), "evaluations": int, "seconds": float,
        "robot": verdict.robot.name, "seed": verdict.seed, "version": str,
    }  # fmt: skip


def trial(one: Any) -> Json | None:
    return None if one is None else {
        "position": list(one.pose.position), "rpy_deg": list(one.pose.rpy_deg),
        "tried": one.effort,
        "share": one.share, "margin_m": one.margin,
        "cells": one.covers.shape[1], "verdict": one.answer, "evidence": one.evidence,
        "message": one.message, "causes": dict(one.result["causes"]),
    }  # fmt: skip


def of_place(one: Any) -> Json:
    found, plan, best = one.found, one.plan, one.found.best
    axes = ("x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg")
    return {
        "answer": found.answer, "evidence": found.evidence, "message": found.message,
        "region": dict(zip(axes, map(list, found.region.ranges), strict=True)),
        "placements": list(map(trial, found.found)),
        "best": trial(best), "share": best and best.share,
        "collisions": checked(found.task.collision), "cause": found.cause,
        "causes": dict(found.causes),
        "stations": plan and {
            "optimal": plan.optimal, "at_least": plan.bound,
            "left_out": plan.cells(-1).tolist(), "not_judged": list(plan.not_judged),
            "stations": [
                {"position": list(tried.pose.position), "rpy_deg": list(tried.pose.rpy_deg),
                 "cells": plan.cells(k).tolist(), "certified": not plan.refusals[k]}
                for k, tried in enumerate(plan.trials)
            ],
        },
        "map": OBJECT_OR_NULL, "statistics": dict(found.statistics), "timing": dict,
        **ended(found),
    }  # fmt: skip


def without_times(result: Any) -> Any:
    """A result of a task, in which times are types."""
    return {
        name: dict if name == "timing" else float if "seconds" in name else value
        for name, value in result.items()
    }


def of_study(one: Any) -> Json:
    words = ("feasible", "infeasible", "undecided")
    return {
        "study": str, "description": str, "parameters": list(one.study.labels),
        "collisions": list, "tasks": len(one.rows),
        "verdicts": {
            w: sum(row.result["verdict"] == w for row in one.rows) for w in words
        },
        "failed": sum(row.status == "failed" for row in one.rows),
        "rows": [
            {"parameters": dict(row.parameters), "status": row.status, "seconds": float,
             **without_times(row.result)} for row in one.rows
        ],
        "version": str,
    }  # fmt: skip


ARM = ("robot", "joints", "reach_m", "verdict", "evidence", "message", "share", "covered", "cells",
       "cause", "patches", "patches_share", "critical_cone_deg", "margins",
       "unchecked_links")  # fmt: skip


def of_compare(one: Any) -> Json:
    arms = [{**{name: getattr(arm, name) for name in ARM}, "seconds": float} for arm in one.arms]
    return {
        "case": one.case, "collisions": checked(one.collision), "robots": arms,
        "ranking": [arm.robot for arm in one.ranked], "version": str,
    }  # fmt: skip
