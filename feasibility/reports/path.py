"""A coverage path and its timing as one JSON object, and as text for people."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from coverable.errors import at_least, at_most, counted
from feasibility.certification.rate_replay import RateReplay
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.demands.area import TreatedArea
from feasibility.demands.treated_words import treated_json, treated_words
from feasibility.division.between_patches import Ends
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.metrics import PathFigures
from feasibility.reports.objects_and_csv import certificate_json, smooth_json
from feasibility.reports.pass_runs import passes_json, passes_text
from feasibility.reports.text_and_tables import (
    clearance_text,
    placement_text,
    roll_text,
    smooth_text,
    summary,
)
from feasibility.reports.verdict_json import as_json as verdict_json
from feasibility.results.plain import plain
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.speed_limits import MotionLimits, used
from feasibility.verdict import Verdict
from feasibility.version import version
from surfaces.passes.parallel import Passes

FEW = 5  # cells that are named
HARDLY_LESS = 0.9  # [1] of the required speed


def as_json(
    path: CoveragePath,
    trajectory: Trajectory | None = None,
    limits: MotionLimits | None = None,
    passes: Passes | None = None,
    treated: TreatedArea | None = None,
    rates: RateReplay | None = None,
    ends: Ends | None = None,
) -> dict[str, Any]:
    """The object that `coverable path --json` prints, without NaN.

    Units are in the keys; velocities and accelerations are in rad or m, and seconds.

    Args:
        path: the path.
        trajectory: its timing, if it is timed.
        limits: of the timing.
        passes: those that it runs, if it runs passes.
        treated: what it treats, where the task has a footprint.
        rates: where the task has a speed or a least singular value.
        ends: how it is entered and left.
    """
    figures = path.figures
    sliding = path.robot.prismatic
    return {
        "verdict": "feasible",
        "order": path.order,
        "cells": int(path.needed.sum()),
        "visits": path.visits.tolist(),
        "length_m": figures.length,
        "covered_m": figures.covered,
        "revisited_m": figures.revisited,
        "revisited_share": figures.revisited_share,
        "joint_travel": {
            name: {"travel_m": travel} if slides else {"travel_deg": math.degrees(travel)}
            for name, travel, slides in zip(
                path.robot.joint_names, figures.travel.tolist(), sliding.tolist(), strict=True
            )
        },
        "margins": {
            "limit_deg": plain(math.degrees(figures.turn_margin)),
            "limit_m": plain(figures.slide_margin),
            "cone_deg": plain(math.degrees(figures.cone_margin)),
            "singular_value": plain(figures.singular_value),
        },
        "certificate": certificate_json(path.certificate),
        "treated": treated_json(treated),
        "passes": None if passes is None else passes_json(passes, treated),
        "trajectory": None if trajectory is None else _timing(path, trajectory, limits),
        **rates_json(path, rates, trajectory),
        **ends_json(ends),
        **smooth_json(path.cells.surface if passes is None else passes.surface),
        "collisions": checked(path.task.collision),
        "robot": path.robot.name,
        "version": version(),
    }


def no_path_json(verdict: Verdict, reason: str, before_s: float = 0.0) -> dict[str, Any]:
    """What `coverable path --json` prints where there is no path: the verdict's object, and why."""
    return verdict_json(verdict, before_s) | {"message": reason, "trajectory": None}


def _timing(
    path: CoveragePath, trajectory: Trajectory, limits: MotionLimits | None
) -> dict[str, Any]:
    """Duration; with limits the maxima, of every interpolation that a controller may use."""
    names = path.robot.joint_names
    found: dict[str, Any] = {
        "duration_s": trajectory.duration,
        "samples": len(trajectory),
        "tool_way_m": trajectory.tool_way,
    }
    if limits is not None:
        most = used(path.robot, trajectory, limits)
        fastest, quickest = most.velocity * limits.velocity, most.acceleration * limits.acceleration
        found |= {
            "max_tool_speed": most.tool_speed * limits.tool_speed,
            "max_velocity": dict(zip(names, fastest.tolist(), strict=True)),
            "max_acceleration": dict(zip(names, quickest.tolist(), strict=True)),
            "limits": {
                "tool_speed": limits.tool_speed,
                "velocity": dict(zip(names, limits.velocity.tolist(), strict=True)),
                "acceleration": dict(zip(names, limits.acceleration.tolist(), strict=True)),
            },
        }
    return found


