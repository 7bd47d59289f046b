"""The task applied to the parts of a surface: where tool point and axis have to be, all over it."""

from __future__ import annotations

from functools import lru_cache

from coverable.arrays import unit_along
from feasibility.task import Direction
from surfaces.parts import SurfaceParts
from surfaces.surface import Surface

MOST = 8192


# A search is often run again; surfaces are values, compared by identity.
@lru_cache(maxsize=4)
def target_parts(
    surface: Surface,
    standoff: float,
    flat: float,
    straight: float,
    most: int = MOST,
    approach: Direction | None = None,
) -> SurfaceParts:
    """The tree of parts of target points T = f + s d n and approach directions b = -s n.

    f and n follow one model with the same x, so T follows that of f, shifted by s d times that of
    n, within r_f + d r_n. An approach that is one direction is that, everywhere.

    Args:
        surface: that of the cells; s is its `side_sign`.
        standoff: d, m.
        flat: m > 0, the largest radius of target points on the finest parts.
        straight: > 0, the largest radius of directions.
        most: how many parts may be made.
        approach: in the surface's own frame, where it is not the normal.

    Returns:
        The same parts as `Surface.parts` has, with targets (m) in the place of points and approach
        directions in that of normals.

    Example:
        >>> from coverable import sphere
        >>> dome = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(0, 90))
        >>> parts = target_parts(dome, standoff=0.005, flat=1e-3, straight=0.1)
        >>> finest = parts.children[:, 0] < 0
        >>> float(parts.radius[finest, 0].max()) <= 1e-3
        True
    """
    bent = min(straight, flat / (2.0 * standoff)) if standoff > 0.0 else straight
    parts = surface.parts(flat - standoff * bent, bent, most)
    sign = surface.side_sign
    centre, slopes, radius = parts.centre.copy(), parts.slopes.copy(), parts.radius.copy()
    for array in (centre, slopes):
        array[..., :3] += sign * standoff * array[..., 3:]
        array[..., 3:] *= -sign
    radius[:, 0] += standoff * radius[:, 1]
    if approach is not None:
        centre[..., 3:] = surface.rotation @ unit_along(approach)
        slopes[..., 3:] = radius[:, 1] = 0.0
    return SurfaceParts(centre, slopes, radius, parts.children, parts.axis)
