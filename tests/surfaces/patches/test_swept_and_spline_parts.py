"""Parts of surfaces of revolution and of splines, and the bounds that they rest on."""

from dataclasses import replace

import numpy as np
import pytest
from part_walks import stated_over_least, walk_all_over
from smooth_probes import POSE
from spline_nets import TURN_KNOTS, full_turn, hood, turned

from surfaces import bspline, revolution
from surfaces.patches.nurbs.bernstein import changed, elevated, part_matrices, product
from surfaces.patches.profile import largest_between, running_largest

RNG = np.random.default_rng(11)
VASE = [(0.2, 0.0), (0.35, 0.2), (0.15, 0.5), (0.25, 0.7)]
BOWL = [(0.0, -0.4), (0.2, -0.35), (0.4, -0.1), (0.45, 0.1)]
HEIGHT = np.linspace(0.0, 1.0, 200)
WAVES = np.column_stack([0.3 + 0.03 * np.sin(20.0 * HEIGHT), HEIGHT])
RIPPLES = np.column_stack([0.3 + 0.001 * np.sin(20.0 * HEIGHT), HEIGHT])
BARREL, BARREL_WEIGHTS = turned([(0.3, 0), (0.5, 0.5), (0.2, 1)], [1, 2, 1], *full_turn())
WEIGHTS = 10.0 ** RNG.uniform(-1.0, 1.0, (6, 7))
TWICE = np.array([0, 0, 0, 0, 0.5, 0.5, 1, 1, 1, 1])

PATCHES = {
    "vase": revolution(VASE, angle_deg=(0, 360), **POSE),
    "bowl": revolution(BOWL, angle_deg=(-180, 180), side="outside"),
    "waves": revolution(WAVES, angle_deg=(10, 70)),
    "ripples": revolution(RIPPLES, angle_deg=(10, 12), **POSE),
    "ripples on a disc": revolution(RIPPLES[:, ::-1] + [0.1, 0.0], angle_deg=(10, 12)),
    "hood": bspline(hood(), **POSE),
    "weights from 0.1 to 10": bspline(hood(), weights=WEIGHTS, side="outside", **POSE),
    "a part of degree 5": bspline(hood(9, 8), degree=(5, 2), u=(0.21, 0.77), v=(0.1, 0.5)),
    "barrel": bspline(BARREL, (2, 2), (TURN_KNOTS, None), BARREL_WEIGHTS, **POSE),
    "double knots": bspline(hood(6, 6), knots=(TWICE, None)),
    "bilinear": bspline([[(x, y, x * y) for y in (0, 1)] for x in (0, 1)], degree=(1, 1)),
    "far away": bspline(hood() + 1e3, weights=WEIGHTS),
}


@pytest.fixture(params=PATCHES, ids=str)
def patch(request):
    return PATCHES[request.param]


def test_every_place_lies_in_the_model_of_each_part_that_it_lies_on(patch):
    parts = patch.parts(3e-3, 0.05, 1000)
    walked = walk_all_over(patch, parts)
    assert max(walked.points, walked.normals) <= 1.0
    shrunk = walk_all_over(patch, replace(parts, radius=0.8 * parts.radius))
    assert max(shrunk.points, shrunk.normals) > 1.0


def test_radii_over_small_boxes_are_right_and_near_the_least_possible(patch):
    """No affine model leaves less than a quarter of the bound, over small boxes."""
    ratios = stated_over_least(patch, 1e-9)
    assert np.median(ratios) <= 2.0
    assert max(ratios) <= 4.0


def test_products_and_parts_of_polynomials_are_their_values():
    rng = np.random.default_rng(5)
    one, other = rng.normal(size=(3, 4, 2, 3)), rng.normal(size=(3, 2, 5, 1))
    low, high = rng.uniform(0.0, 0.5, 3), rng.uniform(0.5, 1.0, 3)

    def at(nets, k, u, v):
        net = nets[k]
        for share in (u, v):
            while len(net) > 1:
                net = (1.0 - share) * net[:-1] + share * net[1:]
            net = net[0]
        return net

    both, higher = product(one, other), elevated(one, (5, 4))
    inner = changed(one, np.eye(4), part_matrices(1, low, high))
    for k in range(3):
        u, v = rng.uniform(size=2)
        assert at(both, k, u, v) == pytest.approx(at(one, k, u, v) * at(other, k, u, v))
        there = low[k] + v * (high[k] - low[k])
        assert at(higher, k, u, v) == pytest.approx(at(one, k, u, v))
        assert at(inner, k, u, v) == pytest.approx(at(one, k, u, there))


def test_the_largest_of_a_run():
    values = RNG.normal(size=(37, 2))
    begin, end = np.triu_indices(37, 1)
    levels = running_largest(np.abs(values))
    expected = [np.abs(values[a:b]).max(axis=0) for a, b in zip(begin, end, strict=True)]
    assert (largest_between(levels, begin, end) == expected).all()
    assert (largest_between(levels, begin, begin) == 0.0).all()
