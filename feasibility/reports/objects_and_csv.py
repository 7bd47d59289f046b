"""Parts that several answers share as JSON objects and as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from coverable.arrays import Array
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.reports.text_and_tables import limit_margin_deg
from feasibility.results.plain import plain
from feasibility.verdict import Cause, Certificate, Walk
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.certification.collisions.collision_replay import CollisionReplay
    from robots.shapes.link_pairs import LeftOut

MARGINS = ("limit_deg", "limit_m", "cone_deg", "reach_m", "placement_m")


def smooth_json(surface: Surface) -> dict[str, Any]:
    """Of a smoothed copy, over which length, how far off, and what became of that."""
    made = surface.smoothing
    if made is None:
        return {}
    counted = made.counted
    return {"smooth": {"length_m": made.length, "off_m": made.off, "taken_off_tolerance": counted}}


def causes_json(causes: Iterable[Cause], cells: Cells) -> list[dict[str, Any]]:
    """Why each missed cell is missed."""
    return [
        {
            "cell": list(cells.unravel(cause.cell)),
            "cause": str(cause.kind),
            "proved": bool(cause.proved),
            "detail": cause.detail,
            **({} if cause.pair is None else {"pair": list(cause.pair)}),
            **({} if cause.clearance is None else {"clearance_m": float(cause.clearance)}),
        }
        for cause in causes
    ]


def left_out_json(one: LeftOut) -> dict[str, Any]:
    """A pair that is not checked."""
    found: dict[str, Any] = {"pair": [one.first, one.second], "why": one.why}
    return found if one.rate is None else {**found, "rate": float(one.rate)}


def certificate_json(certificate: Certificate) -> dict[str, Any]:
    """What the replay of a motion measured, with clearance; null where it measured nothing."""
    found: dict[str, Any] = {
        "waypoints": int(certificate.waypoints),
        "max_position_error_m": plain(float(certificate.max_position_error)),
        "max_angle_deg": plain(math.degrees(certificate.max_angle)),
    }
    if certificate.max_roll is not None:
        found["max_roll_deg"] = plain(math.degrees(certificate.max_roll))
    if certificate.stops_in_place is not None:
        found["max_speed_m_per_s"] = plain(certificate.max_speed)
        found["stops_in_place"], found["corners"] = certificate.stops_in_place, certificate.corners
    if certificate.min_singular_value is not None:
        found["min_singular_value"] = plain(float(certificate.min_singular_value))
    margin = certificate.placement_margin
    found["placement_margin"] = margin and {
        "position_m": margin.position,
        "angle_deg": math.degrees(margin.angle),
        "pivot": list(margin.pivot),
        "bound_by": margin.bound_by,
        "cell": list(margin.cell),
    }
    return found | clearance_json(certificate)


def measured_json(
    robot: Robot, certificate: Certificate | None, q: Array | None
) -> dict[str, Any] | None:
    """What the replay of a motion q (m, n) measured, with limits; null without one.

    The margins of prismatic joints are not among these.
    """
    if certificate is None:
        return None
    margin = plain(limit_margin_deg(robot, certificate, q))
    return {**certificate_json(certificate), "min_limit_margin_deg": margin}


def clearance_json(certificate: Certificate | CollisionReplay) -> dict[str, Any]:
    """How near which pair came along a motion; no keys where collisions were not checked.

    `min_clearance_m` is certified, `measured_clearance_m` the least that coal measured: the truth
    lies between the two.
    """
    if certificate.min_clearance is None:
        return {}
    pair = certificate.nearest_pair
    return {
        "min_clearance_m": plain(float(certificate.min_clearance)),
        "measured_clearance_m": plain(certificate.measured_clearance),
        "nearest_pair": None if pair is None else list(pair),
    }


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Rows as CSV; None is an empty field."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def walk_csv(robot: Robot, walk: Walk) -> str:
    """A motion as CSV: `cell`, empty between centres, then one column per joint, rad or m.

    Numbers are written so that they read back as the same numbers.
    """
    rows = zip(walk.cell.tolist(), walk.q.tolist(), strict=True)
    lines = (["" if cell < 0 else cell, *map(repr, q)] for cell, q in rows)
    return csv_text([["cell", *robot.joint_names], *lines])


def proof_json(tree: CutTree | None, robot: Robot, cells: Cells) -> dict[str, Any] | None:
    """The tree as JSON; null where there is none.

    A cut has its joint and `value_deg` (`value_m` of one that slides), and what is below and above
    it. A leaf names its cell.
    """
    if tree is None:
        return None
    return {
        "kind": tree.kind,
        "opened": {robot.joint_names[joint]: float(value) for joint, value in tree.opened},
        "tree": _node(tree.root, robot, cells),
    }


def _node(node: Cut | Leaf, robot: Robot, cells: Cells) -> dict[str, Any]:
    """One node and those under it; trees are shallow, as the search and result files have them."""
    if isinstance(node, Leaf):
        return {"cell": list(cells.unravel(node.cell))}
    sides = {
        "below": _node(node.below, robot, cells),
        "above": _node(node.above, robot, cells),
    }
    slides = bool(robot.prismatic[node.joint])
    key, value = ("value_m", node.value) if slides else ("value_deg", math.degrees(node.value))
    return {"joint": robot.joint_names[node.joint], key: float(value), **sides}
