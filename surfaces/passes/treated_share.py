"""The share of a surface that a tool treats which runs along a path: a bracket of two areas.

Treated is what lies within half a footprint r of the path (a ball about each of its places), on
that side of the surface, and connected with the path within the ball. For a triangle with longest
edge e and the distances f of its corners from the path, with s between points of the path,

    f(x) >= interpolated f - e^2 / (6 d) - s^2 / (8 r),   d >= r - e the distance there,

because the distance is semiconcave, with Jung's theorem on the circle about a triangle; and the
distance from any one segment of the path is convex, so it lies below its own interpolation. Areas
of triangles in which a linear function is at most r are closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected
from surfaces.adjacency import components
from surfaces.passes.tool_lines import ToolLines
from surfaces.passes.welded_triangles import WorkingMesh, cut_at_middles, edges_of, twin_sides

ROUNDS = 3  # how often faces between treated and untreated are cut in four
JUNG = 3.0**-0.5  # [1] of its longest edge: no place of a triangle is further from its middle
CLOSE = 0.1  # [1] of the radius: points of the path are no further apart
MOST_NEAR = 64  # places of the path that are looked at for a face whose nearest one is beyond it
MOST_CUT = 12_000  # faces that are cut in four in one round, those that are least certain
NARROW = 0.002  # [1] of the area: a bracket this narrow is not cut further


@dataclass(frozen=True, eq=False, slots=True)
class Treated(Protected):
    """How much of a surface is treated."""

    area: float
    """m^2, of the whole surface."""
    lower: float
    """[1] at least this share of it is treated."""
    upper: float
    """[1] and at most this."""
    mesh: WorkingMesh
    """The surface as it was measured."""
    shares: Array
    """(F,) the treated share of each of its faces, at least."""
    most: Array
    """(F,) and at most."""


def treated_share(
    mesh: WorkingMesh,
    normals: Array,
    path: ToolLines,
    radius: float,
    rounds: int = ROUNDS,
    off: float = 0.0,
) -> Treated:
    """Measure what lies within `radius` (m) of a path.

    Args:
        mesh: the surface as triangles.
        normals: (F, 3) outward unit normals of its faces.
        path: of the tool, on the surface.
        radius: m > 0, half of the footprint.
        rounds: how often faces at the border are cut in four, where the bracket is wide.
        off: m >= 0, how far the tool may be from the path at most; from the radius on all is open.
    """
    area = float(mesh.areas.sum())
    if not len(path.points) or off >= radius:
        none, most = np.zeros(len(mesh.faces)), float(len(path.points) > 0)
        return Treated(area, 0.0, most, mesh, none, none + most)
    path = path.no_longer_than(CLOSE * radius)
    found = _bracket(mesh, normals, path, radius, off)
    found = found.where(_connected(mesh, path, found.upper > 0.0))
    for _ in range(rounds):
        gap = (found.upper - found.lower) * mesh.areas
        if float(gap.sum()) <= NARROW * area:
            break
        widest = np.argsort(-gap, kind="stable")[:MOST_CUT]
        widest = widest[gap[widest] > 0.0]
        rest = np.ones(len(gap), dtype=bool)
        rest[widest] = False
        edges = edges_of(mesh.faces[widest])
        every = np.ones(len(edges.ends), dtype=bool)
        cut = cut_at_middles(WorkingMesh(mesh.vertices, mesh.faces[widest]), edges, every)
        cut_normals = normals[widest][cut.parent]
        parts = _bracket(cut.mesh.compact(), cut_normals, path, radius, off)
        mesh = WorkingMesh(cut.mesh.vertices, np.concatenate([mesh.faces[rest], cut.mesh.faces]))
        normals = np.concatenate([normals[rest], cut_normals])
        # What bounds a face bounds its parts.
        upper = np.concatenate([found.upper[rest], parts.upper])
        lower = np.concatenate([found.lower[rest], np.minimum(parts.lower, parts.upper)])
        found = _Bracket(lower, upper)
    areas = mesh.areas
    return Treated(
        area=area,
        lower=float((found.lower * areas).sum()) / area,
        upper=min(1.0, float((found.upper * areas).sum()) / area),
        mesh=mesh,
        shares=found.lower,
        most=found.upper,
    )


class _Bracket(NamedTuple):
    """Shares of each face."""

    lower: Array
    upper: Array

    def where(self, joined: Mask) -> _Bracket:
        """The same with nothing on faces that are not joined with the path."""
        lower = self.lower * joined
        return _Bracket(lower, np.maximum(self.upper * joined, lower))


def _bracket(
    mesh: WorkingMesh, normals: Array, path: ToolLines, radius: float, off: float
) -> _Bracket:
    """Treated shares of faces, at least and at most; the radius may be `off` (m) either way."""
    from scipy.spatial import KDTree

    corners, edge = mesh.corners, mesh.longest_edges
    inner, radius = radius - off, radius + off
    far = radius + 2.0 * float(edge.max()) + path.step
    tree = KDTree(path.points)
    distance, nearest = tree.query(mesh.vertices, distance_upper_bound=far)
    distance = np.minimum(distance, far)
    slack = edge**2 / (6.0 * np.maximum(radius - edge, 0.25 * radius)) + path.step**2 / (8 * radius)
    upper = share_below(distance[mesh.faces] - slack[:, None], radius)
    places = np.where(nearest < len(path.points), nearest, -1)[mesh.faces]
    facing = _facing(path, places, normals).any(axis=1)
    # Beyond a thin part the nearest place may be on its other side: look at further ones.
    rest = np.flatnonzero(~facing & (distance[mesh.faces].min(axis=1) <= radius + edge))
    more = _further(tree, path, corners[rest].mean(axis=1), normals[rest], far)
    within = more.found & (more.away - JUNG * edge[rest] - path.step**2 / (8 * radius) <= radius)
    upper[rest] = np.where(within | more.cut_short, 1.0, 0.0)
    places[rest[more.found], 0] = more.place[more.found]
    lower = _at_least(corners, normals, path, places, inner)
    return _Bracket(lower, np.maximum(upper, lower))


def _facing(path: ToolLines, places: Ints, normals: Array) -> Mask:
    """(F, k) whether the path's places (F, k) lie on the side that faces look to; -1 is none."""
    cosines = np.einsum("fki,fi->fk", path.normals[places], normals)
    return np.asarray((cosines > 0.0) & (places >= 0))


