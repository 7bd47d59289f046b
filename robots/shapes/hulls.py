"""Convex bodies around a shape, with few vertices.

A distance query costs as much as the bodies have vertices, so a hull of many is thinned: some of
its vertices are kept, and the radius around them reaches all others. Nothing of the shape is ever
left outside.

A mesh whose hull is crude, cut into slabs by parallel planes, each in a hull of its own.

The part of a solid between two parallel planes lies in the hull of its surface between them: what
is extreme in it and not on its surface would be inside the solid and extreme in a slab, which has
no corners. So the hulls of the clipped surface hold the solid, and no cap has to be made.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from coverable.arrays import Array
from robots.errors import RobotError
from robots.shapes.bodies import Geometry, HalfSpace, Outline, Triangles, outline
from robots.urdf.link_shapes import Cylinder

KEPT = 256  # shapes whose hulls are kept
MOST_VERTICES = 64
CLOSE_ENOUGH = 1e-4  # [m]: no vertex is added for less
HALF_THICKNESS = 1e-5  # [m] a body without thickness is given this much to each side
ROUNDING = 1e-12  # of a body's width: what hull and distances may be wrong by
PRISM_EXCESS = 3e-4  # [m] the corners of a prism around a cylinder stand out by at most this ...
CHUNK = 256  # points whose distances from all facets are taken at a time
MOST_SIDES = 32  # ... where so many sides are enough
ROUNDED = 1e-9  # [1] of a hull's volume: what a convex body may miss of it by rounding


@lru_cache(maxsize=KEPT)
def hull_of(shape: Geometry) -> Outline:
    """A convex body that holds a shape, without circles; exact for balls, capsules and boxes.

    A cylinder becomes a prism around it.

    Raises:
        RobotError: it is a half space.
    """
    match shape:
        case Cylinder(radius, length):
            # A corner is at radius / cos(pi / k).
            sides = math.ceil(math.pi / math.acos(radius / (radius + PRISM_EXCESS)))
            sides = min(max(sides, 8), MOST_SIDES)
            return Outline(rims(radius / math.cos(math.pi / sides), length, sides), 0.0)
        case Triangles():
            return outer_hull(shape.vertices)
        case HalfSpace():
            raise RobotError("a half space has no end")
        case _:
            return outline(shape)


def rims(radius: float, length: float, count: int) -> Array:
    """(2 count, 3) points on the two rims of a cylinder along z."""
    angle = 2.0 * np.pi * np.arange(count) / count
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = [np.column_stack([ring, np.full(count, z)]) for z in (-length / 2, length / 2)]
    return np.concatenate(ends)


def outer_hull(points: Array) -> Outline:
    """A convex body of at most `MOST_VERTICES` that holds some points (k, 3) m, k >= 1.

    Where the hull has more vertices, the one furthest outside is added to those kept until there
    are enough, or none is further outside than `CLOSE_ENOUGH`; the radius is then an upper bound on
    the distance of any point from the hull of those kept. Flat points are first given a thickness
    of `HALF_THICKNESS` to each side, which Qhull needs.
    """
    from scipy.spatial import ConvexHull, QhullError

    solid = thickened(points)
    try:
        corners = solid[ConvexHull(solid).vertices]
        kept = corners if len(corners) <= MOST_VERTICES else _furthest(corners)
        radius = _reach_outside(ConvexHull(kept), corners)
    except QhullError:  # no file is known that comes here
        low, high = solid.min(axis=0), solid.max(axis=0)
        kept = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
        radius = 0.0
    return Outline(kept, radius + ROUNDING * float(np.ptp(solid, axis=0).max()))


def hull_volume(points: Array) -> float:
    """m^3; 0 for points that span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 4:
        return 0.0
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0


def is_convex(mesh: Triangles, allowed: float = ROUNDED) -> bool:
    """Do triangles bound a solid, in one piece, that fills all of its convex hull but a share?

    One piece without handles has 2 vertices more than half its faces (Euler).
    """
    vertices, faces = mesh.vertices, mesh.faces
    if not mesh.closed or 2 * len(vertices) != len(faces) + 4:
        return False
    a, b, c = (vertices[faces[:, k]] - vertices[0] for k in range(3))
    volume = float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6.0
    return abs(volume) >= (1.0 - allowed) * hull_volume(vertices) > 0.0


def thickened(points: Array) -> Array:
    """The points, moved to both sides along each direction in which they have no extent."""
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred.T @ centred)[0].T  # rows
    for axis in axes:
        if np.ptp(points @ axis) < HALF_THICKNESS:
            step = HALF_THICKNESS * axis
            points = np.concatenate([points + step, points - step])
    return points


