"""Balls inside exact shapes, and points of them: balls of no radius.

A ball that comes too near to something shows that the shape does. Inside a closed mesh is what is
below the planes of all faces of a convex one, or in balls around which the triangles wind; an open
mesh is a sheet and has no inside.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from coverable_arrays import Array
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

MOST = 9  # balls along an axis
AROUND = 12  # balls around a circle
CORNERS = 60  # of a mesh
TOWARDS = (0.25, 0.5, 0.75)  # [1] from the middle to a corner
FLUSH = 1e-9  # [1] of the widest side: a vertex may be above a face's plane by as much
SOLID = 1e-6  # [1] of the widest side cubed: what encloses less is flat
MOST_FACES = 3_000  # of a mesh that balls are placed in
ACROSS = 9  # places along each side of the box around a mesh, where balls may have their centres
MESH_BALLS = 40
ROUNDING = 1e-9  # [m] that a ball is smaller than its distance from the faces
CHUNK = 1 << 18  # points times triangles at once


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
    """Balls as wide as fits, and smaller ones around its ends, down to points of their circles."""
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
    away = points[:, :3] - middle
    inner = np.concatenate([middle[None], *(middle + share * away for share in TOWARDS)])
    radii = (planes[:, 3] - inner @ planes[:, :3].T).min(axis=1) - ROUNDING
    some = radii > 0.0
    return np.concatenate([np.column_stack([inner[some], radii[some]]), points])


@lru_cache(maxsize=64)
def face_planes(mesh: Triangles) -> Array | None:
    """(k, 4) outward unit normals n and offsets h of the faces of a convex solid, n . x <= h.

    None where the mesh is open, in several pieces, flat, or not convex. The faces of one closed
    piece that all lie in planes with no vertex above are all of the boundary of a convex body, so
    what is below all of the planes is inside.
    """
    used = np.unique(mesh.faces)
    # Euler's formula: one piece without handles has 2 vertices more than half its faces.
    if not mesh.closed or 2 * len(used) != len(mesh.faces) + 4 or len(used) > MOST_FACES:
        return None
    corners, points = mesh.vertices[mesh.faces], mesh.vertices[used]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    some = areas > 0.0
    normals = across[some] / areas[some, None]
    ahead = np.einsum("ki,ki->k", normals, corners[some, 0] - points.mean(axis=0))
    normals *= np.where(ahead < 0.0, -1.0, 1.0)[:, None]
    offsets = np.einsum("ki,ki->k", normals, corners[some, 0])
    wide = float(np.ptp(points, axis=0).max())
    enclosed = float(np.abs(ahead) @ areas[some]) / 6.0
    highest = max(float((points @ n).max() - h) for n, h in zip(normals, offsets, strict=True))
    if highest > FLUSH * wide or not enclosed > SOLID * wide**3:
        return None
    return np.column_stack([normals, offsets])


@lru_cache(maxsize=64)
def balls_in(mesh: Triangles) -> Array:
    """(k, 4) centres and radii, m, of balls inside a closed mesh, the largest first; k may be 0.

    A point is inside where the triangles wind around it. A ball about it reaches to the nearest
    triangle, so no boundary is within.
    """
    if not mesh.closed or len(mesh.faces) > MOST_FACES:
        return np.empty((0, 4))
    triangles = mesh.vertices[mesh.faces]
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    shares = (np.arange(ACROSS) + 0.5) / ACROSS
    grid = np.stack(np.meshgrid(shares, shares, shares), axis=-1).reshape(-1, 3)
    centres = low + grid * (high - low)
    centres = centres[np.abs(_windings(triangles, centres)) > 0.5]
    radii = _distances(triangles, centres) - ROUNDING
    kept: list[int] = []
    for k in np.argsort(-radii, kind="stable").tolist():
        away = np.linalg.norm(centres[kept] - centres[k], axis=1)
        if radii[k] > 0.0 and not (away < 0.5 * radii[kept]).any():
            kept.append(k)
        if len(kept) == MESH_BALLS:
            break
    return np.column_stack([centres[kept], radii[kept]])


def _windings(triangles: Array, points: Array) -> Array:
    """(k,) how often triangles (m, 3, 3) wind around points (k, 3): their solid angles over 4 pi.

    Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983), eq. (8).
    """
    found = []
    for some in _chunks(points, len(triangles)):
        a, b, c = (triangles[None, :, k] - some[:, None] for k in range(3))
        x, y, z = (np.linalg.norm(side, axis=2) for side in (a, b, c))
        above = np.einsum("kmi,kmi->km", a, np.cross(b, c))
        below = x * y * z + z * (a * b).sum(2) + x * (b * c).sum(2) + y * (c * a).sum(2)
        found.append(np.arctan2(above, below).sum(axis=1) / (2.0 * np.pi))
    return np.concatenate(found) if found else np.empty(0)


def _distances(triangles: Array, points: Array) -> Array:
    """(k,) m, distances of points (k, 3) from the nearest of triangles (m, 3, 3)."""
    from trimesh.triangles import closest_point

    found = []
    for some in _chunks(points, len(triangles)):
        queries = np.repeat(some, len(triangles), axis=0)
        nearest = closest_point(np.tile(triangles, (len(some), 1, 1)), queries)
        away = np.linalg.norm(nearest - queries, axis=1)
        found.append(away.reshape(len(some), -1).min(axis=1))
    return np.concatenate(found) if found else np.empty(0)


def _chunks(points: Array, triangles: int) -> list[Array]:
    """Points in parts that are not too large together with all triangles."""
    return np.array_split(points, 1 + len(points) * triangles // CHUNK) if len(points) else []
