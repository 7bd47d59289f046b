"""The patches that every geometric test runs on: each kind, closed and open, posed and plain."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from surfaces import Surface, cylinder, hyperboloid, plane, sphere

POSE = {"position": (0.3, -1.2, 0.7), "rpy_deg": (25.0, -40.0, 110.0)}
PATCHES: dict[str, Surface] = {
    "dome": sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180)),
    "ball": sphere(0.6, polar_deg=(0, 180), azimuth_deg=(-180, 180), side="outside", **POSE),
    "cap": sphere(2.5, polar_deg=(120, 180), azimuth_deg=(200, 560), **POSE),
    "shell": cylinder(0.8, angle_deg=(-60, 100), height=(0, 0.9)),
    "pipe": cylinder(0.2, angle_deg=(90, 450), height=(-3, -1), side="outside", **POSE),
    "horn": hyperboloid(0.5, 0.5, angle_deg=(0, 180), height=(0, 0.5)),
    "tower": hyperboloid(2.0, 3.0, angle_deg=(-180, 180), height=(-4, 1), side="outside", **POSE),
    "flat cone": hyperboloid(0.1, 0.03, angle_deg=(300, 420), height=(0.05, 0.2), **POSE),
    "sheet": plane(width=(0.0, 0.6), length=(-0.4, 0.4)),
    "wall": plane(width=(1, 2), length=(5, 9), side="outside", **POSE),
}


class Samples:
    """Random places on and over one patch."""

    def __init__(self, surface: Surface, count: int = 2000, share: float = 0.45) -> None:
        rng = np.random.default_rng(7)
        self.u = rng.uniform(*surface.u_range, count)
        self.v = rng.uniform(*surface.v_range, count)
        curvature = surface.bounds(0.0).curvature
        reach = share / curvature if curvature > 0 else 1.0
        while not np.isfinite(surface.bounds(0.0, reach / share).curvature):
            reach /= 1.1  # stay where every point has one closest point
        self.height = rng.uniform(-reach, reach, count)
        self.normal = surface.normal(self.u, self.v)
        self.closest_point = surface.point(self.u, self.v)
        self.point = self.closest_point + self.height[:, None] * self.normal


@pytest.fixture(params=PATCHES, ids=str)
def patch(request: pytest.FixtureRequest) -> Surface:
    """One patch after the other."""
    return PATCHES[request.param]


@pytest.fixture
def samples(patch: Surface) -> Samples:
    """Random places over `patch`."""
    return Samples(patch)


@pytest.fixture
def motion() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A rigid motion x -> rotation x + translation."""
    axis = np.array([1.0, -2.0, 0.5]) / math.sqrt(5.25)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = 2.3
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k, np.array([4.0, -3, 2])
