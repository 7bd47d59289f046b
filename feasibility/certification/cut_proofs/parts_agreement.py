"""Do the parts of a surface hold the surface? A few hundred of its places are looked up in them.

The parts of `surfaces.parts` and their bounds have an author and tests of their own. A proof rests
on them, so they are compared with what the surface itself says: cell centres, and the surface's
closest points to random points near it. This finds mistakes; it proves nothing.
"""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.cells import Cells
from surfaces.parts import SurfaceParts
from surfaces.places.offset_surfaces import offset_surface

SAMPLES = 300
AT_ONCE = 60  # curves between poses that are looked at
ROUNDING = 1e-9  # [m], [1] that a radius is taken larger by
WITHIN = 2.0  # of (|df| / r_f)^2 + (|dn| / r_n)^2; a common x makes each at most 1


def disagreement(cells: Cells, parts: SurfaceParts) -> str:
    """Where the parts miss the surface, in words; empty where every place tried lies in one."""
    points, normals = places(cells, SAMPLES)
    held = on_a_finest_part(np.concatenate([points, normals], axis=1), parts)
    if held.all():
        return ""
    missed = points[np.argmin(held)].round(4).tolist()
    return (
        f"the surface's bounds do not hold the surface: {int((~held).sum())} of {len(held)} "
        f"places, such as {missed} m, lie on no part"
    )


def places(cells: Cells, samples: int) -> tuple[Array, Array]:
    """Points (m, 3) m of the surface and outward normals (m, 3), cell centres among them.

    Of poses, those of the curves between them.
    """
    rng = np.random.default_rng(0)
    if cells.surface.bare:
        pairs = cells.pairs[rng.integers(len(cells.pairs), size=AT_ONCE)]
        points, normals = cells.trace(pairs, rng.uniform(0.0, 1.0, -(-samples // AT_ONCE)))
        return points.reshape(-1, 3), normals.reshape(-1, 3)
    chosen = rng.integers(len(cells), size=samples)
    size = np.sqrt(cells.areas[chosen])[:, None]
    near = cells.centres[chosen] + size * rng.uniform(-1.0, 1.0, (samples, 3))
    surface = offset_surface(cells.surface, 0.0)
    found = surface.nearest(near, near, np.inf)
    points, normals = surface.at(found.of(found.chart >= 0))
    some = np.linspace(0, len(cells) - 1, min(len(cells), samples)).astype(int)
    return (
        np.concatenate([cells.centres[some], points]),
        np.concatenate([cells.normals[some], normals]),
    )


def on_a_finest_part(places: Array, parts: SurfaceParts) -> Mask:
    """(m,) which places (m, 6), points and normals, lie on some finest part. NaN lies on none."""
    held = np.zeros(len(places), dtype=bool)
    row = np.arange(len(places))
    part = np.zeros(len(places), dtype=np.int64)
    while len(row):
        inside = _may_lie_on(places[row], parts, part)
        row, part = row[inside], part[inside]
        finest = parts.children[part, 0] < 0
        held[row[finest]] = True
        row, part = row[~finest], part[~finest]
        open_still = ~held[row]
        row, part = row[open_still], part[open_still]
        row, part = np.tile(row, 2), parts.children[part].T.reshape(-1)
    return held


def _may_lie_on(places: Array, parts: SurfaceParts, part: Ints) -> Mask:
    """(m,) whether places (m, 6) can lie on parts (m,): least squares over x in [-1, 1]^2."""
    radius = parts.radius[part] + ROUNDING
    scale = 1.0 / np.repeat(radius, 3, axis=1)
    offset = (places - parts.centre[part]) * scale
    slopes = parts.slopes[part] * scale[:, None]
    (a, b), c = (slopes**2).sum(axis=2).T, (slopes[:, 0] * slopes[:, 1]).sum(axis=1)
    along = (slopes * offset[:, None]).sum(axis=2)
    a, b = np.maximum(a, 1e-300), np.maximum(b, 1e-300)
    det = np.maximum(a * b - c * c, 1e-300)
    best = np.full(len(part), np.inf)
    # The least of a convex quadratic over a square is inside, or on one of its four sides.
    inner = np.stack([b * along[:, 0] - c * along[:, 1], a * along[:, 1] - c * along[:, 0]]) / det
    tried = [inner.T]
    for end in (-1.0, 1.0):
        tried.append(np.column_stack([np.full_like(a, end), (along[:, 1] - end * c) / b]))
        tried.append(np.column_stack([(along[:, 0] - end * c) / a, np.full_like(a, end)]))
    for x in tried:
        clipped = np.clip(np.nan_to_num(x), -1.0, 1.0)
        left = offset - (clipped[:, :, None] * slopes).sum(axis=1)
        best = np.fmin(best, (left**2).sum(axis=1))
    return np.asarray(best <= WITHIN)
