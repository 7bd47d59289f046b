"""Do the parts of a surface hold the surface? A few hundred of its places are looked up in them.

The parts of `surfaces.parts` and their bounds have an author and tests of their own. A proof rests
on them, so they are compared with what the surface itself says: cell centres, and the surface's
closest points to random points near it. This finds mistakes; it proves nothing.
"""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.cut_proofs.box_exclusion import nearest, separated
from feasibility.certification.cut_proofs.linear_models import Models
from surfaces.cells import Cells
from surfaces.parts import SurfaceParts
from surfaces.places.offset_surfaces import offset_surface

SAMPLES = 300
SWEEPS = 30  # of the descent to the x that makes a part nearest
AT_ONCE = 60  # curves between poses that are looked at
ROUNDING = 1e-9  # [m], [1] that a radius is taken larger by


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
    points, normals, _ = surface.at(found.of(found.chart >= 0))
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
    """(m,) whether places (m, 6) can lie on parts (m,), as boxes of x in [-1, 1]^2 tell."""
    radius, one = parts.radius[part] + ROUNDING, np.ones((len(part), 2))
    scale = 1.0 / np.repeat(radius, 3, axis=1)  # so that all radii are 1
    away, slopes = scale * (places - parts.centre[part]), scale[:, None] * parts.slopes[part]
    models = Models(away, -slopes, one, -one, one, one)
    known = ~np.isnan(radius).any(axis=1)
    return known & ~separated(models, nearest(models, SWEEPS)[1])
