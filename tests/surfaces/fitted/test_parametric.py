"""Patches from a user's own formula."""

import math

import numpy as np
import pytest
from user_formulas import EQUAL, ball, ring

from surfaces import SurfaceError, parametric, piecewise


@pytest.mark.parametrize("name", EQUAL)
def test_it_is_the_patch_that_the_formula_is_equal_to(name):
    formula, u, v, patch = EQUAL[name]
    found = parametric(formula, u, v)
    off, leans = found.deviations
    assert 0.0 < off < 3e-7
    assert leans < 1e-5
    mine, exact = found.cells(7, 6), patch.cells(7, 6)
    assert np.linalg.norm(mine.centres - exact.centres, axis=1).max() <= off
    sign = np.sign((mine.normals * exact.normals).sum(axis=1))
    assert (sign == sign[0]).all()
    away = np.linalg.norm(mine.normals - sign[:, None] * exact.normals, axis=1)
    assert away.max() <= leans + 1e-12
    np.testing.assert_allclose(mine.areas, exact.areas, rtol=1e-5)
    assert mine.pairs.tolist() == exact.pairs.tolist()
    # Between the places where it was measured, too.
    some = np.random.default_rng(0).uniform(*zip(u, v, strict=True), size=(2000, 2)).T
    assert np.linalg.norm(found.point(*some) - patch.point(*some), axis=1).max() <= off


def test_bounds_hold_for_the_formula_itself():
    formula, u, v, _ = EQUAL["sphere"]
    found = parametric(formula, u, v)
    low, high = np.array([[u[0], v[0]]]), np.array([[u[0] + 0.2, v[0] + 0.2]])
    wider, spline = found.part_models(low, high), super(type(found), found).part_models(low, high)
    for one, other, more in zip(wider, spline, found.deviations, strict=True):
        assert one.error == pytest.approx(other.error + more, abs=1e-16)


def test_ends_that_meet_smoothly_are_joined_and_those_at_a_kink_are_not():
    whole = parametric(ring, (0, math.tau), (0, math.tau))
    assert (whole.u_closed, whole.v_closed) == (True, True)
    assert len(whole.cells(5, 4).pairs) == 4 * 20

    def leaf(u, v):
        return u * (1 - u), u * (1 - u) * (0.5 - u) + 0.2 * u * (1 - u), v + 0 * u

    kinked = parametric(leaf, (0, 1), (0, 1))
    assert not kinked.u_closed
    assert any("kink" in note for note in kinked.notes)


def test_it_states_its_deviation_and_where_outward_is():
    found = parametric(ball, (0.2, 1.2), (0, 1), side="outside")
    assert "deviates by at most" in found.notes[0]
    middle = found.normal(0.7, 0.5)
    assert f"({middle[0]:.3g}, {middle[1]:.3g}, {middle[2]:.3g})" in found.notes[1]
    assert middle @ found.point(0.7, 0.5) > 0.99
    joined = piecewise([found, parametric(ball, (0.2, 1.2), (1, 2))])
    assert joined.deviations == tuple(
        max(both) for both in zip(*(piece.deviations for piece in joined.pieces), strict=True)
    )


def _once(u, v):
    return math.sin(u), v, v


@pytest.mark.parametrize(
    ("formula", "u", "v", "words"),
    [
        (5, (1, 0), (0, math.nan), ["g must be a function", "u must be", "v must be"]),
        (ball, (0, 1), (0, 1), ["u must stop short of 0, as (0.001, 1) does", "pole"]),
        (lambda u, v: (u, v), (0, 1), (0, 1), ["g returned", "def g(u, v): return"]),
        (lambda u, v: np.zeros((2, 2)), (0, 1), (0, 1), ["shape (2, 2)", "def g(u, v)"]),
        (_once, (0, 1), (0, 1), ["g raised TypeError", "called with two arrays"]),
        (lambda u: u, (0, 1), (0, 1), ["g raised TypeError", "called with two arrays"]),
        (lambda u, v: (u, v, np.log(u)), (-1, 1), (0, 1), ["finite", "(u, v) = (-1, 0)"]),
        (lambda u, v: (u, v, abs(u - 0.3)), (0, 1), (0, 1), ["smooth", "surfaces.piecewise"]),
        (lambda u, v: (u, v, np.sign(u)), (-1, 1), (0, 1), ["smooth"]),
        (lambda u, v: (u + v, 0 * u, 0.0), (0, 1), (0, 1), ["normal everywhere"]),
        (lambda u, v: (0.0, 0.0, 0.0), (0, 1), (0, 1), ["one point all over"]),
        (lambda u, v: (1e9 * u, v, 0.0), (0, 1), (0, 1), ["within 1e+06 metres"]),
    ],
)
def test_what_makes_no_patch_is_refused_with_how_to_call_it(formula, u, v, words):
    with pytest.raises(SurfaceError) as caught:
        parametric(formula, u, v)
    for part in words:
        assert part in str(caught.value)
