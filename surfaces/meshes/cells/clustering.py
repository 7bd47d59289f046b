"""Cut a triangle mesh into E-cells: connected groups of faces, compact and of even area.

Lloyd's iteration: faces go to the nearest seed, seeds to the middle of their cells (a centroidal
Voronoi tessellation on the faces; Du, Faber and Gunzburger 1999). A head start for each seed, more
for a cell that is too small, evens the areas out. Nothing is random, and a turned, moved or scaled
mesh gets the same cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import LARGEST, LARGEST_WHOLE, SMALLEST, Fault, is_whole, real, shown
from surfaces.adjacency import components
from surfaces.meshes.cells.subdivision import Subdivision, subdivide
from surfaces.meshes.cells.voronoi import far_seeds, flood, recentre, smooth, units, whole_steps
from surfaces.meshes.triangle_mesh import areas_of, doubled_areas, edge_partners, sum_by
from surfaces.surface import SurfaceError

FACES_PER_CELL = 80
MOST_CELLS = 20_000
_BORDER = 0.6  # cells: how far outside the border counts as a seed
_MOVING = 10  # rounds in which seeds move
_MOST_MOVING = 40  # as long as areas are more uneven than
_UNEVEN = 0.12  # this, std / mean
_EVENING = 6  # rounds after that, at most, in which head starts alone even out the areas
_EVEN = 0.03  # std / mean of the areas that is good enough
_GAIN = 0.5  # share of a missing area that one round makes up for
_JAGGED = 1.4  # borders run along edges, about this much longer than straight
_PIN = 1e-3  # keeps the head starts of a separate piece from drifting
_MOST_OFFSET = 3.0  # head starts, in lengths of a cell
_MOST_STEP = 0.2  # between neighbours in one round


class FaceGraph(NamedTuple):
    """Faces as nodes, joined across the edges they share. Edge k of a face is from its vertex k."""

    across: Ints
    """(F, 3) the face on the other side of each edge, or -1 at the border of the mesh."""
    step: Array
    """(F, 3) m, from a face's centre over the middle of the edge to the other's centre; 0 at
    the border."""
    edge: Array
    """(F, 3) m, lengths of the edges."""
    centre: Array
    """(F, 3) m, the mean of each face's vertices."""
    normal: Array
    """(F, 3) unit normals; zero for a face without area."""
    area: Array
    """(F,) m^2."""
    piece: Ints
    """(F,) which connected piece each face belongs to, counted from 0 in the order of faces."""


