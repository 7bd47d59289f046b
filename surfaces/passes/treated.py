"""The share of a surface that a tool treats which runs along a path: a bracket of two areas.

Treated is what lies within half a footprint r of the path (a ball about each of its places), on
that side of the surface, and connected with the path within the ball. For a triangle with longest
edge e and the distances f of its corners from the path, with s between points of the path,

    f(x) >= interpolated f - e^2 / (6 d) - s^2 / (8 r),   d >= r - e the distance there,

because the distance is semiconcave and no circle about a triangle is wider than Jung's theorem
says; and the distance from any one segment of the path is convex, so it lies below its own
interpolation. Areas of triangles in which a linear function is at most r are closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.net import WorkingMesh
from surfaces.protected import Protected

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROUNDS = 3  # how often faces between treated and untreated are cut in four
JUNG = 3.0**-0.5  # [1] of its longest edge: no place of a triangle is further from its middle
CLOSE = 0.1  # [1] of the radius: points of the path are no further apart
MOST_NEAR = 64  # places of the path that are looked at for a face whose nearest one is beyond it
MOST_CUT = 12_000  # faces that are cut in four in one round, those that are least certain
NARROW = 0.002  # [1] of the area: a bracket this narrow is not cut further


class ToolLines(NamedTuple):
    """Lines that the tool runs along, on the surface."""

    points: Floats
    """(k, 3) m."""
    normals: Floats
    """(k, 3) outward unit normals of the surface there."""
    stretch: Ints
    """(k,) which stretch each point belongs to; two points of one stretch in a row are joined."""

    @property
    def segments(self) -> tuple[Floats, Floats]:
        """Both ends (m, 3) of the pieces; points alone are pieces without length."""
        joined = np.append(self.stretch[1:] == self.stretch[:-1], False)
        following = np.where(joined, np.arange(len(self.points)) + 1, np.arange(len(self.points)))
        return self.points, self.points[following]

    @property
    def step(self) -> float:
        """m, the longest piece."""
        start, end = self.segments
        return float(np.linalg.norm(end - start, axis=1).max(initial=0.0))

    def about(self, step: float) -> ToolLines:
        """The same with points about `step` (m) apart along each stretch, ends kept."""
        start, end = self.segments
        along = np.append(0.0, np.cumsum(np.linalg.norm(end - start, axis=1)))[: len(start)]
        kept = np.diff(np.floor(along / step), prepend=-1.0) > 0.0
        turns = np.diff(self.stretch) != 0
        kept[1:] |= turns
        kept[:-1] |= turns
        kept[-1:] = True
        thin = ToolLines(self.points[kept], self.normals[kept], self.stretch[kept])
        return thin.no_longer_than(step)

    def no_longer_than(self, step: float) -> ToolLines:
        """The same with points so close that no piece is longer than `step` (m)."""
        start, end = self.segments
        count = np.maximum(np.ceil(np.linalg.norm(end - start, axis=1) / step), 1).astype(np.int64)
        of = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)) / count[of]
        points = start[of] + share[:, None] * (end - start)[of]
        return ToolLines(points, self.normals[of], self.stretch[of])


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
    shares: Floats
    """(F,) the treated share of each of its faces, at least."""
    most: Floats
    """(F,) and at most."""


def treated_share(
    mesh: WorkingMesh,
    normals: Floats,
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
        off: m >= 0, less than the radius, how far the tool may be from the path at most.
    """
    area = float(mesh.areas.sum())
    if not len(path.points):
        none = np.zeros(len(mesh.faces))
        return Treated(area, 0.0, 0.0, mesh, none, none)
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
        cut = _quartered(mesh, widest)
        parts = _bracket(_compact(cut), np.tile(normals[widest], (4, 1)), path, radius, off)
        mesh = WorkingMesh(cut.vertices, np.concatenate([mesh.faces[rest], cut.faces]))
        normals = np.concatenate([normals[rest], np.tile(normals[widest], (4, 1))])
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

    lower: Floats
    upper: Floats

    def where(self, joined: NDArray[np.bool_]) -> _Bracket:
        """The same with nothing on faces that are not joined with the path."""
        lower = self.lower * joined
        return _Bracket(lower, np.maximum(self.upper * joined, lower))


