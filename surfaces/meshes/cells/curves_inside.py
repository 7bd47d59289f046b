"""Curves past notches and holes of a mesh: led from face to face, away from its border.

The closest points to a straight line between two centres run along the border of the mesh where
that line leaves it. They turn sharply at the border's corners, and a smooth curve through them
leaves the surface there, however flat it is. So such a curve follows the shortest path over the
middles of the two cells' faces instead, on which faces at the border count as longer. What a smooth
fit cuts off its turns then still lies on the surface.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from coverable.arrays import Array, Ints
from surfaces.cells import Cells
from surfaces.curve_fitting import PIECES, CurveFit, fit_between_centres
from surfaces.meshes.triangle_surface import TriangleSurface

RINGS = (9.0, 4.0, 2.0)  # [1] times as long: faces that touch the border, and those next to them
SAMPLES = 8  # for each cubic
ENOUGH = 0.7  # [1] share of the deviation: what another path must reach to be worth it
PLACES = 33  # on a straight line, where it is looked at whether it leaves the surface
ACROSS = 0.5  # [1] of a distance: interpolated normals of facets lean by less


def fit_inside(fit: CurveFit, surface: TriangleSurface, labels: Ints, middles: Ints) -> None:
    """Replace curves along the border of the mesh by such inside, where these deviate less.

    Args:
        fit: curves between the cells' centres; those over creases stay.
        surface: the mesh.
        labels: (F,) cell of each face.
        middles: (N,) the face on which each cell's centre lies.
    """
    curves, pairs = fit.rough, fit.cells.pairs
    curves = curves[~fit.creased[curves] & (fit.deviations[curves, 0] > fit.close[curves, 0])]
    curves = curves[_leaves(fit.cells, pairs[curves]) > fit.close[curves, 0]]
    if len(curves) == 0:
        return
    paths = _Paths(surface, labels)
    weights = np.array([1.0, surface.mean_edge_length])
    for curve in curves:
        pair = pairs[[curve]]
        line = paths.between(fit.cells, pair[0], middles)
        for count in PIECES:
            cubics, deviations = _along(fit.cells, pair, line, count)
            before = fit.deviations[curve]
            if deviations[0] @ weights < ENOUGH * (before @ weights):
                fit.put(np.array([curve]), cubics, deviations)
            if (fit.deviations[curve] <= fit.close[curve]).all():
                break


def _leaves(cells: Cells, pairs: Ints) -> Array:
    """(m,) m, how far straight lines between the centres of pairs (m, 2) leave the surface.

    Over a bend they do so along the normal of the closest point, beyond the border across it.
    """
    t = np.linspace(0.0, 1.0, PLACES)[None, :, None]
    start, end = cells.centres[pairs[:, 0], None], cells.centres[pairs[:, 1], None]
    lines = start + t * (end - start)
    points, normals = cells.closest_along(pairs, lines)
    off = lines - points
    across = off - (off * normals).sum(axis=2, keepdims=True) * normals
    far = np.linalg.norm(across, axis=2)
    far[far < ACROSS * np.linalg.norm(off, axis=2)] = 0.0
    return np.asarray(far.max(axis=1, initial=0.0))


def _along(cells: Cells, pair: Ints, line: Array, count: int) -> tuple[Array, Array]:
    """Cubics (1, count, 4, 6) along a polyline (k, 3) m at an even pace; deviations (1, 2)."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    travel = np.concatenate([[0.0], np.cumsum(steps)])
    tau = np.linspace(0.0, travel[-1], 2 * SAMPLES * count + 1)
    points = np.column_stack([np.interp(tau, travel, line[:, axis]) for axis in range(3)])
    return fit_between_centres(cells, pair, *cells.closest_along(pair, points[None]), count)


class _Paths:
    """Shortest paths over the middles of faces, inside two cells at a time."""

    def __init__(self, surface: TriangleSurface, labels: Ints) -> None:
        """Faces as a graph: joined where they share an edge."""
        mesh = surface.mesh
        self.surface, self.labels = surface, labels
        self.middles = surface.face_balls[1]
        one, other = mesh.edges.faces.T
        length = np.linalg.norm(self.middles[one] - self.middles[other], axis=1)
        times = np.ones(len(mesh.faces))
        near = np.zeros(len(mesh.vertices), dtype=bool)
        near[mesh.edges.border_vertices] = True
        for factor in RINGS:
            ring = near[mesh.faces].any(axis=1)
            times[ring & (times == 1.0)] = factor
            near[mesh.faces[ring]] = True
        weight = length * 0.5 * (times[one] + times[other])
        shape = (len(mesh.faces),) * 2
        self.graph = coo_array((weight, (one, other)), shape=shape).tocsr()

    def between(self, cells: Cells, pair: Ints, middles: Ints) -> Array:
        """(k, 3) m, root frame: from centre to centre of a pair (2,) of cells.

        Args:
            cells: the cells.
            pair: two that share a border.
            middles: (N,) the face of each centre.
        """
        faces = np.flatnonzero(np.isin(self.labels, pair))
        first, last = np.searchsorted(faces, middles[pair])
        inner = self.graph[faces][:, faces]
        _, before = dijkstra(inner, directed=False, indices=int(first), return_predecessors=True)
        path = [int(last)]
        while path[-1] != first and before[path[-1]] >= 0:
            path.append(int(before[path[-1]]))
        local = self.middles[faces[path[-2:0:-1]]]
        between = local @ self.surface.rotation.T + self.surface.position
        return np.vstack([cells.centres[pair[0]], between, cells.centres[pair[1]]])
