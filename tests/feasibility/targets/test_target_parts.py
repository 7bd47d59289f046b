"""Targets and approaches of a task, on the parts of a surface."""

import numpy as np
import pytest
from part_walks import at_parameters, spread, walk

from feasibility.targets import target_parts
from surfaces import cylinder, hyperboloid, plane, sphere

PATCHES = {
    "dome": sphere(1.0, (10, 90), (10, 180)),
    "horn": hyperboloid(0.5, 0.5, (0, 180), (0, 0.5), side="outside"),
    "pipe": cylinder(0.2, (0, 360), (0, 1), side="outside", position=(1, 2, 3), rpy_deg=(9, 8, 7)),
    "wall": plane((0, 1), (0, 1)),
}


@pytest.mark.parametrize("standoff", [0.0, 0.005, 0.3])
@pytest.mark.parametrize("name", PATCHES)
def test_targets_and_approaches_lie_in_their_parts(name, standoff):
    surface = PATCHES[name]
    parts = target_parts(surface, standoff, flat=0.004, straight=0.05)
    u, v = spread(surface, 3000)
    _, x = at_parameters(surface, u, v)
    sign, normal = surface.side_sign, surface.normal(u, v)
    targets = surface.point(u, v) + sign * standoff * normal
    used = walk(parts, np.zeros(len(u), dtype=int), x, targets, -sign * normal)
    assert max(used.points, used.normals) <= 1.0
    finest = parts.radius[used.finest]
    assert (finest <= [0.004, 0.05]).all()
