"""How targets over a mesh lie to its triangles themselves, without interpolated normals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces import Cells


class BesideFacets(NamedTuple):
    """How targets at k places on curves lie to the triangles of a mesh themselves."""

    off: NDArray[np.float64]
    """(k,) m, by how much the target's distance from them is not the standoff."""
    leans: NDArray[np.float64]
    """(k,) |n - m| of the curve's normal n and the direction m from the mesh to the target; on
    the strips along creases only, elsewhere normals are interpolated."""
    away: NDArray[np.float64]
    """(k,) m, the target's distance from them."""


def beside_facets(
    cells: Cells,
    standoff: float,
    tolerance: float,
    curves: NDArray[np.int64],
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
    everywhere: bool,
) -> BesideFacets:
    """Compare targets with the triangles of a mesh, without any interpolation.

    On the strip along a crease, and where normals are interpolated, the targets are nearer to the
    mesh than the standoff. So they are where something stands out of it. Nearer to a crease than
    the tolerance leaves over the standoff, the normal is any of those that meet there.

    Args:
        cells: of a mesh.
        standoff: m.
        tolerance: m, of the tool point.
        curves: (k,) which curves.
        point: (k, 3) m, a place on each of them.
        normal: (k, 3) their normals there.
        everywhere: compare with all of the mesh, which takes long at large standoffs; otherwise
            with the cells of the curve and those that touch both.
    """
    pairs = cells.pairs[curves]
    target = point + cells.surface.side_sign * standoff * normal
    away, direction = cells.distances(pairs, target, everywhere)
    leans = np.zeros(len(point))
    off = np.abs(standoff - away) if standoff > 0.0 else leans
    strip = cells.crease_distances(pairs, point, everywhere)
    some = np.isfinite(strip) & (strip >= tolerance - standoff)
    leans[some] = np.linalg.norm(normal[some] - direction[some], axis=1)
    return BesideFacets(off, leans, away)
