"""Curves over tight bends: within their deviations, and not backwards far above."""

import mesh_patches
import numpy as np
import pytest

from surfaces.meshes import TriangleMesh, mesh


def over_the_bend(cells):
    """Curves that turn by more than 30 degrees."""
    normals = cells.normals[cells.pairs]
    return np.flatnonzero((normals[:, 0] * normals[:, 1]).sum(axis=1) < np.cos(np.radians(30)))


@pytest.mark.parametrize(
    ("radius", "facets", "deviation"), [(0.006, 20, 0.02), (0.006, 5, 0.015), (0.02, 5, 0.006)]
)
def test_ways_over_a_bend_stay_as_near_to_the_surface_as_they_say(radius, facets, deviation):
    """Against the closest point of all of the surface, anywhere on the curve."""
    cells = mesh(TriangleMesh(*mesh_patches.folded_sheet(radius, facets))).cells(60)
    curves, which = cells.curves, over_the_bend(cells)
    assert len(which) >= 5
    t = np.random.default_rng(0).uniform(size=300)
    pair = np.repeat(which, len(t))
    closest_point, normal = curves.at(pair, np.tile(t, len(which)))
    on = cells.surface.closest(closest_point)
    assert (np.abs(on.height) <= curves.deviations[pair, 0] + 1e-9).all()
    assert (np.linalg.norm(normal - on.normal, axis=1) <= curves.deviations[pair, 1]).all()
    # At an even pace over the surface: 0.24, 0.07 and 0.025.
    assert np.median(curves.deviations[which, 1]) < deviation


@pytest.mark.parametrize(("radius", "facets"), [(0.006, 20), (0.02, 20)])
def test_a_target_far_above_a_bend_runs_forwards(radius, facets):
    cells = mesh(TriangleMesh(*mesh_patches.folded_sheet(radius, facets))).cells(60)
    curves, which = cells.curves, over_the_bend(cells)
    some = which[curves.deviations[which, 1] < 0.03]
    assert len(some) > 0.8 * len(which)
    assert not curves.folds(0.15)[some].any()
    assert curves.folds(-2.0 * radius)[some].any()  # on the concave side
