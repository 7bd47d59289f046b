"""TriangleMesh: triangles that form a clean surface, with their edges and normals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coverable.arrays import Array, Ints, Protected
from surfaces.adjacency import components
from surfaces.surface import SurfaceError


@dataclass(frozen=True, eq=False, slots=True)
class Edges(Protected):
    """The edges of E pairs of faces, and the B edges on the border."""

    faces: Ints
    """(E, 2) the two faces that share an edge, the lower index first."""
    vertices: Ints
    """(E, 2) the ends of that edge, in the order in which the first face runs along it."""
    lengths: Array
    """(E,) m."""
    border_faces: Ints
    """(B,) the only face at each border edge."""
    border_vertices: Ints
    """(B, 2) the ends of each border edge, in the order in which its face runs along it."""
    border_lengths: Array
    """(B,) m."""


@dataclass(frozen=True, eq=False, slots=True)
class TriangleMesh(Protected):
    """A surface of triangles that `surfaces.meshes.repair.clean` has checked.

    No edge has more than two faces, faces that share an edge agree about the outer side, every
    vertex is used, by one fan of faces, and no face is without area. A face is seen from outside
    where its corners run counterclockwise.

    Raises:
        SurfaceError: the arrays break one of the rules that this class can hold: shapes, indices,
            finite vertices, faces with an area, at most two faces on an edge, one outer side.
    """

    vertices: Array
    """(V, 3) m."""
    faces: Ints
    """(F, 3) indices of vertices."""
    history: tuple[str, ...] = ()
    """What was repaired or cut since the mesh was read, in order."""
    face_normals: Array = field(init=False, repr=False)
    """(F, 3) outward unit normals."""
    face_areas: Array = field(init=False, repr=False)
    """(F,) m^2."""
    edges: Edges = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Copy, derive and write-protect the arrays."""
        vertices = np.array(self.vertices, dtype=float)
        faces = np.array(self.faces, dtype=np.int64)
        _check_arrays(vertices, faces)
        doubled = doubled_areas(vertices, faces)
        lengths = np.linalg.norm(doubled, axis=1)
        if not lengths.all():
            raise SurfaceError(f"face {int(lengths.argmin())} has no area; clean the mesh first")
        normals = doubled / lengths[:, None]
        derived = {
            "vertices": vertices,
            "faces": faces,
            "face_normals": normals,
            "face_areas": 0.5 * lengths,
            "edges": _edges(vertices, faces),
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)
        Protected.__post_init__(self)

    def __repr__(self) -> str:
        """One line: how many faces, their area and extent."""
        x, y, z = self.extent
        return (
            f"TriangleMesh({len(self.faces)} faces, {self.area:.6g} m^2, "
            f"{x:.4g} x {y:.4g} x {z:.4g} m)"
        )

    @property
    def area(self) -> float:
        """m^2."""
        return float(self.face_areas.sum())

    @property
    def extent(self) -> Array:
        """(3,) m, the sides of the box around the mesh, along x, y and z."""
        return np.ptp(self.vertices, axis=0)

    @property
    def pieces(self) -> Ints:
        """(F,) number of the connected piece of each face; 0 is the piece of largest area."""
        return piece_numbers(self.edges.faces, self.face_areas)


def doubled_areas(vertices: Array, faces: Ints) -> Array:
    """(F, 3) m^2: the normals of the faces, as long as twice their areas."""
    a, b, c = (vertices[corner] for corner in faces.T)
    return np.cross(b - a, c - a)


def areas_of(vertices: Array, faces: Ints) -> Array:
    """(F,) m^2."""
    return np.linalg.norm(doubled_areas(vertices, faces), axis=1) / 2.0


@dataclass(frozen=True, eq=False, slots=True)
class HalfEdges:
    """The three directed edges of every face, sorted so that those of one edge are neighbours.

    Half-edge 3 f + k runs from corner k of face f to the next corner.
    """

    order: Ints
    """(3 F,) the half-edges, sorted by their ends, and by face within one edge."""
    starts: Ints
    """(N,) where in `order` each edge begins."""
    counts: Ints
    """(N,) how many faces each edge has."""

    def of_count(self, count: int) -> Ints:
        """(M, count) the half-edges of the edges that have so many faces."""
        chosen = self.starts[self.counts == count]
        return self.order[chosen[:, None] + np.arange(count)]

    @property
    def edges(self) -> Ints:
        """(3 F,) number of the edge of each half-edge, from 0 in the order of their vertices."""
        numbers = np.empty(len(self.order), np.int64)
        numbers[self.order] = np.repeat(np.arange(len(self.starts)), self.counts)
        return numbers


