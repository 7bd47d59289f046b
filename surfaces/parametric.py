"""Constructors of sphere, cylinder, hyperboloid and plane patches, from numbers they check."""

from __future__ import annotations

from collections.abc import Sequence

from surfaces.checks import Checks
from surfaces.shapes import Cylinder, Hyperboloid, Plane, Sphere
from surfaces.surface import Side

Pair = Sequence[float]

_ORIGIN = (0.0, 0.0, 0.0)


def sphere(
    radius: float,
    polar_deg: Pair,
    azimuth_deg: Pair,
    side: Side = "inside",
    position: Pair = _ORIGIN,
    rpy_deg: Pair = _ORIGIN,
) -> Sphere:
    """A patch of a sphere.

    Args:
        radius: m.
        polar_deg: (low, high) angle from +z, within 0..180.
        azimuth_deg: (low, high) angle about z, at most a full turn apart.
        side: 'inside' or 'outside', where the tool works.
        position: (3,) m, the centre in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.

    Example:
        >>> dome = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180))
        >>> dome.closest([0.0, 0.5, 0.0]).height.item()
        -0.5
    """
    check = Checks("sphere")
    made = Sphere(
        u_range=check.polar("polar_deg", polar_deg),
        v_range=check.angles("azimuth_deg", azimuth_deg),
        radius=check.positive("radius", radius),
        side=check.side(side),
        position=check.vector("position", position, "metres"),
        rotation=check.rotation("rpy_deg", rpy_deg),
    )
    check.done()
    return made


def cylinder(
    radius: float,
    angle_deg: Pair,
    height: Pair,
    side: Side = "inside",
    position: Pair = _ORIGIN,
    rpy_deg: Pair = _ORIGIN,
) -> Cylinder:
    """A patch of a cylinder about the z axis of its own frame.

    Args:
        radius: m.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        height: (low, high) along z, m.
        side: 'inside' or 'outside', where the tool works.
        position: (3,) m, origin of the surface's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("cylinder")
    made = Cylinder(
        u_range=check.angles("angle_deg", angle_deg),
        v_range=check.interval("height", height),
        radius=check.positive("radius", radius),
        side=check.side(side),
        position=check.vector("position", position, "metres"),
        rotation=check.rotation("rpy_deg", rpy_deg),
    )
    check.done()
    return made


def hyperboloid(
    waist: float,
    flare: float,
    angle_deg: Pair,
    height: Pair,
    side: Side = "inside",
    position: Pair = _ORIGIN,
    rpy_deg: Pair = _ORIGIN,
) -> Hyperboloid:
    """A patch of a hyperboloid of one sheet, r(z) = waist sqrt(1 + (z / flare)^2).

    Args:
        waist: m, radius at z = 0.
        flare: m, height at which the radius is sqrt(2) waist.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        height: (low, high) along z, m.
        side: 'inside' or 'outside', where the tool works.
        position: (3,) m, origin of the surface's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("hyperboloid")
    waist, flare = check.positive("waist", waist), check.positive("flare", flare)
    check.ratio("waist / flare", waist / flare, "beyond that use a cylinder or a plane")
    made = Hyperboloid(
        u_range=check.angles("angle_deg", angle_deg),
        v_range=check.interval("height", height),
        waist=waist,
        flare=flare,
        side=check.side(side),
        position=check.vector("position", position, "metres"),
        rotation=check.rotation("rpy_deg", rpy_deg),
    )
    check.done()
    return made


def plane(
    width: Pair,
    length: Pair,
    side: Side = "inside",
    position: Pair = _ORIGIN,
    rpy_deg: Pair = _ORIGIN,
) -> Plane:
    """A rectangle in the xy plane of its own frame, its normal +z.

    Args:
        width: (low, high) along x, m.
        length: (low, high) along y, m.
        side: 'outside' for a tool on the +z side, 'inside' for one on the -z side.
        position: (3,) m, origin of the surface's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("plane")
    made = Plane(
        u_range=check.interval("width", width),
        v_range=check.interval("length", length),
        side=check.side(side),
        position=check.vector("position", position, "metres"),
        rotation=check.rotation("rpy_deg", rpy_deg),
    )
    check.done()
    return made