def _furthest(corners: Array) -> Array:
    """At most `MOST_VERTICES` of the corners, one by one: the one furthest outside those before."""
    from scipy.spatial import ConvexHull

    signs = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)])
    axes = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[2]
    directions = signs[np.abs(signs).sum(axis=1) % 2 == 1] @ axes  # 6 faces and 8 corners of a box
    chosen = np.unique((corners @ directions.T).argmax(axis=0))
    hull = ConvexHull(corners[chosen])
    left = np.arange(len(corners))
    while len(chosen) < MOST_VERTICES:
        outside = (corners[left] @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        if outside.max() < CLOSE_ENOUGH:
            break
        chosen = np.append(chosen, left[outside.argmax()])
        left = left[outside >= CLOSE_ENOUGH]  # the others stay inside: the hull only grows
        hull = ConvexHull(corners[chosen])
    return np.asarray(corners[chosen])


def _reach_outside(hull: Any, points: Array) -> float:
    """m, an upper bound on the distance of any of the points from a hull of `scipy.spatial`.

    A point is projected onto the planes of facets, and moved into each facet by clipping its
    barycentric coordinates: the nearest of these places is in the hull.
    """
    heights = (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    if not (heights > 0.0).any():
        return 0.0
    corners = hull.points[hull.simplices]  # (f, 3, 3)
    inverse = np.linalg.pinv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))  # (f, 2, 3)

    def gaps(some: Array) -> Array:
        shares = np.einsum("fij,nfj->nfi", inverse, some[:, None] - corners[:, 0])
        first = 1.0 - shares.sum(axis=2, keepdims=True)
        weights = np.concatenate([first, shares], axis=2).clip(0.0)
        weights /= weights.sum(axis=2, keepdims=True)
        places = np.einsum("nfi,fij->nfj", weights, corners)
        return np.asarray(np.linalg.norm(places - some[:, None], axis=2).min(axis=1))

    outside = points[heights > 0.0]
    chunks = np.split(outside, range(CHUNK, len(outside), CHUNK))
    return max(float(heights.max()), *(float(gaps(some).max()) for some in chunks))


BINS = 16  # planes may lie between any two of them
WORTH = 0.04  # of the volume of the whole hull: what one more piece has to save
SAMPLES = 600  # points on the surface, by which planes are chosen


@lru_cache(maxsize=KEPT)
def pieces_of(mesh: Geometry) -> tuple[Outline, ...]:
    """Convex bodies that together hold a shape; one where more would not be much smaller."""
    if not isinstance(mesh, Triangles) or is_convex(mesh, WORTH):
        return (hull_of(mesh),)
    points = _on_surface(mesh)
    cuts = [_best_cut(points[:, axis], points) for axis in range(3)]
    axis = min(range(3), key=lambda k: cuts[k][0])
    planes = cuts[axis][1]
    if not planes:
        return (hull_of(mesh),)
    slabs = (_clipped(mesh, axis, *pair) for pair in pairwise([-np.inf, *planes, np.inf]))
    return tuple(outer_hull(slab) for slab in slabs if len(slab))


def _on_surface(mesh: Triangles) -> Array:
    """Points spread evenly over the surface, the same ones each time, and the hull's vertices."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    face = np.searchsorted(np.cumsum(areas), rng.random(SAMPLES) * areas.sum())
    face = np.minimum(face, len(areas) - 1)
    s, t = rng.random((2, SAMPLES, 1))
    s, t = np.where(s + t > 1.0, (1.0 - s, 1.0 - t), (s, t))
    inside = a[face] + s * (b - a)[face] + t * (c - a)[face]
    return np.concatenate([inside, hull_of(mesh).vertices])


def _best_cut(along: Array, points: Array) -> tuple[float, list[float]]:
    """The slabs of least volume, as many as are worth it: m^3 of their hulls, and planes between.

    Planes lie between bins of even width; with v(i, j) the volume of the hull of bins i .. j - 1,
    and w what a slab has to save, the least volume of slabs over the first j bins, and w for each,
    is min over i of best(i) + v(i, j) + w. Planes rise along that coordinate (k,) of the points.
    """
    whole = hull_volume(points)
    borders = np.linspace(along.min(), along.max(), BINS + 1)
    if not whole > 0.0 or not borders[-1] > borders[0]:
        return whole, []
    best, planes = [0.0], [list[float]()]
    for j in range(1, BINS + 1):
        slabs = (points[(along >= low) & (along <= borders[j])] for low in borders[:j])
        totals = np.add(best, [hull_volume(slab) + WORTH * whole for slab in slabs])
        i = int(totals.argmin())
        best.append(float(totals[i]))
        planes.append([*planes[i], float(borders[i])] if i else [])
    return best[-1] - WORTH * whole * (len(planes[-1]) + 1), planes[-1]


def _clipped(mesh: Triangles, axis: int, low: float, high: float) -> Array:
    """(k, 3) m, the corners of all triangles, each clipped to low .. high along the axis."""
    along = mesh.vertices[:, axis]
    inside = np.zeros(len(along), dtype=bool)
    inside[mesh.faces] = True
    found = [mesh.vertices[inside & (along >= low) & (along <= high)]]
    edges = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    first, second = along[edges].T
    for plane in (low, high):
        crossing = (first < plane) != (second < plane)
        if np.isfinite(plane) and crossing.any():
            a, b = (mesh.vertices[edges[crossing, k]] for k in range(2))
            share = (plane - a[:, axis]) / (b[:, axis] - a[:, axis])
            places = a + share[:, None] * (b - a)
            places[:, axis] = plane
            found.append(places)
    return np.concatenate(found)