def as_text(
    path: CoveragePath,
    trajectory: Trajectory | None = None,
    limits: MotionLimits | None = None,
    passes: Passes | None = None,
    treated: TreatedArea | None = None,
    rates: RateReplay | None = None,
    ends: Ends | None = None,
) -> str:
    """The path for people: its length, margins, and times.

    The arguments are those of `as_json`.
    """
    count, figures = int(path.needed.sum()), path.figures
    over = counted(count, "cell" if passes is None else "place")
    rows = [
        ("order", f"{path.order}, {over}, {len(path.visits):,} centres passed"),
        ("length", _length_text(figures)),
        ("joint travel", _travel_text(path)),
        ("margins", _margins_text(figures)),
        (
            "certificate",
            f"{path.certificate.waypoints:,} waypoints replayed, between them too: tool within "
            f"{at_most(1e3 * path.certificate.max_position_error, 3)} mm, axis within "
            f"{at_most(math.degrees(path.certificate.max_angle), 4)} deg",
        ),
        ("roll", roll_text(path.certificate, path.task)),
        ("clearance", clearance_text(path.certificate)),
        ("placement", placement_text(path.certificate)),
        ("smoothed", smooth_text(path.cells.surface if passes is None else passes.surface)),
        ("treated", "" if treated is None else treated_words(treated)),
    ]
    if trajectory is not None:
        told = _timing(path, trajectory, limits)
        time = f"{told['duration_s']:.4g} s in {told['samples']:,} samples"
        if limits is not None:
            time += f", tool at up to {at_most(told['max_tool_speed'], 4)} m/s"
        rows += [("time", time), ("limits", _limits_text(told))]
    rows += [("speed", rates_words(path, rates, trajectory)), ("ends", ends_words(ends))]
    head = f"path: one continuous motion over {over}."
    if passes is not None:
        laid = passes_text(passes, treated)
        rows[:2] = [("passes", laid), ("length", f"{figures.length:.4g} m in all")]
        head = f"path: one continuous motion along {counted(passes.count, 'pass', 'passes')}."
    return "\n".join(summary(head, rows, said_of(path.robot, path.task.collision), 14))


def _length_text(figures: PathFigures) -> str:
    """Length, and the part that is covered again."""
    text = f"{figures.length:.4g} m on the surface"
    if figures.revisited > 0.0:
        share = f"{100 * figures.revisited_share:.2g} % of the rest"
        text += f", {figures.revisited:.3g} m of it revisited ({share})"
    return text


def _travel_text(path: CoveragePath) -> str:
    """How far each joint travels."""
    robot = path.robot
    travels = zip(robot.joint_names, path.figures.travel, robot.prismatic, strict=True)
    return ", ".join(
        f"{name} {travel:.3g} m" if slides else f"{name} {math.degrees(travel):.0f} deg"
        for name, travel, slides in travels
    )


def _margins_text(figures: PathFigures) -> str:
    """Distances from the limits, the boundary of the cone, and singularities."""
    parts = []
    if math.isfinite(figures.turn_margin):
        parts.append(f"{at_least(math.degrees(figures.turn_margin), 3)} deg from a joint limit")
    if math.isfinite(figures.slide_margin):
        parts.append(f"{at_least(1e3 * figures.slide_margin, 3)} mm from a joint limit")
    parts.append(f"{at_least(math.degrees(figures.cone_margin), 3)} deg inside the cone")
    parts.append(f"smallest singular value {at_least(figures.singular_value, 3)}")
    return ", ".join(parts)


