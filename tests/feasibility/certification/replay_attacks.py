"""Random motions over smooth surfaces, and what dense samples say of them.

Rows of a raster are taken out, moved, tilted and joined in other ways, and the tolerance is chosen
near to what dense samples show, just above or just below. The samples know nothing of places and
paths: they compare the tool with the surface's closest points; on a mesh with those of a reader
that shares nothing with `surfaces`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from rasters import raster
from test_mesh_witness import SETTLED, Reader

from feasibility.certification import replay_over_surface
from robots import Kinematics

SURFACES = ("plane", "ball", "pipe", "ring", "spline", "mesh")
DENSE = 60  # samples a segment
ROWS = 24
BESIDE = 1.0  # rad/m: how much the normal may turn between them, for each metre off


class Attack(NamedTuple):
    name: str
    seed: int
    accepted: bool
    wrong: bool
    """Dense samples leave tolerance or cone."""
    inside: bool
    """Dense samples keep well inside both, over places that move steadily."""
    refusal: str


def attacked(name, seed):
    """One random motion, judged and sampled."""
    made, rng = raster(name), np.random.default_rng([seed, len(name)])
    q = chosen(made.q, rng)
    q = q + rng.normal(size=q.shape) * 10.0 ** rng.uniform(-7, -3)
    off, tilt, steady = sampled(made, q)
    factor = rng.choice([0.9, 0.99, 0.9999, 1.0001, 1.01, 1.1, 1.5])
    cone = 20.0 if rng.random() < 0.5 else float(np.degrees(tilt * rng.choice([0.99, 1.01, 1.3])))
    task = replace(made.task, tolerance=max(off * factor, 1e-9), cone_deg=min(max(cone, 1e-6), 180))
    nobody = np.zeros(len(made.cells), dtype=bool)
    outcome = replay_over_surface(made.robot, made.cells, task, q, nobody)
    # The cone holds at a place that may lie a little beside the closest point.
    # On a mesh the reader's iteration ends that near to one, so its distance is a little too large.
    unsettled = SETTLED if name == "mesh" else 0.0
    most = task.tolerance * (1.0 + 1e-9) + unsettled
    wrong = off > most or tilt > task.cone + BESIDE * off
    inside = steady and off < 0.99 * task.tolerance and tilt < 0.99 * task.cone
    return Attack(name, seed, outcome.accepted, bool(wrong), bool(inside), outcome.refusal)


def chosen(q, rng):
    """Some rows of a raster: one stretch, or steps of many sizes, or there and back."""
    begin = rng.integers(0, len(q) - ROWS)
    stride = rng.choice([1, 2, 5, 10, 20])
    rows = np.minimum(begin + stride * np.arange(ROWS), len(q) - 1)
    way = rng.integers(0, 3)
    if way == 1:
        rows = np.sort(rng.choice(rows, ROWS // 2, replace=False))
    if way == 2:
        rows = np.concatenate([rows, rows[::-1]])
    return q[rows]


def sampled(made, q):
    """Largest distance off the offset surface (m), largest tilt (rad), and see `Attack.steady`."""
    t = np.arange(DENSE)[:, None] / DENSE
    between = (q[:-1, None] + t * np.diff(q, axis=0)[:, None]).reshape(-1, q.shape[1])
    points, axes = Kinematics(made.robot).tools(np.vstack([between, q[-1:]]))
    surface, task = made.cells.surface, made.task
    if surface.kind == "mesh":
        reader = Reader(surface.mesh.vertices, surface.mesh.faces)
        place, normal = reader.closest_points(points, surface.side_sign * task.standoff)
    else:
        found = surface.closest(points)
        u, v = np.clip(found.u, *surface.u_range), np.clip(found.v, *surface.v_range)
        place, normal = surface.point(u, v), surface.normal(u, v)
    off = np.linalg.norm(points - place - surface.side_sign * task.standoff * normal, axis=1)
    chord = np.linalg.norm(axes + surface.side_sign * normal, axis=1)
    steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
    steady = bool((steps <= 20.0 * np.linalg.norm(np.diff(points, axis=0), axis=1) + 1e-6).all())
    return float(off.max()), float(2 * np.arcsin(np.minimum(0.5 * chord, 1.0)).max()), steady
