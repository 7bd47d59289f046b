"""The first pass goes on beyond its ends, straight, off the surface.

Around an end the lines of equal distance are arcs: places whose shortest path to the first pass
ends there lie beyond it, where the border is oblique. Were the surface longer, their distance would
be that from the pass carried on. In geodesic polar coordinates about the end e, at the distance r
and the angle t from the direction in which the pass leaves, that is the height h of a right-angled
triangle over r, and the angle follows from the distance d of a place e' on the pass, l before e.
Where the curvature K is constant (flat: K -> 0),

    cos(k d) = cos(k r) cos(k l) - sin(k r) sin(k l) cos t,    sin(k h) = sin(k r) sin t,

k = sqrt(K), imaginary where K < 0. This is exact on planes and all that unrolls onto
them, and on spheres. Elsewhere K is the mean, and what comes of it is taken where it grows by its
own length across the lines, as a distance has to; else the arcs stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.normals import corner_angles
from surfaces.passes.welded_triangles import WorkingMesh, border_edges

FLAT = 1e-4  # [1] of a turn's square over the surface: less curvature than this is none
SQUARE = 0.05  # [1] cosine up to which a border is square to the pass
LEAST_ANGLE = 0.1  # [rad] nearer to the pass carried on than this there must be no surface
OFF = 0.02  # [1] by which the slope may be off
MOST_OFF = 0.02  # [1] of the area beyond an end on which it may be off by more


@dataclass(frozen=True, eq=False, slots=True)
class FirstPass:
    """Vertices of a mesh along a first pass, and distances from it."""

    mesh: WorkingMesh
    edges: Ints
    """(k, 2) of the mesh, that are the first pass."""
    distance: Array
    """(V,) m, of all vertices from it."""
    nearest: Ints
    """(V,) the vertex of it that is nearest to each."""

    @property
    def ends(self) -> list[int]:
        """Its two ends; none where it is closed or branches."""
        vertices, count = np.unique(self.edges, return_counts=True)
        ends = vertices[count == 1].tolist()
        return ends if len(ends) == 2 and (count <= 2).all() else []


def carried_on(first: FirstPass, distances: Callable[[int], Array]) -> Array:
    """(V,) m, distances from a pass carried on beyond its ends.

    `distances` gives those (V,) m of all vertices from one vertex.
    """
    values = first.distance.copy()
    faces = first.mesh.faces
    for end in first.ends:
        beyond = first.nearest == end
        inside = beyond[faces].all(axis=1)
        found = _heights(first, end, beyond, distances)
        if found is None:
            continue
        tried = values.copy()
        tried[beyond] = found
        if _grows_evenly(first.mesh, tried, inside & ~_touching(first.mesh, first.edges)):
            values = tried
    return values


def _heights(
    first: FirstPass, end: int, beyond: Mask, distances: Callable[[int], Array]
) -> Array | None:
    """(k,) m, of the places beyond one end; None where there are none to speak of.

    Nor where the pass carried on runs over the surface.
    """
    r = first.distance[beyond]
    from_end = np.linalg.norm(first.mesh.vertices - first.mesh.vertices[end], axis=1)
    # As far back as the places are beyond: then the angle is well conditioned.
    line = np.unique(first.edges)
    other = int(line[np.abs(from_end[line] - r.max()).argmin()])
    out = first.mesh.vertices[end] - first.mesh.vertices[other]
    ahead = (first.mesh.vertices[beyond] - first.mesh.vertices[end]) @ out
    if (ahead <= SQUARE * from_end[beyond] * np.linalg.norm(out)).all():
        return None
    d = distances(other)
    length = float(d[end])
    k = _curvature(first.mesh)
    cosine = _cosine(r, length, d[beyond], k)
    if (cosine > np.cos(LEAST_ANGLE)).any():
        return None
    sine = np.sqrt(1.0 - np.clip(cosine, 0.0, 1.0) ** 2)
    return _height(r, sine, k)


def _curvature(mesh: WorkingMesh) -> float:
    """1/m^2, the mean Gaussian curvature: what angles round inner vertices lack of a turn."""
    count = len(mesh.vertices)
    angles = corner_angles(mesh.vertices, mesh.faces)
    around = np.bincount(mesh.faces.ravel(), angles.ravel(), count)
    inner = np.ones(count, dtype=bool)
    inner[border_edges(mesh.faces)] = False
    area = float((mesh.areas * inner[mesh.faces].mean(axis=1)).sum())
    total = float((2.0 * np.pi - around[inner]).sum())
    return 0.0 if abs(total) < FLAT or area <= 0.0 else total / area


def _cosine(r: Array, length: float, d: Array, curvature: float) -> Array:
    """(k,) cos t from the sides of the triangle at the end."""
    k = np.emath.sqrt(curvature)  # imaginary where K < 0: then cos and sin are hyperbolic
    with np.errstate(divide="ignore", invalid="ignore"):
        if curvature == 0.0:
            found = (d * d - r * r - length * length) / (2.0 * r * length)
        else:
            a, b, c = k * r, k * length, k * d
            found = ((np.cos(a) * np.cos(b) - np.cos(c)) / (np.sin(a) * np.sin(b))).real
    return np.nan_to_num(found)  # at the end itself there is no angle


def _height(r: Array, sine: Array, curvature: float) -> Array:
    """(k,) m, of a right-angled triangle over r."""
    if curvature == 0.0:
        return r * sine
    k = np.emath.sqrt(curvature)
    return np.asarray((np.arcsin(np.sin(k * r) * sine) / k).real)


def _touching(mesh: WorkingMesh, edges: Ints) -> Mask:
    """(F,) faces with a corner on some edges: distances from vertices are coarse there."""
    on = np.zeros(len(mesh.vertices), dtype=bool)
    on[edges] = True
    return np.asarray(on[mesh.faces].any(axis=1))


def _grows_evenly(mesh: WorkingMesh, values: Array, faces: Mask) -> bool:
    """Is the slope of some values 1 over nearly all of some faces?"""
    own = WorkingMesh(mesh.vertices, mesh.faces[faces])
    off = np.abs(slopes(own, values) - 1.0) > OFF
    return bool(own.areas[off].sum() <= MOST_OFF * own.areas.sum())


def slopes(mesh: WorkingMesh, values: Array) -> Array:
    """(F,) length of the gradient of (V,) values in each face: 1 for a distance."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    fa, fb, fc = values[mesh.faces].T
    squared = np.maximum((np.cross(b - a, c - a) ** 2).sum(axis=1), 1e-300)
    turned = (fb - fa)[:, None] * (c - a) - (fc - fa)[:, None] * (b - a)
    return np.asarray(np.sqrt((turned**2).sum(axis=1) / squared))
