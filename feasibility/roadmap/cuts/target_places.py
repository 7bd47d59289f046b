"""The target surface as branch and bound reads it: part by part, fine enough for the task."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, unit_along
from feasibility.roadmap.branch_and_bound.boxes import toward_middle
from feasibility.roadmap.branch_and_bound.branching import PlaceParts
from feasibility.targets.target_parts import target_parts
from feasibility.task import Task
from surfaces.parts import SurfaceParts
from surfaces.surface import Surface

FLAT = 0.5  # [1] of the tolerance: largest radius of target points on the finest parts
STRAIGHT = 0.1  # [1] of the cone chord: the same of approach directions
STRAIGHTEST = 1e-3  # [1] whatever the cone
MOST_PARTS = 4096
LEAST = 0.05  # [1] sine of the reference's angle to the approach below which roll is left out
ROUNDING = 1e-12  # [1]


def places_on(surface: Surface, task: Task) -> PlaceParts:
    """The places that the tool may be at over a surface.

    What is proved holds for the surface itself; how fine the parts are only decides what can be.
    """
    chord = min(task.cone_chord, 2.0)
    parts = target_parts(
        surface,
        task.standoff,
        flat=FLAT * task.effective_tolerance,
        straight=max(STRAIGHT * chord, STRAIGHTEST),
        most=MOST_PARTS,
        approach=None if isinstance(task.approach, str) else task.approach,
    )
    toward, change, radius = _toward(surface, task, parts)
    return PlaceParts(
        centre=np.hstack([parts.centre, toward]),
        slopes=np.concatenate([parts.slopes, change], axis=2),
        radius=np.column_stack([parts.radius, radius]),
        children=np.array(parts.children),
        axis=np.array(parts.axis),
    )


def _toward(surface: Surface, task: Task, parts: SurfaceParts) -> tuple[Array, Array, Array]:
    """Where the tool's reference axis is to point on each part: centre, slopes and radius.

    With one reference r all over the surface: t = P r / |P r|, P = 1 - b b^T. Along a unit b whose
    derivatives are at most v and w the frame of t and b turns by at most v / h, and that changes by
    at most w / h + (v / h)^2, h the least |P r|; so t is within (w / h + 2 (v / h)^2) / 2 of its
    linear model, where b follows its own, b0 + g_1 x_1 + g_2 x_2 made a unit vector: v <= (|g_1| +
    |g_2|) / m and w <= 2 v^2, m its least length. Where b is off that, t is by 1 / h as much.
    The frame turns with b x b' about axes across b, and with -(r.b)(b'.s) / h, s = b x t, about b.

    The radius is inf where roll is free, where its reference is the u direction, and where h is
    small: nothing is known there.
    """
    count = len(parts.centre)
    nothing = np.zeros((count, 3)), np.zeros((count, 2, 3)), np.full(count, np.inf)
    if task.roll is None or task.roll_reference is None:
        return nothing
    r = surface.rotation @ unit_along(task.roll_reference)
    length = np.linalg.norm(parts.centre[:, 3:], axis=1)
    turns = np.linalg.norm(parts.slopes[..., 3:], axis=2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        b = parts.centre[:, 3:] / length[:, None]
        # Of the chord between two lengths of the model of b, each within its radius of 1.
        ends = np.minimum(length, 1.0 - parts.radius[:, 1])
        speed = turns / np.sqrt(np.maximum(ends**2 - 0.25 * turns**2, 0.0))
        # b is within its radius of the model, and so is the model of a unit vector.
        deviation = 2.2 * parts.radius[:, 1] + ROUNDING
        away = np.minimum(np.abs(b @ r) + speed + deviation, 1.0)
        h = np.sqrt(1.0 - away * away)
        along = (b @ r)[:, None]
        t = (r - along * b) / np.sqrt(1.0 - along * along)
        s = np.cross(b, t)
        g = parts.slopes[..., 3:] / length[:, None, None]
        g -= (g * b[:, None]).sum(axis=2, keepdims=True) * b[:, None]
        about = -(along / np.sqrt(1.0 - along * along))[:, None] * (g * s[:, None]).sum(
            axis=2, keepdims=True
        )
        rates = np.cross(b[:, None], g) + about * b[:, None]
        middle = toward_middle(b, t, task.roll.middle)
        change = np.cross(rates, middle[:, None])
        radius = speed**2 / h + (speed / h) ** 2 + deviation / h
    known = (ends > 0.5) & (speed < 1.0) & (h > LEAST) & (deviation < 0.5)
    return (
        np.where(known[:, None], middle, 0.0),
        np.where(known[:, None, None], change, 0.0),
        np.where(known, radius, np.inf),
    )