def half_edges(faces: Ints) -> HalfEdges:
    """Sort the half-edges of (F, 3) faces by edge."""
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(tails, heads) * (int(faces.max(initial=0)) + 1) + np.maximum(tails, heads)
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.concatenate([[True], key[1:] != key[:-1]]) if len(key) else np.empty(0, bool)
    starts = np.flatnonzero(first)
    return HalfEdges(order, starts, np.diff(np.append(starts, len(key))))


def half_edge_ends(faces: Ints, halves: Ints) -> Ints:
    """(..., 2) the vertices from which and to which half-edges run."""
    return np.stack([faces.ravel()[halves], np.roll(faces, -1, axis=1).ravel()[halves]], axis=-1)


def piece_numbers(pairs: Ints, areas: Array) -> Ints:
    """(F,) number of the piece of each face, from pairs that share an edge; the largest is 0."""
    labels = components(pairs, len(areas))
    rank = np.empty(labels.max(initial=-1) + 1, np.int64)
    rank[np.argsort(-np.bincount(labels, areas), kind="stable")] = np.arange(len(rank))
    return rank[labels]


def _check_arrays(vertices: Array, faces: Ints) -> None:
    """Refuse arrays that are not a mesh at all."""
    for name, array in (("vertices", vertices), ("faces", faces)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise SurfaceError(f"{name} must have shape (n, 3), got {array.shape}")
    if not len(faces):
        raise SurfaceError("the mesh has no faces")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise SurfaceError(f"faces must name vertices 0 .. {len(vertices) - 1}")
    if not np.isfinite(vertices).all():
        raise SurfaceError("vertices must be finite numbers (metres)")


def _edges(vertices: Array, faces: Ints) -> Edges:
    """The edges of faces that agree about the outer side."""
    halves = half_edges(faces)
    inner, border = _joined(faces, halves), halves.of_count(1)[:, 0]
    ends, border_ends = half_edge_ends(faces, inner[:, 0]), half_edge_ends(faces, border)
    lengths, border_lengths = (
        np.linalg.norm(np.diff(vertices[some], axis=1)[:, 0], axis=1)
        for some in (ends, border_ends)
    )
    return Edges(inner // 3, ends, lengths, border // 3, border_ends, border_lengths)


def edge_partners(faces: Ints) -> Ints:
    """(F, 3) for half-edge k of each face the one on its other side; -1 at the border of the mesh.

    Raises:
        SurfaceError: an edge has more than two faces, or both run along it in one direction.
    """
    joined = _joined(faces, half_edges(faces))
    partner = np.full(faces.size, -1, dtype=np.int64)
    partner[joined] = joined[:, ::-1]
    return partner.reshape(-1, 3)


def _joined(faces: Ints, halves: HalfEdges) -> Ints:
    """(E, 2) the half-edges of each edge between two faces; raises if the faces do not fit."""
    if halves.counts.max(initial=0) > 2:
        raise SurfaceError("an edge has more than two faces; clean the mesh first")
    joined = halves.of_count(2)
    ends = half_edge_ends(faces, joined)
    if (ends[:, 0] == ends[:, 1]).all(axis=1).any():
        raise SurfaceError("faces disagree about the outer side; clean the mesh first")
    return joined


def sum_by(labels: Ints, values: Array, count: int) -> Array:
    """(count, ...) sums of the rows of `values` (F,) or (F, C) that have the same label."""
    if values.ndim == 1:
        return np.bincount(labels, weights=values, minlength=count).astype(float)
    return np.column_stack([sum_by(labels, column, count) for column in values.T])


def least_by(labels: Ints, values: Array, same: Array | float = 0.0) -> Ints:
    """(N,) for each label the first row whose value (F,) is the least, or within `same` of it."""
    least = np.full(int(labels.max()) + 1, np.inf)
    np.minimum.at(least, labels, values)
    rows = np.flatnonzero(values <= (least + same)[labels])
    return np.asarray(rows[np.unique(labels[rows], return_index=True)[1]])
