"""The curves between poses as parts with rigorous bounds, as surfaces have them.

Between two poses the point runs straight, which is its own affine model. The normal turns evenly
along the great arc: over half an angle h about a direction m, towards w square to it, it is
cos(t) m + sin(t) w, |t| <= h, and so within the arc's errors of C m + S (t / h) w
(`surfaces.patches.affine_models`). The second parameter of these parts changes nothing.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from surfaces.part_growth import Boxes, grown
from surfaces.parts import PartModels, SurfaceParts
from surfaces.patches import arc
from surfaces.toolpaths.arcs import arc_angles, arc_at

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def curve_parts(
    points: Array, normals: Array, pairs: Ints, flat: float, straight: float, most: int
) -> SurfaceParts:
    """The tree of the parts of all curves.

    Args:
        points: (N, 3) m.
        normals: (N, 3) unit.
        pairs: (M, 2) M at least 1, between which poses curves run.
        flat: m, the largest r_f wanted.
        straight: the largest r_n wanted.
        most: how many parts may be made.
    """
    count = len(pairs)
    bounds = partial(_models, points[pairs], normals[pairs])
    whole = Boxes(bounds, np.arange(count), np.zeros((count, 2)), np.ones((count, 2)))
    return grown(whole, flat, straight, most)


def _models(points: Array, normals: Array, which: Ints, low: Array, high: Array) -> PartModels:
    """Models of pieces of courses between points and normals (M, 2, 3): low to high of each."""
    middle, half = 0.5 * (low + high)[:, 0], 0.5 * (high - low)[:, 0]
    start, end = points[which, 0], points[which, 1]
    way = end - start
    ends = normals[which, 0], normals[which, 1]
    angle = arc_angles(*ends)
    mean, slope = arc_at(*ends, middle)
    ahead = slope / np.maximum(angle, 1e-300)[:, None]
    turned = arc(half * angle)
    count = len(which)
    slopes = np.zeros((count, 2, 6))
    slopes[:, 0, :3] = half[:, None] * way
    slopes[:, 0, 3:] = turned.slope[:, None] * ahead
    error = turned.bow + turned.sway
    radius = np.column_stack([np.zeros(count), error])
    along = np.zeros((count, 2, 2))
    along[:, 0] = radius
    centre = np.hstack([start + middle[:, None] * way, turned.mean[:, None] * mean])
    return PartModels(centre, slopes, radius, along)
