"""`poses`: cells from points with normals, as users have them."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from coverable.errors import Fault, listed, real, shown
from surfaces.arguments import ORIGIN, Checks, metres, table
from surfaces.surface import Side, SurfaceError
from surfaces.toolpaths.arcs import arc_angles
from surfaces.toolpaths.pose_cells import PoseCells
from surfaces.toolpaths.pose_surface import PoseSurface

MOST_POSES = 20_000
MOST_PAIRS = 24  # on average, of each pose
LEAST = 1e-9  # [1], length of a direction
OPPOSITE = np.radians(179.0)
PARALLEL = 1e-3  # sine of the angle of tangent and normal
NAMED = 3  # faults of a kind that are named


def poses(
    points: ArrayLike,
    normals: ArrayLike,
    approaches: ArrayLike | None = None,
    tangents: ArrayLike | None = None,
    neighbours: Literal["order"] | float = "order",
    side: Side = "outside",
    position: Any = ORIGIN,
    rpy_deg: Any = ORIGIN,
) -> PoseCells:
    """Poses as cells: a toolpath, or points with normals, without a surface between them.

    Between neighbours the tool point runs straight, and its direction along the great arc.

    Args:
        points: (N, 3) m, N from 2 to 20,000.
        normals: (N, 3) outward; of any length but zero. Targets lie on them, at the standoff.
        approaches: (N, 3) the tool axis at each pose, whatever the side; None for against the
            normals ('outside') or along them ('inside').
        tangents: (N, 3) from which the roll of the tool is measured, projected onto the planes
            square to the normals; None where it is free.
        neighbours: "order" for a toolpath, which is run from its first pose to its last, never
            back; or a radius in m, within which the tool may move from any pose to any other,
            where their normals differ by less than 90 degrees.
        side: 'outside' for a tool on the side of the normals, 'inside' for one on the other.
        position: see `plane`, as for rpy_deg.

    Raises:
        SurfaceError: one or more of the arguments make no poses; all are named.

    Example:
        >>> line = poses([[0.4, 0.0, 0.3], [0.4, 0.1, 0.3], [0.4, 0.2, 0.3]], [[0, 0, 1]] * 3)
        >>> len(line), line.pairs.tolist()
        (3, [[0, 1], [1, 2]])
    """
    check = Checks("poses")
    own = _points(points, check)
    count = None if own is None else len(own)
    outward = _directions("normals", normals, count, check)
    axes = None if approaches is None else _directions("approaches", approaches, count, check)
    along = None if tangents is None else _directions("tangents", tangents, count, check)
    if along is not None and outward is not None:
        along = _square_to(along, outward, check)
    radius = _radius(neighbours, check)
    pose = check.pose(side, position, rpy_deg)
    pairs = np.empty((0, 2), dtype=np.int64)
    if own is not None and outward is not None and not check.faults:
        pairs = _pairs(own, outward, axes, radius, check)
    check.done()
    if own is None or outward is None:  # cannot be: without them there are faults
        raise SurfaceError("poses: there are none")
    return PoseCells.of(
        PoseSurface(
            points=own,
            outward=outward,
            axes=axes,
            along=along,
            pairs=pairs,
            in_order=radius is None,
            **pose,
        )
    )


def _points(points: Any, check: Checks) -> Array | None:
    """(N, 3) m; None after a fault."""
    expected = "rows of points (x, y, z) in metres, such as 100 x 3"
    given = _listed(points)
    found = metres("points", given, (None, 3), expected, 3 * MOST_POSES, check.faults)
    if found is not None and len(found) < 2:
        got = f"got {len(found)}; a single place is a plane of one cell"
        check.keep(Fault("points", got, expected="must be at least 2 poses"))
        return None
    return found


def _listed(value: Any) -> Any:
    """What `table` reads; arrays of whole numbers or of single precision too."""
    return np.asarray(value, dtype=float) if isinstance(value, np.ndarray) else value


def _directions(name: str, value: Any, count: int | None, check: Checks) -> Array | None:
    """(N, 3) unit vectors; None after a fault."""
    expected = f"rows (x, y, z), one for each point, {count or 'N'} x 3"
    found = table(name, _listed(value), (count, 3), expected, 3 * MOST_POSES, check.faults)
    if found is None:
        return None
    return _unit(name, found, LEAST, Fault("", "got zero", expected="must have a direction"), check)


def _square_to(along: Array, outward: Array, check: Checks) -> Array | None:
    """Tangents without their parts along the normals; None after a fault."""
    if len(along) != len(outward):
        return None  # a fault is kept already
    flat = along - (along * outward).sum(axis=1, keepdims=True) * outward
    fault = Fault("", "got one along the normal", expected="must not be along normals")
    return _unit("tangents", flat, PARALLEL, fault, check)


def _unit(name: str, rows: Array, least: float, fault: Fault, check: Checks) -> Array | None:
    """Rows (N, 3) as unit vectors; None after a fault, of those that are shorter than `least`."""
    length = np.linalg.norm(rows, axis=1)
    short = np.flatnonzero(length < least)
    if len(short):
        check.keep(fault._replace(key=f"{name}{_rows(short)}"))
        return None
    return np.asarray(rows / length[:, None])


def _radius(neighbours: Any, check: Checks) -> float | None:
    """m; None for the order that is given."""
    if isinstance(neighbours, str) and neighbours == "order":
        return None
    radius = real(neighbours)
    if not (np.isfinite(radius) and radius > 0.0):
        check.wrong("neighbours", neighbours, 'must be "order", or a radius in metres > 0')
        return 1.0
    return radius


def _pairs(
    points: Array, outward: Array, axes: Array | None, radius: float | None, check: Checks
) -> Ints:
    """(M, 2) neighbouring poses."""
    if radius is None:
        pairs = np.column_stack([np.arange(len(points) - 1), np.arange(1, len(points))])
    else:
        from scipy.spatial import cKDTree

        tree = cKDTree(points)
        each = (tree.count_neighbors(tree, radius) - len(points)) / len(points)
        if each > MOST_PAIRS:
            got = f"got {shown(radius)}, which gives each pose {each:.0f}; use a smaller one"
            expected = f"must give each pose at most {MOST_PAIRS} neighbours on average"
            check.keep(Fault("neighbours", got, expected=expected))
            return np.empty((0, 2), dtype=np.int64)
        pairs = np.sort(tree.query_pairs(radius, output_type="ndarray").astype(np.int64), axis=1)
        pairs = pairs[(outward[pairs[:, 0]] * outward[pairs[:, 1]]).sum(axis=1) > 0.0]
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    turned = np.zeros(len(pairs), dtype=bool)
    for name, of in (("normals", outward), ("approaches", axes)):
        if of is None:
            continue
        opposite = arc_angles(of[pairs[:, 0]], of[pairs[:, 1]]) > OPPOSITE
        turned |= opposite
        if opposite.any() and radius is None:
            where = f"{name}{_rows(np.flatnonzero(opposite))}"
            got = "got one opposite to the next; put a pose between them"
            expected = "must turn by less than 179 degrees from one to the next"
            check.keep(Fault(where, got, expected=expected))
    return pairs if radius is None else pairs[~turned]


def _rows(rows: Ints) -> str:
    """Some rows as indices, "[3], [5] and 2 more"."""
    return listed([f"[{row}]" for row in rows.tolist()], NAMED)
