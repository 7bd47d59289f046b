"""Distances on surfaces that can be unrolled, or are round, in closed form; a panel with a hole."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import Delaunay

from surfaces import cylinder, mesh, plane, sphere
from surfaces.meshes import TriangleMesh
from surfaces.passes import Pass, Passes

PLATE = plane((0.0, 0.6), (0.0, 0.4), position=(0.3, -0.2, 0.5), rpy_deg=(20, -35, 50))
ARCH = cylinder(0.3, (10, 100), (0.0, 0.5), position=(0.1, 0.2, 0.3), rpy_deg=(15, 25, 35))
CAP = sphere(0.4, (60, 120), (-35, 35), rpy_deg=(5, 10, 15))
RADIUS = {"arch": 0.3, "cap": 0.4}


def unrolled(name: str, points: np.ndarray) -> np.ndarray:
    """Points (k, 3) on PLATE or ARCH, laid flat; on CAP as they are, from its centre."""
    surface = {"plate": PLATE, "arch": ARCH, "cap": CAP}[name]
    own = (points - surface.position) @ surface.rotation
    if name == "arch":
        return np.column_stack([0.3 * np.arctan2(own[:, 1], own[:, 0]), own[:, 2]])
    return own


def away(name: str, points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(k,) m on the surface, from points (k, 3) to the nearest place of a line (m, 3)."""
    a, b = unrolled(name, points), unrolled(name, line)
    if name == "cap":  # great circles to the line's many points
        chords = np.linalg.norm(a[:, None] - b[None], axis=2).min(axis=1)
        return 2.0 * 0.4 * np.arcsin(0.5 * chords / 0.4)
    start, piece = b[:-1], np.diff(b, axis=0)
    share = ((a[:, None] - start) * piece).sum(axis=2) / (piece**2).sum(axis=1)
    nearest = start + np.clip(share, 0.0, 1.0)[:, :, None] * piece
    return np.linalg.norm(a[:, None] - nearest, axis=2).min(axis=1)


def by_level(found: Passes) -> dict[int, list[Pass]]:
    """The stretches of each pass."""
    levels: dict[int, list[Pass]] = {}
    for each in found.stretches:
        levels.setdefault(each.level, []).append(each)
    return levels


def panel_with_hole(edge: float = 0.01):
    """0.6 x 0.4 m with a hole of 80 mm radius in its middle, as irregular triangles."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(0.0, 0.6 + edge / 2, edge), np.arange(0.0, 0.4 + edge / 2, edge))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 1e-9) & (points < [0.6 - 1e-9, 0.4 - 1e-9])).all(axis=1)
    points[inner] += rng.uniform(-0.2, 0.2, (int(inner.sum()), 2)) * edge
    off = np.linalg.norm(points - [0.3, 0.2], axis=1)
    angle = np.linspace(0.0, math.tau, 64, endpoint=False)
    rim = np.array([0.3, 0.2]) + 0.08 * np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([points[off > 0.08 + 0.4 * edge], rim])
    faces = Delaunay(points).simplices
    middle = points[faces].mean(axis=1)
    faces = faces[np.linalg.norm(middle - [0.3, 0.2], axis=1) > 0.0799]
    return mesh(TriangleMesh(np.column_stack([points, np.zeros(len(points))]), faces))
