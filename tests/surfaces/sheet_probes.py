"""How far the places of random surfaces are from their sheets, by trying all triangles."""

import numpy as np
from part_walks import size_of, spread
from random_surfaces import random_surface

from surfaces import sheet_of


def distances(points, triangles):
    """(k,) m from points (k, 3) to the nearest of triangles (m, 3, 3), by trying all.

    The nearest of a triangle's three sides; and its plane, over its inside.
    """
    best = np.full(len(points), np.inf)
    at = points[:, None]
    for i in range(3):
        start, along = triangles[:, i], triangles[:, i - 2] - triangles[:, i]
        square = np.maximum((along**2).sum(axis=1), 1e-300)
        share = np.clip(((at - start) * along).sum(axis=2) / square, 0.0, 1.0)
        off = np.linalg.norm(at - start - share[..., None] * along, axis=2)
        best = np.minimum(best, off.min(axis=1))
    one, two = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    flat = np.linalg.pinv(np.stack([one, two], axis=2))
    share = np.einsum("mcd,kmd->kmc", flat, at - triangles[:, 0])
    above = at - triangles[:, 0] - share[..., :1] * one - share[..., 1:] * two
    inside = (share >= 0.0).all(axis=2) & (share.sum(axis=2) <= 1.0)
    height = np.where(inside, np.linalg.norm(above, axis=2), np.inf)
    return np.minimum(best, height.min(axis=1))


def places(surface, rng, count):
    """Points and outward normals all over a surface, on its borders and corners too."""
    if surface.kind == "mesh":
        face = rng.integers(len(surface.mesh.faces), size=count)
        weights = rng.dirichlet([0.5, 0.5, 0.5], count)
        turned = surface.mesh.face_normals[face] @ surface.rotation.T
        return surface.points_at(face, weights), turned
    pieces, signs = [surface], [1.0]
    if surface.kind == "piecewise":
        pieces, signs = surface.placed, surface.signs
    found = []
    for piece, sign in zip(pieces, signs, strict=True):
        u, v = spread(piece, count, int(rng.integers(2**31)))
        found.append(np.hstack([piece.point(u, v), sign * piece.normal(u, v)]))
    both = np.concatenate(found)
    return both[:, :3], both[:, 3:]


def excess(kind, seed, thick=False, count=60):
    """m by which a place of a random surface is further from its sheet than is stated."""
    rng = np.random.default_rng([seed, int(thick), *map(ord, kind)])
    surface = random_surface(kind, rng)
    size = size_of(surface)
    depth = size * 10.0 ** rng.uniform(-3, 0) if thick else 0.0
    wanted = size * 10.0 ** rng.uniform(-4, -1)
    sheet = sheet_of(surface, wanted, int(rng.integers(2, 600)), depth)
    points, normals = places(surface, rng, count)
    deep = depth * rng.uniform(size=(len(points), 1))
    far = distances(points - surface.side_sign * deep * normals, sheet.triangles).max()
    rounding = 1e-12 * np.abs(sheet.triangles).max()  # thin triangles lose digits in `distances`
    return far - sheet.deviation - rounding
