"""Courses over the new kinds: from centre to centre on the surface, across seams and poles too."""

import math

import numpy as np
import pytest
from spline_nets import TURN_KNOTS, full_turn, hood, turned

from surfaces.cone import cone
from surfaces.courses import courses_of
from surfaces.ellipsoid import ellipsoid
from surfaces.revolution import revolution
from surfaces.spline import bspline
from surfaces.torus import torus


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
def test_courses_run_on_the_surface_and_the_short_way(name):
    patch = PATCHES[name]
    cells = patch.cells(6, 9)
    courses = courses_of(cells)
    pair = np.repeat(np.arange(len(cells.pairs)), 21)
    t = np.tile(np.linspace(0, 1, 21), len(cells.pairs))
    foot, normal = courses.at(pair, t)
    on = patch.closest(foot)
    assert on.inside.all()
    assert (np.abs(on.height) <= courses.strays[pair, 0] + 1e-12).all()
    # The foot's own normal may lie across the course, where the surface bends more than along it.
    apart = np.linalg.norm(normal - on.normal, axis=1)
    assert (apart <= courses.strays[pair, 1] + 1e-12).all()
    assert courses.strays.max() < 2e-5
    ends = foot.reshape(-1, 21, 3)
    assert ends[:, 0] == pytest.approx(cells.centres[cells.pairs[:, 0]], abs=1e-14)
    assert ends[:, -1] == pytest.approx(cells.centres[cells.pairs[:, 1]], abs=1e-14)
    # No course goes the long way round: it is at most as long as half a circle on its chord.
    travel = np.linalg.norm(np.diff(ends, axis=1), axis=2).sum(axis=1)
    chord = np.linalg.norm(ends[:, -1] - ends[:, 0], axis=1)
    assert (travel <= math.pi / 2 * chord).all()
    assert not courses.folds(0.005 * patch.side_sign).any()
