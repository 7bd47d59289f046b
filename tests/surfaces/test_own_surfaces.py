"""The page on surfaces of one's own: what it writes runs, and its two ways agree."""

import re
from pathlib import Path

import numpy as np
import pytest

from surfaces import SurfaceError, sheet_of
from surfaces.places import Places, offset_surface

PAGE = Path(__file__).parents[2] / "docs" / "own_surfaces.md"


@pytest.fixture(scope="module")
def names():
    found = {}
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S):
        exec(compile(block, PAGE.name, "exec"), found)
    return found


def test_the_class_of_the_page_is_the_surface_of_its_formula(names):
    formula, own = names["cells"], names["same"]
    np.testing.assert_allclose(own.centres, formula.centres, atol=1e-12)
    np.testing.assert_allclose(own.normals, formula.normals, atol=1e-12)
    np.testing.assert_allclose(own.areas, formula.areas, rtol=1e-9)
    points = np.random.default_rng(0).uniform([-0.1, 0.1, 0.0], [0.1, 0.5, 0.2], (200, 3))
    mine, spline = names["own"].closest(points), names["formula"].closest(points)
    np.testing.assert_allclose(mine.height, spline.height, atol=1e-12)
    assert mine.inside.all()


def test_a_kind_that_says_no_more_of_itself_is_followed_but_not_bounded(names):
    own = names["own"]
    assert np.abs(own.cells(6, 8).curves.deviations[:, 0]).max() < 1e-6
    with pytest.raises(SurfaceError, match="no bounds are known"):
        sheet_of(own)
    offset = offset_surface(own, 0.01)
    points = own.point([0.0, 0.01], [0.3, 0.3])
    places = offset.nearest(points, points, 1e-3)
    # The bounds along a path are measured: twice the second differences, which is no proof.
    measured = offset.paths(places.of([0]), places.of([1])).derivative_bounds[0, 2]
    t = np.linspace(0.0, 0.01, 41)
    line = offset.at(Places(np.zeros(41, dtype=int), np.column_stack([t, np.full(41, 0.3)])))
    for some, bound in zip(line, measured.tolist(), strict=True):
        second = np.linalg.norm(np.diff(some, 2, axis=0), axis=1).max() * 40**2
        assert 1.5 * second < bound < 3.0 * second