def face_graph(vertices: Array, faces: Ints) -> FaceGraph:
    """The graph of the faces of a clean mesh.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices, counter-clockwise seen from outside.

    Raises:
        SurfaceError: an edge has more than two faces, or both run along it in one direction.
    """
    partner = edge_partners(faces)
    across = np.where(partner >= 0, partner // 3, -1)
    corners = vertices[faces]
    centre = corners.mean(axis=1)
    double = doubled_areas(vertices, faces)
    length = np.linalg.norm(double, axis=1)
    normal = double / np.where(length > 0.0, length, 1.0)[:, None]
    following = np.roll(corners, -1, axis=1)
    edge = np.linalg.norm(following - corners, axis=2)
    middles = (corners + following) / 2.0
    half = np.linalg.norm(middles - centre[:, None], axis=2)
    # The edge is the same seen from either side, so each side adds its own half.
    step = np.where(across >= 0, half + half.ravel()[partner], 0.0)
    owner, k = np.nonzero(across >= 0)
    piece = components(np.column_stack([owner, across[owner, k]]), len(faces))
    return FaceGraph(across, step, edge, centre, normal, length / 2.0, piece)


class CellCut(NamedTuple):
    """A mesh fine enough for its cells, and the cell of each face."""

    mesh: Subdivision
    """The finer mesh, and the old face of each new one."""
    labels: Ints
    """(G,) cell of each face of `mesh`, each number from 0 on at least once."""


def cells_for(
    vertices: Array, faces: Ints, count: int | None = None, size: float | None = None
) -> CellCut:
    """Cut a mesh into cells, after splitting its coarse triangles.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices of a clean mesh.
        count: how many cells; or
        size: m, the side of a square that has a cell's area.

    Raises:
        SurfaceError: not exactly one of `count` and `size` is given, it is not a number that makes
            1 to 20,000 cells, or there are fewer cells than separate pieces.

    Example:
        >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
        >>> cut = cells_for(square, np.array([[0, 1, 2], [0, 2, 3]]), size=0.25)
        >>> len(np.unique(cut.labels)), len(cut.labels)
        (16, 2048)
    """
    total = float(areas_of(vertices, faces).sum())
    number = _number_of_cells(total, count, size)
    mesh = subdivide(vertices, faces, total / number / FACES_PER_CELL)
    return CellCut(mesh, cluster_faces(mesh.vertices, mesh.faces, number))


def cluster_faces(vertices: Array, faces: Ints, count: int) -> Ints:
    """Labels (F,) of `count` connected cells of even area; separate pieces share by area.

    The faces should be much smaller than the cells; `cells_for` sees to it.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices of a clean mesh.
        count: number of cells, at most one for each face.

    Raises:
        SurfaceError: there are more separate pieces than cells.
    """
    graph = face_graph(vertices, faces)
    quota = _shares(graph, count)
    # From here on, lengths are in cells: the side of a square of a cell's mean area is 1.
    unit = math.sqrt(graph.area.sum() / count)
    graph = graph._replace(
        step=graph.step / unit,
        edge=graph.edge / unit,
        centre=graph.centre / unit,
        area=graph.area / unit**2,
    )
    target = np.repeat(np.bincount(graph.piece, weights=graph.area) / quota, quota)
    seeds = far_seeds(graph.across, whole_steps(graph.step), graph.piece, quota, units(_BORDER))
    labels = _lloyd(graph, target, seeds)
    smooth(graph.across, whole_steps(graph.edge), graph.area, target, labels)
    return labels


def _lloyd(graph: FaceGraph, target: Array, seeds: Ints) -> Ints:
    """The most even labels of some rounds, all lengths in cells; `seeds` (N,) is changed."""
    across, centre, area = graph.across, graph.centre, graph.area
    labels = np.empty(len(area), dtype=np.int64)
    best, least = labels, math.inf
    anchors, offsets = centre[seeds], np.zeros(len(seeds))
    moving, evened = True, 0
    for done in range(1, _MOST_MOVING + _EVENING + 1):
        flood(across, graph.step, centre, seeds, anchors, offsets, labels)
        areas = sum_by(labels, area, len(seeds))
        uneven = float((areas / target).std())
        moving = moving and (done < _MOVING or (uneven > _UNEVEN and done < _MOST_MOVING))
        if moving:
            recentre(centre, graph.normal, area, labels, seeds, anchors)
            # A border moves half as far as a head start, and around a cell it is about 4 long.
            offsets += _GAIN * (target - areas) / np.sqrt(target) / 2.0
        else:
            evened += 1
            if uneven < least:
                best, least = labels.copy(), uneven
            if uneven <= _EVEN or evened > _EVENING:
                break
            offsets += _head_starts(across, graph.edge, labels, target - areas)
        offsets = np.clip(offsets - offsets.mean(), -_MOST_OFFSET, _MOST_OFFSET)
    return best


def _head_starts(across: Ints, edge: Array, labels: Ints, missing: Array) -> Array:
    """(N,) head starts that would give each cell the area it misses: one step of Newton's method.

    A border of length s moves by half the difference of its two head starts h, so a cell gains
    the sum of s (h - h') / 2 over its neighbours: a Laplace equation on the graph of cells.
    """
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    face, k = np.nonzero((across >= 0) & (labels[across] != labels[:, None]))
    count = len(missing)
    ends = (labels[face], labels[across[face, k]])
    border = coo_array((edge[face, k] / _JAGGED / 2.0, ends), shape=(count, count)).tocsr()
    laplace = diags_array(border.sum(axis=1) + _PIN) - border
    change = np.atleast_1d(spsolve(laplace.tocsc(), missing))
    steepest = float(np.max(abs(change[ends[0]] - change[ends[1]]), initial=0.0))
    return change * min(_GAIN, _MOST_STEP / max(steepest, _MOST_STEP))


def _shares(graph: FaceGraph, count: int) -> Ints:
    """(P,) cells of each piece: by area, at least one each and at most one for each face.

    Raises:
        SurfaceError: there are more pieces than cells.
    """
    area, faces = np.bincount(graph.piece, weights=graph.area), np.bincount(graph.piece)
    if len(area) > count:
        raise SurfaceError(
            f"{count} cells are too few for {len(area)} separate pieces; each needs one at least. "
            "Ask for more cells, or drop the small pieces"
        )
    ideal = area / area.sum() * count
    quota = np.clip(np.floor(ideal).astype(np.int64), 1, faces)
    while quota.sum() != count:  # one by one, where it helps or hurts least
        if quota.sum() < count:
            quota[np.argmax(np.where(quota < faces, ideal / (quota + 1.0), -1.0))] += 1
        else:
            quota[np.argmin(np.where(quota > 1, ideal / quota, np.inf))] -= 1
    return quota


def _number_of_cells(total: float, count: int | None, size: float | None) -> int:
    """How many cells a mesh of `total` m^2 gets.

    Raises:
        SurfaceError: see `cells_for`.
    """
    side = math.sqrt(total)
    hint = f"in this part of {total:.3g} m^2, cells of {side / 14:.2g} m make about 200"
    if (count is None) == (size is None):
        raise SurfaceError(Fault("count", "is needed, or size, and not both", expected=hint))
    if size is not None:
        if not SMALLEST <= real(size) <= LARGEST:
            got = f"got {shown(size)}; {hint}"
            raise SurfaceError(Fault("size", got, expected="must be a finite number > 0 (metres)"))
        ideal = total / size**2
        count = max(round(ideal), 1) if ideal < 1e9 else 10**9
    if not is_whole(count, -LARGEST_WHOLE):
        got = f"got {shown(count)}"
        raise SurfaceError(Fault("count", got, expected="must be a whole number >= 1"))
    number = int(count)
    if not 1 <= number <= MOST_CELLS:
        key, got = ("count", "got") if size is None else ("size", f"got {size:g} m, which makes")
        expected = f"must make 1 to {MOST_CELLS:,} cells"
        raise SurfaceError(Fault(key, f"{got} {number:,}; {hint}", expected=expected))
    return number
