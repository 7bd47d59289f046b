"""Curves over the new kinds: from centre to centre on the surface, across seams and poles too."""

import math

import numpy as np
import pytest
from smooth_probes import assert_curves_lie_on
from spline_nets import TURN_KNOTS, full_turn, hood, turned

from surfaces import bspline, cone, ellipsoid, revolution, torus


def nurbs_pipe():
    points, weights = turned([[0.5, -0.2], [0.5, 0.6]], [1, 1], *full_turn())
    return bspline(points, (2, 1), (TURN_KNOTS, None), weights, u=(0.0, 1.0))


PATCHES = {
    "cone": cone(0.5, -0.25, angle_deg=(-180, 180), height=(-0.3, 1.5)),
    "torus": torus(0.5, 0.2, u_deg=(-180, 180), v_deg=(0, 360), side="outside"),
    "ellipsoid": ellipsoid((0.5, 0.6, 0.9), polar_deg=(0, 180), azimuth_deg=(10, 370)),
    "bowl": revolution([(0.0, -0.4), (0.2, -0.35), (0.4, -0.1), (0.45, 0.1)], angle_deg=(0, 360)),
    "hood": bspline(hood(), side="outside"),
    "pipe": nurbs_pipe(),
}


@pytest.mark.parametrize("name", PATCHES, ids=str)
def test_curves_run_on_the_surface_and_the_short_way(name):
    patch = PATCHES[name]
    cells = patch.cells(6, 9)
    curves = cells.curves
    ends = assert_curves_lie_on(patch, curves)
    assert curves.deviations.max() < 2e-5
    assert ends[:, 0] == pytest.approx(cells.centres[cells.pairs[:, 0]], abs=1e-14)
    assert ends[:, -1] == pytest.approx(cells.centres[cells.pairs[:, 1]], abs=1e-14)
    # No curve goes the long way round: it is at most as long as half a circle on its chord.
    travel = np.linalg.norm(np.diff(ends, axis=1), axis=2).sum(axis=1)
    chord = np.linalg.norm(ends[:, -1] - ends[:, 0], axis=1)
    assert (travel <= math.pi / 2 * chord).all()
    assert not curves.folds(0.005 * patch.side_sign).any()


@pytest.mark.parametrize("name", ["cone", "torus", "hood"])
@pytest.mark.parametrize("shape", [(1, 14), (14, 1)], ids=str)
def test_a_single_row_counts_the_bend_to_its_side(name, shape):
    """No other curve shows how sharply the surface bends across these."""
    assert_curves_lie_on(PATCHES[name], PATCHES[name].cells(*shape).curves)


@pytest.mark.parametrize("name", PATCHES, ids=str)
def test_the_max_curvature_is_the_largest_of_many_directions(name):
    """Of 90 short steps in all directions from each centre."""
    patch = PATCHES[name]
    cells = patch.cells(4, 5)
    angle = np.linspace(0.0, math.pi, 90, endpoint=False)
    widths = [np.ptp(patch.u_range), np.ptp(patch.v_range)]
    best = np.zeros(len(cells))
    for scale in (0.1, 1.0, 10.0):  # of parameters, whose units differ
        du = 1e-5 * widths[0] * np.cos(angle) * scale
        dv = 1e-5 * widths[1] * np.sin(angle)
        u, v = cells.u[:, None], cells.v[:, None]
        turn = patch.normal(u + du, v + dv) - patch.normal(u - du, v - dv)
        step = patch.point(u + du, v + dv) - patch.point(u - du, v - dv)
        rates = np.linalg.norm(turn, axis=2) / np.linalg.norm(step, axis=2)
        best = np.maximum(best, rates.max(axis=1))
    assert (best <= cells.max_curvature * (1 + 1e-3) + 1e-6).all()
    assert (best >= cells.max_curvature * 0.97 - 1e-6).all()