def _limits_text(told: dict[str, Any]) -> str:
    """The share of its limits that a trajectory uses, between samples too; see `_timing`."""
    if "limits" not in told:
        return ""
    velocity, acceleration = (
        max(told[f"max_{key}"][joint] / most for joint, most in told["limits"][key].items())
        for key in ("velocity", "acceleration")
    )
    limit = told["limits"]["tool_speed"]
    return (
        f"at most {at_most(100 * velocity, 3)} % of the joints' velocities, "
        f"{at_most(100 * acceleration, 3)} % of their accelerations, "
        f"{at_most(100 * told['max_tool_speed'] / limit, 3)} % of the tool's {limit:g} m/s, "
        "between samples too, as quintics or cubics"
    )


def share_at_speed(trajectory: Trajectory, speed: float) -> float:
    """Share of the tool's path over the surface at the required speed, or hardly less.

    The rest is where the joints' accelerations do not allow it, at stops above all.
    """
    over = trajectory.over
    speeds, time = trajectory.tool_speed[over], trajectory.time[over]
    lengths = 0.5 * (speeds[1:] + speeds[:-1]) * np.diff(time)
    fast = np.minimum(speeds[1:], speeds[:-1]) >= HARDLY_LESS * speed
    return float(lengths[fast].sum() / max(float(lengths.sum()), 1e-300))


def rates_json(
    path: CoveragePath, rates: RateReplay | None, trajectory: Trajectory | None = None
) -> dict[str, Any]:
    """What the replay of rates measured; no key where there was none."""
    if rates is None:
        return {}
    stops = [{"why": stop.why, "cell": list(path.cells.unravel(stop.cell))} for stop in rates.stops]
    found: dict[str, Any] = {"holds": rates.accepted, "why_not": list(rates.faults)}
    if path.task.speed is not None:
        found |= {"speed_m_per_s": path.task.speed, "stops": stops, "waiting_s": rates.waiting}
        if trajectory is not None:
            found["share_at_speed"] = share_at_speed(trajectory, path.task.speed)
    if path.task.min_manipulability is not None:
        found["min_singular_value"] = plain(rates.sigma)
    return {"rates": found}


def rates_words(
    path: CoveragePath, rates: RateReplay | None, trajectory: Trajectory | None = None
) -> str:
    """The same in words; empty where there was none."""
    if rates is None:
        return ""
    parts = list(rates.faults)
    if path.task.speed is not None:
        where = [stop.cell for stop in rates.stops if stop.why == "in place"]
        at = f" at {path.cells.named(list(dict.fromkeys(where)), FEW)}" if where else ""
        corners = len(rates.stops) - len(where)
        able = "inside the joints' velocities all along" if rates.accepted else "not all along"
        parts.insert(
            0,
            f"{path.task.speed:g} m/s {able}; {len(where)} waits in place{at}, {corners} corners",
        )
        if trajectory is not None:
            share = 100.0 * share_at_speed(trajectory, path.task.speed)
            parts.append(f"with accelerations {share:.0f} % of the path at that speed")
    if path.task.min_manipulability is not None and rates.accepted:
        parts.append(f"singular values of at least {path.task.min_manipulability:g}")
    return "; ".join(parts)


def ends_json(ends: Ends | None) -> dict[str, Any]:
    """Entry and exit; no key where there are none."""
    if ends is None:
        return {}
    rows = {"entry": ends.entry.tolist(), "exit": ends.exit.tolist()}
    return {"ends": {"approach_m": ends.approach, "from_home": ends.from_home, **rows}}


def ends_words(ends: Ends | None) -> str:
    """The same in words; empty where there are none."""
    if ends is None:
        return ""
    words = f"in and out along the approach direction, {1e3 * ends.approach:g} mm each"
    return f"{words}, from and to home" if ends.from_home else words
