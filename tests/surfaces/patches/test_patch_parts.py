"""Parts of patches: every place lies in the model of each part that it lies on."""

from dataclasses import replace

import numpy as np
import pytest
from part_walks import stated_over_least, walk_all_over
from smooth_probes import POSE

from surfaces import cone, cylinder, ellipsoid, hyperboloid, plane, sphere, torus

PATCHES = {
    "wall": plane((-0.2, 0.6), (5.0, 9.0), **POSE),
    "dome": sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180)),
    "ball": sphere(0.6, polar_deg=(0, 180), azimuth_deg=(-180, 180), side="outside", **POSE),
    "shell": cylinder(0.8, angle_deg=(-60, 100), height=(0, 0.9)),
    "pipe": cylinder(0.2, angle_deg=(90, 450), height=(-3, -1), **POSE),
    "horn": hyperboloid(0.5, 0.5, angle_deg=(0, 180), height=(0, 0.5)),
    "trumpet": hyperboloid(0.01, 0.001, angle_deg=(0, 360), height=(-0.7, 1.0), **POSE),
    "almost a pipe": hyperboloid(0.3, 3000.0, angle_deg=(0, 360), height=(0.1, 1.0)),
    "funnel": cone(0.2, 1.0, angle_deg=(0, 360), height=(-0.1, 0.4), **POSE),
    "needle": cone(0.2, 1.0, angle_deg=(0, 360), height=(-0.199999, 0.4)),
    "disc": cone(0.5, -400.0, angle_deg=(200, 300), height=(-0.002, 0.001), **POSE),
    "doughnut": torus(0.5, 0.2, u_deg=(-180, 180), v_deg=(0, 360), side="outside", **POSE),
    "wire": torus(0.5, 0.0005, u_deg=(0, 360), v_deg=(0, 360)),
    "fat ring": torus(0.5, 0.4999, u_deg=(0, 360), v_deg=(90, 270)),
    "egg": ellipsoid((0.5, 0.6, 0.9), polar_deg=(0, 180), azimuth_deg=(10, 370), **POSE),
    "coin": ellipsoid((1.0, 0.8, 0.01), polar_deg=(0, 180), azimuth_deg=(-100, 260)),
    "cigar": ellipsoid((2.0, 0.1, 0.1), polar_deg=(0, 160), azimuth_deg=(30, 150), **POSE),
}
FLAT, STRAIGHT, MOST = 2e-3, 0.05, 3000


@pytest.fixture(params=PATCHES, ids=str)
def patch(request):
    return PATCHES[request.param]


def test_every_place_lies_in_the_model_of_each_part_that_it_lies_on(patch):
    parts = patch.parts(FLAT, STRAIGHT, MOST)
    used = walk_all_over(patch, parts)
    assert max(used.points, used.normals) <= 1.0


def test_a_smaller_radius_would_be_wrong(patch):
    """So the test above can fail, and the bounds are not far from what they have to be."""
    parts = patch.parts(FLAT, STRAIGHT, MOST)
    if patch.kind == "plane":
        assert parts.radius.max() < 2e-12
        return
    used = walk_all_over(patch, replace(parts, radius=0.8 * parts.radius))
    assert used.points > 1.0
    assert used.normals > 1.0


def test_parts_are_cut_until_they_are_as_flat_as_asked_or_as_many_as_allowed(patch):
    for most in (1, 2, 3, 100, MOST):
        parts = patch.parts(FLAT, STRAIGHT, most)
        assert len(parts) <= most
        finest = parts.radius[parts.children[:, 0] < 0]
        rough = (finest > [FLAT, STRAIGHT]).any()
        assert not rough or len(parts) + 2 > most


def test_the_tree_is_one(patch):
    parts = patch.parts(FLAT, STRAIGHT, MOST)
    inner = parts.children[:, 0] >= 0
    children = parts.children[inner].ravel()
    assert np.sort(children).tolist() == list(range(1, len(parts)))
    assert (parts.children[inner] > np.flatnonzero(inner)[:, None]).all()
    assert (parts.children[~inner] == -1).all()
    assert np.isfinite(parts.radius).all()


def test_radii_fall_by_four_where_sides_are_halved(patch):
    coarse, fine = (patch.parts(flat, 1e9, 30_000) for flat in (4e-3, 1e-3))
    if patch.kind != "plane":
        assert len(fine) < 7 * len(coarse)


def test_radii_over_small_boxes_are_right_and_near_the_least_possible(patch):
    """No affine model leaves less than a third of the bound, over small boxes."""
    ratios = stated_over_least(patch, 1e-12)
    assert np.median(ratios) <= 2.0
    assert max(ratios) <= 3.0