def _bracket(
    mesh: WorkingMesh, normals: Floats, path: ToolLines, radius: float, off: float
) -> _Bracket:
    """Treated shares of faces, at least and at most; the radius may be `off` (m) either way."""
    from scipy.spatial import KDTree

    corners = mesh.corners
    edge = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
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


def _facing(path: ToolLines, places: Ints, normals: Floats) -> NDArray[np.bool_]:
    """(F, k) whether the path's places (F, k) lie on the side that faces look to; -1 is none."""
    cosines = np.einsum("fki,fi->fk", path.normals[places], normals)
    return np.asarray((cosines > 0.0) & (places >= 0))


def _at_least(
    corners: Floats, normals: Floats, path: ToolLines, places: Ints, radius: float
) -> Floats:
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

    found: NDArray[np.bool_]
    """(k,) there is one on the side of the face."""
    place: Ints
    """(k,) the nearest of these."""
    away: Floats
    """(k,) m, how far it is from the middle of the face."""
    cut_short: NDArray[np.bool_]
    """(k,) too many are near for all to be looked at."""


def _further(tree: Any, path: ToolLines, middles: Floats, normals: Floats, far: float) -> _Further:
    """Look at up to `MOST_NEAR` places within `far` (m) of some faces' middles (k, 3)."""
    if not len(middles):
        none = np.zeros(0, dtype=bool)
        return _Further(none, np.zeros(0, dtype=np.int64), np.zeros(0), none)
    count = min(MOST_NEAR, len(path.points))
    away, near = tree.query(middles, k=[*range(1, count + 1)], distance_upper_bound=far)
    places = np.where(near < len(path.points), near, -1)
    facing = _facing(path, places, normals)
    first = facing.argmax(axis=1)
    found = np.asarray(facing.any(axis=1), dtype=np.bool_)
    short = ~found & (places[:, -1] >= 0) & (count < len(path.points))
    rows = np.arange(len(places))
    return _Further(found, places[rows, first], away[rows, first], short)


def _from_segments(corners: Floats, start: Floats, end: Floats) -> Floats:
    """(F, 3) m, distances of the corners of faces (F, 3, 3) from one segment each."""
    along = (end - start)[:, None]
    squared = np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip(((corners - start[:, None]) * along).sum(axis=2) / squared, 0.0, 1.0)
    return np.asarray(np.linalg.norm(corners - start[:, None] - share[..., None] * along, axis=2))


def share_below(values: Floats, level: float) -> Floats:
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


def _connected(mesh: WorkingMesh, path: ToolLines, touched: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(F,) faces that are joined with a face under the path by faces that are touched."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    faces = np.flatnonzero(touched)
    if not len(faces):
        return touched
    some = mesh.faces[faces]
    sides = np.sort(np.stack([some, np.roll(some, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    keys = sides @ np.array([len(mesh.vertices), 1])
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(np.diff(keys[order]) == 0)
    pairs = order[same] // 3, order[same + 1] // 3
    joined = coo_array((np.ones(len(same), bool), pairs), shape=(len(faces), len(faces)))
    part = connected_components(joined, directed=False)[1]
    middles = mesh.corners[faces].mean(axis=1)
    close, under = KDTree(middles).query(path.points)
    own = close <= 2.0 * np.linalg.norm(np.ptp(mesh.corners[faces[under]], axis=1), axis=1)
    found = np.zeros(len(touched), dtype=bool)
    found[faces[np.isin(part, np.unique(part[under[own]]))]] = True
    return found


def _quartered(mesh: WorkingMesh, which: Ints) -> WorkingMesh:
    """Some faces cut in four at the middles of their edges; first all first parts, and so on.

    The vertices are those of the mesh, and new ones. Faces beside them stay as they are.
    """
    faces = mesh.faces[which]
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, of = np.unique(sides, axis=0, return_inverse=True)
    middle = of.reshape(-1, 3) + len(mesh.vertices)
    (a, b, c), (ab, bc, ca) = faces.T, middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    vertices = np.concatenate([mesh.vertices, mesh.vertices[edges].mean(axis=1)])
    return WorkingMesh(vertices, np.concatenate([np.column_stack(part) for part in parts]))


def _compact(mesh: WorkingMesh) -> WorkingMesh:
    """Without vertices of no face."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    return WorkingMesh(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int64))
