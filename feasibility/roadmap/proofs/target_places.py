"""The target surface as branch and bound reads it: part by part, fine enough for the task.

f and n of a part follow one model with the same x, so the target point T = f + s d n follows that
of f, shifted by s d times that of n, within r_f + d r_n; and b = -s n that of n.
"""

from functools import lru_cache

import numpy as np

from coverable.arrays import Array, unit_along
from feasibility.roadmap.proofs.boxes import toward_middle
from feasibility.roadmap.proofs.branching import PlaceParts
from feasibility.task import Task
from surfaces.parts import SurfaceParts
from surfaces.surface import Surface

FLAT = 0.5  # [1] of the tolerance: largest radius of target points on the finest parts
STRAIGHT = 0.1  # [1] of the cone chord: the same of approach directions
STRAIGHTEST = 1e-3  # [1] whatever the cone
MOST_PARTS = 4096
LEAST = 0.05  # [1] sine of the reference's angle to the approach below which roll is left out
ROUNDING = 1e-12  # [1]


# A search is often run again; surfaces are values, compared by identity.
@lru_cache(maxsize=4)
def _parts(surface: Surface, standoff: float, flat: float, straight: float) -> SurfaceParts:
    """The parts of a surface, of whose finest target points and directions are no further off."""
    bent = min(straight, flat / (2.0 * standoff)) if standoff > 0.0 else straight
    return surface.parts(flat - standoff * bent, bent, MOST_PARTS)


def places_on(surface: Surface, task: Task) -> PlaceParts:
    """The places that the tool may be at over a surface.

    What is proved holds for the surface itself; how fine the parts are only decides what can be.
    """
    straight = max(STRAIGHT * min(task.cone_chord, 2.0), STRAIGHTEST)
    found = _parts(surface, task.standoff, FLAT * task.effective_tolerance, straight)
    centre, slopes, radius = found.centre.copy(), found.slopes.copy(), found.radius.copy()
    for array in (centre, slopes):
        array[..., :3] += surface.side_sign * task.standoff * array[..., 3:]
        array[..., 3:] *= -surface.side_sign
    radius[:, 0] += task.standoff * radius[:, 1]
    if task.approach is not None and not isinstance(task.approach, str):
        centre[..., 3:] = surface.rotation @ unit_along(task.approach)
        slopes[..., 3:] = radius[:, 1] = 0.0
    toward, change, off = _toward(surface, task, centre, slopes, radius[:, 1])
    return PlaceParts(
        centre=np.hstack([centre, toward]),
        slopes=np.concatenate([slopes, change], axis=2),
        radius=np.column_stack([radius, off]),
        children=np.array(found.children),
        axis=np.array(found.axis),
    )


def _toward(
    surface: Surface, task: Task, centre: Array, slopes: Array, off: Array
) -> tuple[Array, Array, Array]:
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
    count = len(centre)
    nothing = np.zeros((count, 3)), np.zeros((count, 2, 3)), np.full(count, np.inf)
    if task.roll is None or task.roll_reference is None:
        return nothing
    r = surface.rotation @ unit_along(task.roll_reference)
    length = np.linalg.norm(centre[:, 3:], axis=1)
    turns = np.linalg.norm(slopes[..., 3:], axis=2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        b = centre[:, 3:] / length[:, None]
        # Of the chord between two lengths of the model of b, each within its radius of 1.
        ends = np.minimum(length, 1.0 - off)
        speed = turns / np.sqrt(np.maximum(ends**2 - 0.25 * turns**2, 0.0))
        # b is within its radius of the model, and so is the model of a unit vector.
        deviation = 2.2 * off + ROUNDING
        away = np.minimum(np.abs(b @ r) + speed + deviation, 1.0)
        h = np.sqrt(1.0 - away * away)
        along = (b @ r)[:, None]
        t = (r - along * b) / np.sqrt(1.0 - along * along)
        s = np.cross(b, t)
        g = slopes[..., 3:] / length[:, None, None]
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
