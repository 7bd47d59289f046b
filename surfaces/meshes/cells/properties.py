"""Properties of each cell of a mesh: centre, normal, area, flatness, neighbours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected
from surfaces.adjacency import Neighbours
from surfaces.meshes.cells.borders import (
    LabelledFaces,
    SharedBorders,
    centre_points,
    clockwise_neighbours,
    shared_borders,
)
from surfaces.meshes.triangle_mesh import doubled_areas, sum_by
from surfaces.surface import SurfaceError

MOST_TURN_DEG = 30.0


@dataclass(frozen=True, eq=False, slots=True)
class Figures(Protected):
    """The figures of N cells of a mesh."""

    centres: Array
    """(N, 3) m, on the faces."""
    normals: Array
    """(N, 3) unit normals at the centres, interpolated between the vertices."""
    areas: Array
    """(N,) m^2."""
    faces: Ints
    """(N,) the face each centre lies on."""
    weights: Array
    """(N, 3) the centres' barycentric coordinates there."""
    flatness: Array
    """(N,) rad, the largest angle between a face's normal and the mean of all, weighted by area;
    or the centre's normal where the mean is zero (a closed cell)."""
    crease: Array
    """(N,) rad, the largest angle between two faces of the cell that share an edge."""
    borders: SharedBorders
    """Neighbouring pairs, and the border they share."""
    neighbours: Neighbours
    """Each cell's neighbours, clockwise seen from the normal's tip, the lowest index first."""


def figures(vertices: Array, faces: Ints, vertex_normals: Array, labels: Ints) -> Figures:
    """The figures of cells.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices of a clean mesh.
        vertex_normals: (V, 3) of any length.
        labels: (F,) cell of each face; every one of 0..N-1 is used.

    Raises:
        SurfaceError: a label is not used.
    """
    used = np.bincount(labels)
    if (used == 0).any():
        raise SurfaceError(f"cell {int(np.argmin(used))} has no face; number cells from 0 on")
    count = len(used)
    mesh = LabelledFaces.of(vertices, faces, labels)
    double = doubled_areas(vertices, faces)
    face_areas = np.linalg.norm(double, axis=1) / 2.0
    face_normals = _unit(double)
    places = centre_points(mesh, face_areas)
    normals = np.einsum("nk,nkc->nc", places.weights, vertex_normals[faces[places.faces]])
    normals = _unit(normals, instead=face_normals[places.faces])
    areas = sum_by(labels, face_areas, count)
    mean = _unit(sum_by(labels, double, count), instead=normals, least=1e-12 * areas)
    flatness, crease = np.zeros((2, count))
    np.maximum.at(flatness, labels, _angle(face_normals, mean[labels]))
    face, k = np.nonzero(~mesh.border)
    fold = _angle(face_normals[face], face_normals[mesh.partner[face, k] // 3])
    np.maximum.at(crease, labels[face], fold)
    borders = shared_borders(mesh)
    return Figures(
        centres=places.points,
        normals=normals,
        areas=areas,
        faces=places.faces,
        weights=places.weights,
        flatness=flatness,
        crease=crease,
        borders=borders,
        neighbours=clockwise_neighbours(borders, places.points, normals),
    )


def coarse(figures: Figures) -> str:
    """The share of the cells that is too large for the curvature, and a size that is not; or "".

    A cell is too large where a normal in it leans more than `MOST_TURN_DEG` from its mean. Smaller
    cells mend that, unless the surface has a crease.
    """
    most = math.radians(MOST_TURN_DEG)
    count = len(figures.areas)
    creased = figures.crease > most
    curved = (figures.flatness > most) & ~creased
    parts = []
    if curved.any():
        worst = float(figures.flatness[curved].max())
        # The lean grows with a cell's width; a tenth is added for cells that lie worse.
        ratio = 1.1 * worst / most
        size = math.sqrt(float(figures.areas.mean()))
        parts.append(
            f"{_share(curved)} too large for the curvature: the normal leans up to "
            f"{math.degrees(worst):.0f} degrees from the cell's mean, more than "
            f"{MOST_TURN_DEG:g}; about {_round_up(count * ratio**2):,} cells "
            f"(cell_size = {size / ratio:.2g} m) would do"
        )
    if creased.any():
        parts.append(
            f"{_share(creased)} folded over a crease of up to "
            f"{math.degrees(float(figures.crease.max())):.0f} degrees, which no smaller cell "
            "removes: their centre stands for both sides; cut the surface there for cells that "
            "end at it"
        )
    return "; ".join(parts)


def _share(which: Mask) -> str:
    """'12 of 200 cells (6 %) are'."""
    number = int(which.sum())
    percent = 100.0 * number / len(which)
    figure = f"{percent:.0f}" if percent >= 9.5 else f"{percent:.2g}"
    return f"{number} of {len(which)} cells ({figure} %) {'is' if number == 1 else 'are'}"


def _round_up(number: float) -> int:
    """Up to two significant digits."""
    step = 10.0 ** max(math.floor(math.log10(number)) - 1, 0)
    return int(math.ceil(number / step) * step)


def _unit(vectors: Array, instead: Array | None = None, least: Array | float = 0.0) -> Array:
    """Rows of length 1; those no longer than `least` are taken from `instead`, or zero."""
    length = np.linalg.norm(vectors, axis=1)
    short = (length <= least)[:, None]
    unit = vectors / np.where(short, 1.0, length[:, None])
    return np.where(short, 0.0 if instead is None else instead, unit)


def _angle(a: Array, b: Array) -> Array:
    """(K,) rad between unit vectors, exact for small angles too (Kahan)."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
