"""A coverage path and its timing as one JSON object, and as text for people."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np

from feasibility.coverage import CoveragePath
from feasibility.path_figures import PathFigures
from feasibility.result import plain
from feasibility.speed_limits import MotionLimits
from feasibility.trajectory import Trajectory
from feasibility.version import version

WIDTH = 100  # columns


def as_json(
    path: CoveragePath, trajectory: Trajectory | None = None, limits: MotionLimits | None = None
) -> dict[str, Any]:
    """The object that `coverable path --json` prints, without NaN.

    Units stand in the keys; velocities and accelerations are in rad or m, and seconds.

    Args:
        path: the path.
        trajectory: its timing, if it was asked for.
        limits: what the timing keeps to.
    """
    figures = path.figures
    sliding = path.robot.prismatic
    return {
        "order": path.order,
        "cells": int(path.needed.sum()),
        "visits": path.visits.tolist(),
        "length_m": figures.length,
        "covered_m": figures.covered,
        "revisited_m": figures.revisited,
        "revisited_share": figures.revisited_share,
        "least_length_m": figures.least_length,
        "length_ratio": plain(figures.ratio),
        "joint_travel": {
            name: {"travel_m": float(way)} if slides else {"travel_deg": math.degrees(way)}
            for name, way, slides in zip(
                path.robot.joint_names, figures.travel.tolist(), sliding.tolist(), strict=True
            )
        },
        "margins": {
            "limit_deg": plain(math.degrees(figures.turn_margin)),
            "limit_m": plain(figures.slide_margin),
            "cone_deg": plain(math.degrees(figures.cone_margin)),
            "singular_value": plain(figures.singular_value),
        },
        "certificate": {
            "waypoints": int(path.certificate.waypoints),
            "max_position_error_m": plain(float(path.certificate.max_position_error)),
            "max_angle_deg": plain(math.degrees(path.certificate.max_angle)),
        },
        "trajectory": None if trajectory is None else _timing(path, trajectory, limits),
        "robot": path.robot.name,
        "version": version(),
    }


def _timing(
    path: CoveragePath, trajectory: Trajectory, limits: MotionLimits | None
) -> dict[str, Any]:
    """Duration and the largest of everything, with the limits where they are known."""
    names = path.robot.joint_names
    fastest = np.abs(trajectory.dq).max(axis=0).tolist()
    quickest = np.abs(trajectory.ddq).max(axis=0).tolist()
    found: dict[str, Any] = {
        "duration_s": trajectory.duration,
        "samples": len(trajectory),
        "tool_way_m": trajectory.tool_way,
        "max_tool_speed": float(trajectory.tool_speed.max()),
        "max_velocity": dict(zip(names, fastest, strict=True)),
        "max_acceleration": dict(zip(names, quickest, strict=True)),
    }
    if limits is not None:
        found["limits"] = {
            "tool_speed": limits.tool_speed,
            "velocity": dict(zip(names, limits.velocity.tolist(), strict=True)),
            "acceleration": dict(zip(names, limits.acceleration.tolist(), strict=True)),
        }
    return found


def as_text(
    path: CoveragePath, trajectory: Trajectory | None = None, limits: MotionLimits | None = None
) -> str:
    """The path for people: how long it is and what it is compared with, margins, and times.

    Args:
        path: the path.
        trajectory: its timing, if it was asked for.
        limits: what the timing keeps to.
    """
    count, figures = int(path.needed.sum()), path.figures
    rows = [
        ("order", f"{path.order}, {count:,} cells, {len(path.visits):,} centres passed"),
        ("length", _length_text(figures)),
        ("joint travel", _travel_text(path)),
        ("margins", _margins_text(figures)),
        (
            "certificate",
            f"{path.certificate.waypoints:,} waypoints replayed, between them too: tool within "
            f"{1e3 * path.certificate.max_position_error:.3g} mm, axis within "
            f"{math.degrees(path.certificate.max_angle):.4g} deg",
        ),
    ]
    if trajectory is not None:
        rows.append(
            (
                "time",
                f"{trajectory.duration:.4g} s in {len(trajectory):,} samples, tool at up to "
                f"{trajectory.tool_speed.max():.4g} m/s",
            )
        )
        rows += _limit_rows(trajectory, limits)
    head = f"path: one continuous motion over {count:,} cell{'s' if count > 1 else ''}."
    return "\n".join([head, "", *(_row(name, text) for name, text in rows)])


def _row(name: str, text: str) -> str:
    """A named line; the rest of a long one is indented below."""
    return textwrap.fill(
        text, WIDTH, initial_indent=f"  {name:<14}", subsequent_indent=" " * 16,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def _length_text(figures: PathFigures) -> str:
    """Length, what is gone over again, and the least there could be."""
    text = f"{figures.length:.4g} m on the surface"
    if figures.revisited > 0.0:
        share = f"{100 * figures.revisited_share:.2g} % of the rest"
        text += f", {figures.revisited:.3g} m of it again ({share})"
    if figures.least_length > 0.0:
        text += (
            f"; no path through all centres is shorter than {figures.least_length:.4g} m "
            f"(ratio {figures.ratio:.3f})"
        )
    return text


def _travel_text(path: CoveragePath) -> str:
    """How far each joint travels."""
    parts = []
    for name, way, slides in zip(
        path.robot.joint_names, path.figures.travel, path.robot.prismatic, strict=True
    ):
        parts.append(f"{name} {way:.3g} m" if slides else f"{name} {math.degrees(way):.0f} deg")
    return ", ".join(parts)


def _margins_text(figures: PathFigures) -> str:
    """What the path keeps free."""
    parts = []
    if math.isfinite(figures.turn_margin):
        parts.append(f"{math.degrees(figures.turn_margin):.3g} deg to a limit")
    if math.isfinite(figures.slide_margin):
        parts.append(f"{1e3 * figures.slide_margin:.3g} mm to a limit")
    parts.append(f"{math.degrees(figures.cone_margin):.3g} deg of the cone")
    parts.append(f"smallest singular value {figures.singular_value:.3g}")
    return ", ".join(parts)


def _limit_rows(trajectory: Trajectory, limits: MotionLimits | None) -> list[tuple[str, str]]:
    """How much of its limits a trajectory uses."""
    if limits is None:
        return []
    velocity = float((np.abs(trajectory.dq) / limits.velocity).max())
    acceleration = float((np.abs(trajectory.ddq) / limits.acceleration).max())
    return [
        (
            "limits",
            f"at most {100 * velocity:.3g} % of the joints' velocities, "
            f"{100 * acceleration:.3g} % of their accelerations, "
            f"{100 * float(trajectory.tool_speed.max()) / limits.tool_speed:.3g} % of the tool's "
            f"{limits.tool_speed:g} m/s",
        )
    ]
