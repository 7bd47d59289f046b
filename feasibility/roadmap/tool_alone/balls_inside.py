"""Balls inside exact shapes, and points of them: balls of no radius.

A ball that comes too near to something shows that the shape does.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.tool_alone.mesh_insides import ROUNDING, balls_in, face_planes
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

Array = NDArray[np.float64]

MOST = 9  # balls along an axis
AROUND = 12  # balls around a rim
CORNERS = 60  # of a mesh
TOWARDS = (0.25, 0.5, 0.75)  # of the way from the middle to a corner


def balls_inside(shape: object) -> Array:
    """(k, 4) centres and radii, m, of balls inside a shape, in its own frame.

    Args:
        shape: a primitive, or `Triangles`, of which a solid has balls and every mesh some corners.

    Raises:
        TypeError: it is neither.

    Example:
        >>> from robots.urdf import Sphere
        >>> balls_inside(Sphere(0.1)).tolist()
        [[0.0, 0.0, 0.0, 0.1]]
    """
    match shape:
        case Sphere(radius):
            return np.array([[0.0, 0.0, 0.0, radius]])
        case Capsule(radius, length):
            return _on_axis(radius, 0.5 * length)
        case Cylinder(radius, length):
            return _in_cylinder(radius, 0.5 * length)
        case Box(size):
            return _in_box(0.5 * np.array(size))
        case Triangles():
            return _in_mesh(shape)
    raise TypeError(f"no balls are known inside {shape!r:.80}")


def _evenly(half: float, ball: float) -> Array:
    """Places from -half to half for balls of a radius, few where they are large."""
    count = MOST if ball <= 0.0 else min(MOST, 1 + math.ceil(half / ball))
    return half * np.linspace(-1.0, 1.0, count) if half > 0.0 else np.zeros(1)


def _on_axis(radius: float, half: float) -> Array:
    """Balls along z, their centres from -half to half."""
    places = _evenly(half, radius)
    balls = np.zeros((len(places), 4))
    balls[:, 2], balls[:, 3] = places, radius
    return balls


def _rings(lateral: float, ball: float, half: float) -> Array:
    """Balls around z at a distance from it, at the heights -half and half."""
    turn = 2.0 * np.pi * np.arange(AROUND) / AROUND
    within = lateral * (1.0 - 1e-12)  # rounding
    ring = np.column_stack([within * np.cos(turn), within * np.sin(turn)])
    rest = np.ones((AROUND, 1))
    return np.concatenate([np.hstack([ring, z * rest, ball * rest]) for z in (-half, half)])


def _in_cylinder(radius: float, half: float) -> Array:
    """Balls as wide as fits, and smaller ones around the rims, down to points of them."""
    wide = min(radius, half)
    found = [_on_axis(wide, half - wide)]
    count = min(MOST, math.ceil((radius - wide) / wide))
    laterals = (radius - wide) * np.arange(1, count + 1) / max(count, 1)
    found += [_rings(lateral, wide, half - wide) for lateral in laterals.tolist()]
    found += [_rings(radius - ball, ball, half - ball) for ball in (0.25 * wide, 0.0)]
    return np.concatenate(found)


def _in_box(half: Array) -> Array:
    """Balls as wide as fits, and smaller ones in the corners, down to the corners."""
    wide = float(half.min())
    grid = np.meshgrid(*(_evenly(side - wide, wide) for side in half.tolist()))
    places = np.stack(grid, axis=-1).reshape(-1, 3)
    found = [np.column_stack([places, np.full(len(places), wide)])]
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T
    for ball in (0.25 * wide, 0.0):
        found.append(np.column_stack([signs * (half - ball), np.full(8, ball)]))
    return np.concatenate(found)


def corners_of(mesh: Triangles) -> Array:
    """(k, 4) balls of no radius at corners that are far from each other."""
    corners = mesh.vertices[np.unique(mesh.faces)]
    chosen = [int(np.linalg.norm(corners - corners.mean(axis=0), axis=1).argmax())]
    away = np.linalg.norm(corners - corners[chosen[0]], axis=1)
    while len(chosen) < min(CORNERS, len(corners)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(corners - corners[chosen[-1]], axis=1))
    return np.column_stack([corners[chosen], np.zeros(len(chosen))])


def is_convex(shape: object) -> bool:
    """Is it a convex solid?"""
    return not isinstance(shape, Triangles) or face_planes(shape) is not None


def _in_mesh(mesh: Triangles) -> Array:
    """Balls in a solid, and corners that are far from each other."""
    points, planes = corners_of(mesh), face_planes(mesh)
    if planes is None:
        return np.concatenate([balls_in(mesh), points])
    # From the middle of a convex body towards its corners.
    middle = mesh.vertices[np.unique(mesh.faces)].mean(axis=0)
    ways = points[:, :3] - middle
    inner = np.concatenate([middle[None], *(middle + share * ways for share in TOWARDS)])
    radii = (planes[:, 3] - inner @ planes[:, :3].T).min(axis=1) - ROUNDING
    some = radii > 0.0
    return np.concatenate([np.column_stack([inner[some], radii[some]]), points])
