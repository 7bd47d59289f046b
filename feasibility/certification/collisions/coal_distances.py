"""Coal's distances of two pieces."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.collisions.pieces import Piece

Array = NDArray[np.float64]

COAL = 1e-6  # [m] more than coal's distances are off, which stops at GJK = 1e-8
GJK = 1e-8  # [m]


@cache
def _coal() -> tuple[Any, Any, Any]:
    """Coal's module, and a request that keeps to its tolerances."""
    import coal

    request = coal.DistanceRequest()
    request.enable_signed_distance, request.gjk_tolerance = True, GJK
    return coal, request, coal.DistanceResult


def coal_distance(a: Piece, b: Piece, rotation: Array, point: Array) -> tuple[float, Array, Array]:
    """Coal's distance (m) of two pieces, b at a pose in the frame of a, and its nearest points."""
    coal, request, result_of = _coal()
    result = result_of()
    pose_a = coal.Transform3s(a.placement[:3, :3], a.placement[:3, 3])
    turned = rotation @ b.placement[:3, :3]
    pose_b = coal.Transform3s(turned, rotation @ b.placement[:3, 3] + point)
    distance = coal.distance(a.geometry, pose_a, b.geometry, pose_b, request, result)
    return float(distance), result.getNearestPoint1(), result.getNearestPoint2()
