"""Exact distances on a mesh, and vertices that they do not reach although it is one piece.

The windows by which exact distances spread are lost to rounding at a vertex now and then. Such a
vertex takes its value from its neighbours: the least that makes the distance grow by its own length
over one of its faces, or along one of its edges (one step of fast marching; Kimmel and Sethian,
"Computing geodesic paths on manifolds", 1998).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import counted
from surfaces.adjacency import components
from surfaces.passes.welded_triangles import WorkingMesh
from surfaces.surface import SurfaceError

REMEDY = "measure between section planes (--by planes), which needs no way over the surface"
TRIES = 4  # of pygeodesic where it fails
JITTER = 1e-9  # [1] of the extent


class Reached(NamedTuple):
    """Distances without gaps."""

    distances: Array
    """(V,) m."""
    mended: Ints
    """(k,) vertices that took theirs from their neighbours."""


def exact_distances(mesh: WorkingMesh, sources: Ints) -> tuple[Array, Ints]:
    """Of all vertices from the nearest of some: (V,) m, inf where lost, and which (V,), -1 there.

    What pygeodesic says is the nearest source of a vertex that it has not reached is left to
    chance, and may be too large a number for its own array. Then it is asked again, with vertices
    that are a hair elsewhere, so that other roundings occur.

    Args:
        mesh: the mesh.
        sources: (k,) vertices.

    Raises:
        SurfaceError: that happens every time.
    """
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    rng = np.random.default_rng(0)
    jitter = JITTER * float(np.ptp(mesh.vertices, axis=0).max())
    for k in range(TRIES):
        off = min(k, 1) * jitter * rng.uniform(-1.0, 1.0, mesh.vertices.shape)
        algorithm = PyGeodesicAlgorithmExact(mesh.vertices + off, mesh.faces.astype(np.int32))
        try:
            found, index = algorithm.geodesicDistances(sources.astype(np.int32), None)
        except OverflowError:
            continue
        known = np.isfinite(found)
        nearest = np.full(len(known), -1, dtype=np.int64)
        nearest[known] = sources[index[known]]
        return np.where(known, found, np.inf), nearest
    raise SurfaceError(f"exact distances cannot be measured on this mesh; {REMEDY}", "passes")


def reached(mesh: WorkingMesh, distances: Array) -> Reached:
    """Fill the gaps of exact distances on a mesh that is one piece.

    Args:
        mesh: the mesh.
        distances: (V,) m; what is not finite was not reached.
    """
    lost = ~np.isfinite(distances)
    missing = np.flatnonzero(lost)
    values = np.where(lost, np.inf, distances)
    if not len(missing):
        return Reached(values, missing)
    faces = mesh.faces[lost[mesh.faces].any(axis=1)]
    around = np.concatenate([np.roll(faces, turn, axis=1) for turn in range(3)])
    around = around[lost[around[:, 0]]]
    while True:
        before = values[missing]
        np.minimum.at(values, around[:, 0], _over_faces(mesh.vertices[around], values[around]))
        if np.array_equal(before, values[missing]):
            return Reached(values, missing)


def _over_faces(corners: Array, values: Array) -> Array:
    """(k,) m at the first corners of faces (k, 3, 3), from values (k, 3) at the others."""
    sides = corners[:, 1:] - corners[:, :1]
    lengths = np.linalg.norm(sides, axis=2)
    along = (values[:, 1:] + lengths).min(axis=1)
    some = np.flatnonzero(np.isfinite(values[:, 1:]).all(axis=1))
    known, gram = values[some, 1:], sides[some] @ sides[some].swapaxes(1, 2)
    # |gradient| = 1 with gradient . sides = known - t is a quadratic equation for t.
    inverse = np.linalg.pinv(gram, hermitian=True)
    one, d = inverse.sum(axis=2), np.einsum("kij,kj->ki", inverse, known)
    a, b = one.sum(axis=1), d.sum(axis=1)
    square = b * b - a * ((known * d).sum(axis=1) - 1.0)
    t = (b + np.sqrt(np.maximum(square, 0.0))) / np.maximum(a, 1e-300)
    through = (d - t[:, None] * one <= 0.0).all(axis=1) & (square >= 0.0)
    along[some[through]] = np.minimum(along[some[through]], t[through])
    return np.asarray(along)


def refuse_parts(mesh: WorkingMesh, first: Ints) -> None:
    """Refuse a mesh with parts that nothing joins to some vertices.

    Raises:
        SurfaceError: there are some.
    """
    joined = np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]])
    part = components(joined, len(mesh.vertices))
    of_face = part[mesh.faces[:, 0]]
    apart = np.setdiff1d(of_face, part[first])
    if not len(apart):
        return
    own = of_face == apart[0]
    middle = np.average(mesh.corners[own].mean(axis=1), axis=0, weights=mesh.areas[own])
    at = ", ".join(f"{value:.3g}" for value in middle)
    raise SurfaceError(
        f"the distance from the first pass does not reach {counted(len(apart), 'part')} of the "
        f"surface, such as the one about ({at}) m: nothing joins it to the rest; {REMEDY}, or "
        "mend the mesh",
        "passes",
    )
