"""What is certainly inside a closed mesh: between its faces' planes, or in balls.

An open mesh is a sheet and has no inside.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robots.shapes import Triangles

Array = NDArray[np.float64]

FLUSH = 1e-9  # [1] of the widest side: a vertex may stand out of a face's plane as far
SOLID = 1e-6  # [1] of the widest side cubed: what encloses less is flat
MOST_FACES = 3_000  # of a mesh that balls are laid into
ACROSS = 9  # places along each side of the box around a mesh, where balls may have their centres
BALLS = 40
ROUNDING = 1e-9  # [m] that a ball is smaller than its distance from the faces
CHUNK = 1 << 18  # points times triangles at once


@lru_cache(maxsize=64)
def face_planes(mesh: Triangles) -> Array | None:
    """(k, 4) outward unit normals n and offsets h of the faces of a convex solid, n . x <= h.

    None where the mesh is open, in several pieces, flat, or not convex. The faces of one closed
    piece that all lie in planes with no vertex above are the whole boundary of a convex body, so
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
        if len(kept) == BALLS:
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
        asked = np.repeat(some, len(triangles), axis=0)
        nearest = closest_point(np.tile(triangles, (len(some), 1, 1)), asked)
        away = np.linalg.norm(nearest - asked, axis=1)
        found.append(away.reshape(len(some), -1).min(axis=1))
    return np.concatenate(found) if found else np.empty(0)


def _chunks(points: Array, triangles: int) -> list[Array]:
    """Points in parts that are not too large together with all triangles."""
    return np.array_split(points, 1 + len(points) * triangles // CHUNK) if len(points) else []