def _at_least(
    corners: Array, normals: Array, path: ToolLines, places: Ints, radius: float
) -> Array:
    """(F,) treated share of each face by one of the pieces of the path next to some places."""
    start, end = path.segments
    lower = np.zeros(len(corners))
    facing = _facing(path, places, normals)
    for column in range(places.shape[1]):
        for piece in (places[:, column], np.maximum(places[:, column] - 1, 0)):
            share = share_below(_from_segments(corners, start[piece], end[piece]), radius)
            lower = np.where(facing[:, column], np.maximum(lower, share), lower)
    return lower


class _Further(NamedTuple):
    """What further places of the path are near faces whose nearest one is beyond them."""

    found: Mask
    """(k,) there is one on the side of the face."""
    place: Ints
    """(k,) the nearest of these."""
    away: Array
    """(k,) m, how far it is from the middle of the face."""
    cut_short: Mask
    """(k,) too many are near for all to be looked at."""


def _further(tree: Any, path: ToolLines, middles: Array, normals: Array, far: float) -> _Further:
    """Look at up to `MOST_NEAR` places within `far` (m) of some faces' middles (k, 3)."""
    count = min(MOST_NEAR, len(path.points))
    away, near = tree.query(middles, k=[*range(1, count + 1)], distance_upper_bound=far)
    places = np.where(near < len(path.points), near, -1)
    facing = _facing(path, places, normals)
    first = facing.argmax(axis=1)
    found = np.asarray(facing.any(axis=1), dtype=np.bool_)
    short = ~found & (places[:, -1] >= 0) & (count < len(path.points))
    rows = np.arange(len(places))
    return _Further(found, places[rows, first], away[rows, first], short)


def _from_segments(corners: Array, start: Array, end: Array) -> Array:
    """(F, 3) m, distances of the corners of faces (F, 3, 3) from one segment each."""
    along = (end - start)[:, None]
    squared = np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip(((corners - start[:, None]) * along).sum(axis=2) / squared, 0.0, 1.0)
    return np.asarray(np.linalg.norm(corners - start[:, None] - share[..., None] * along, axis=2))


def share_below(values: Array, level: float) -> Array:
    """(F,) the share of each triangle in which a linear function is at most `level`.

    Args:
        values: (F, 3) at the corners.
        level: the value.
    """
    f = np.sort(values, axis=1) - level
    a, b, c = f.T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = a * a / ((a - b) * (a - c))  # only the lowest corner lies below
        two = 1.0 - c * c / ((c - a) * (c - b))  # only the highest lies above
    found = np.where(c <= 0.0, 1.0, np.where(a >= 0.0, 0.0, np.where(b > 0.0, one, two)))
    return np.asarray(np.clip(np.nan_to_num(found), 0.0, 1.0))


def _connected(mesh: WorkingMesh, path: ToolLines, touched: Mask) -> Mask:
    """(F,) faces that are joined with a face under the path by faces that are touched."""
    from scipy.spatial import KDTree

    faces = np.flatnonzero(touched)
    if not len(faces):
        return touched
    part = components(twin_sides(mesh.faces[faces]) // 3, len(faces))
    middles = mesh.corners[faces].mean(axis=1)
    close, under = KDTree(middles).query(path.points)
    own = close <= 2.0 * np.linalg.norm(np.ptp(mesh.corners[faces[under]], axis=1), axis=1)
    found = np.zeros(len(touched), dtype=bool)
    found[faces[np.isin(part, np.unique(part[under[own]]))]] = True
    return found
