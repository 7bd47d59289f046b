"""Formulas of u and v over boxes hold what they give at numbers; what is not known is infinite."""

import numpy as np
import pytest
from bounds import holds
from samples import sampled, seeds

from coverable import Patch, SurfaceError
from surfaces import bernstein
from surfaces.enclosure_functions import FUNCTIONS, UFUNCS, Enclosure
from surfaces.patches.box_models import VectorModel, over_boxes
from surfaces.slopes import Slope

Z = np.array([1.0, 2.0, 3.0])
# Of u and v in 0.2 .. 2, and over what they are smooth.
FORMULAS = {
    np.add: lambda u, v: u + v * 0.5 + u * u,
    np.subtract: lambda u, v: 1.0 - u * v - 2.0,
    np.negative: lambda u, v: -u * v,
    np.positive: lambda u, v: +u * v,
    np.multiply: lambda u, v: u * (v - 1.0) * (u + v) * u * v * v * (u - v) * v,
    np.divide: lambda u, v: (u - v) / (u + v * v) + u / (-3.0 - v) + u / 2.0,
    np.reciprocal: lambda u, v: np.reciprocal(u * v),
    np.square: lambda u, v: np.square(u - v),
    np.power: lambda u, v: u**3 + v**-2 + (u * v) ** 0.3 + u**0.5 + u**v + (u - v) ** 0 + v**-1.5,
    np.float_power: lambda u, v: np.float_power(u, 2.0) * v,
    np.sqrt: lambda u, v: np.sqrt(u * v + v),
    np.absolute: lambda u, v: abs(u * v) + abs(-u - v) + abs(u - 3.0),
    np.hypot: lambda u, v: np.hypot(u, 1.0 - v * u),
    np.sin: lambda u, v: np.sin(2.0 * u * v),
    np.cos: lambda u, v: np.cos(u - 3.0 * v) * u,
    np.tan: lambda u, v: np.tan(0.5 * u * v - 0.7),
    np.exp: lambda u, v: np.exp(u - v),
    np.log: lambda u, v: np.log(u + v) * v,
    np.sinh: lambda u, v: np.sinh(u * v - 1.0),
    np.cosh: lambda u, v: np.cosh(u - v),
    np.tanh: lambda u, v: np.tanh(u * v),
    np.arctan: lambda u, v: np.arctan(2.0 * u - v),
    np.arctan2: lambda u, v: np.arctan2(u - 3.0, v - 1.1) + np.arctan2(v, u) + np.arctan2(u, -v),
    np.arcsin: lambda u, v: np.arcsin(0.4 * u - 0.1 * v),
    np.arccos: lambda u, v: np.arccos(0.1 * u * v - 0.3),
    np.radians: lambda u, v: np.radians(u) * v,
    np.deg2rad: lambda u, v: np.deg2rad(u * v),
    np.stack: lambda u, v: np.stack([u, v, v * u], axis=-1)[..., 1:].sum(axis=-1),
    np.concatenate: lambda u, v: np.concatenate(
        [u[..., None], (v * u)[..., None]], axis=-1)[..., 1],
    np.linalg.norm: lambda u, v: np.linalg.norm(np.stack([u, v, u * v], axis=-1), axis=-1),
    np.cross: lambda u, v: np.cross(np.stack([u, v, u], axis=-1), Z)[..., 2],
    np.sum: lambda u, v: np.sum(np.stack([u, v * v], axis=-1), axis=-1),
    np.zeros_like: lambda u, v: np.zeros_like(u) + v * v,
    np.ones_like: lambda u, v: np.ones_like(u) * u * v,
    np.full_like: lambda u, v: np.full_like(u, 0.5) * u * u,
    np.broadcast_arrays: lambda u, v: np.broadcast_arrays(u, v)[0] * u,
}  # fmt: skip
INNER = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 2))
X = np.concatenate([INNER, [[a, b] for a in (-1, 0, 1) for b in (-1, 0, 1)]])


def boxes(rng, count, widest):
    half = 0.9 * 10.0 ** rng.uniform(-4, np.log10(widest), (count, 2))
    middle = rng.uniform(0.2 + half, 2.0 - half)
    return middle - half, middle + half


def test_every_function_is_asked():
    assert {*UFUNCS} | {*FUNCTIONS} == {*FORMULAS}


@sampled("seed", seeds(1, all=150))
@pytest.mark.parametrize("function", FORMULAS, ids=lambda f: f.__name__)
def test_formulas_over_boxes_hold_their_values(function, seed):
    formula, rng = FORMULAS[function], np.random.default_rng(seed)
    for widest in (0.02, 1.0):
        low, high = boxes(rng, 100, widest)
        places = 0.5 * (low + high)[:, None] + 0.5 * X * (high - low)[:, None]
        values = formula(*np.moveaxis(places, 2, 0))

        def three(u, v):
            found = np.stack([formula(u, v), 0.0, 0.0], axis=-1)
            return found, found

        found, _ = over_boxes(three, low, high)
        model = found.centre[:, None, 0] + np.einsum("gc,kc->kg", X, found.slopes[..., 0])
        assert not np.isnan(found.radius).any()
        off, stated = np.abs(values - model), found.radius[:, :1] + 1e-15
        bent = stated[:, 0] > 1e-9
        holds(stated, off, used=0.0, tiny=1e-14)
        if widest < 1.0:
            assert np.isfinite(stated).all()
            assert not bent.any() or (off / stated)[bent].max() > 0.9


def at(net, x):
    """(len(x), k) values of a net at places (k', 2)."""
    by_u, by_v = (bernstein.values_at(x[:, k], net.shape[k]) for k in (0, 1))
    return np.einsum("gm,gn,mnk->gk", by_u, by_v, net)


def test_what_is_left_out_of_a_polynomial_counts_as_radius():
    whole = Enclosure(np.random.default_rng(3).normal(size=(9, 10, 200)))
    fewer = whole.lower()
    assert fewer.net.shape[:2] == (4, 4)
    holds(fewer.radius[None], np.abs(at(whole.net, X) - at(fewer.net, X)), used=0.2)


RADIUS = 0.05


@pytest.mark.parametrize("formula", [
    np.sqrt, np.sin, np.cos, np.exp, np.log, np.arctan, np.reciprocal, np.square, np.absolute,
    lambda t: t * (t + 1.0), lambda t: 2.0 / (t + 0.5), lambda t: t / 3.0, lambda t: t**0.7,
    lambda t: np.arctan2(t, t + 1.0), lambda t: (1.0 - t) / t,
])  # fmt: skip
def test_what_is_known_within_a_radius_stays_so(formula):
    low, high = boxes(np.random.default_rng(4), 100, 0.3)
    u = Enclosure.variable(low[:, 0], high[:, 0], 0)
    with np.errstate(all="ignore"):
        found = formula(Enclosure(u.net, RADIUS))
    for off in (-1.0, -0.5, 0.0, 0.5, 1.0):
        values = formula(at(u.net, X) + RADIUS * off)
        holds(found.radius[None], np.abs(values - at(found.net, X)), used=0.0)
    holds(found.radius[None], np.abs(values - at(found.net, X)), used=0.6)


@pytest.mark.parametrize("function", [f for f in FORMULAS if f not in (
    np.absolute, np.sum, np.broadcast_arrays)], ids=lambda f: f.__name__)  # fmt: skip
def test_derivatives_follow_from_formulas(function):
    formula = FORMULAS[function]
    u, v = np.random.default_rng(2).uniform(0.3, 1.9, (2, 50))
    found = formula(Slope(u, np.ones(50)), Slope(v, np.zeros(50)))
    by = (formula(u + 1e-6, v) - formula(u - 1e-6, v)) / 2e-6
    np.testing.assert_allclose(found.value, formula(u, v))
    np.testing.assert_allclose(found.by, by, atol=2e-8, rtol=1e-7)


@pytest.mark.parametrize("formula", [
    lambda u: 1.0 / u, lambda u: u**-1, lambda u: u**-0.5, lambda u: np.log(u), lambda u: u**0.3,
    lambda u: np.arctan2(u, u), lambda u: np.tan(10.0 * u),
    lambda u: np.exp(1e3 / u) - np.exp(1e3 / u), lambda u: 0.0 * (1.0 / u),
    lambda u: (1.0 / u) ** 2, lambda u: np.exp(1e4 * (u + 2.0)), lambda u: np.nan * u,
    lambda u: u / 0.0, lambda u: 1e200 * u * 1e200,
])  # fmt: skip
def test_what_is_not_known_is_infinite(formula):
    u = Enclosure.variable(np.array([-0.5]), np.array([0.7]), 0)
    with np.errstate(all="ignore"):
        found = formula(u)
        assert np.isposinf(found.radius).all()
        assert np.isfinite(found.net).all()
        again = np.sqrt(found * found + 1.0) * 0.0 + found
    assert np.isposinf(again.radius).all()
    assert np.isposinf(VectorModel.of(np.stack([found, 0.0, 0.0], axis=-1)).radius).all()


def test_what_stays_within_bounds_is_known_again():
    """A sine, an arc tangent, and a root where it touches zero."""
    u = Enclosure.variable(np.array([-0.5]), np.array([0.7]), 0)
    with np.errstate(all="ignore"):
        wild = 1.0 / u
        for found, most in ((np.sin(wild), 1.0), (np.cos(wild), 1.0), (np.arctan(wild), np.pi / 2)):
            assert found.ends[1] == pytest.approx(most)
        low, high = np.sqrt(u * u).ends
        assert low <= 0.0 < 0.7 <= high < 0.8


@pytest.mark.parametrize("formula", [
    lambda u, v: np.where(u > v, u, v), lambda u, v: np.asarray(u), lambda u, v: np.stack([u, v]),
    lambda u, v: float(u), lambda u, v: np.maximum(u, v), lambda u, v: u @ v, lambda u, v: u.real,
    lambda u, v: np.linalg.norm(u), lambda u, v: np.stack([u, v], axis=-1), lambda u, v: u,
])  # fmt: skip
def test_formulas_that_cannot_be_followed_are_named_in_a_sentence(formula):
    class Own(Patch):
        kind, units = "own", ("m", "m")
        area = closest = None
        local_point = local_normal = staticmethod(formula)

    own = Own(
        rotation=np.eye(3), position=np.zeros(3), side="inside", u_range=(0, 1), v_range=(0, 1)
    )
    with pytest.raises(SurfaceError, match="no bounds are known between places of this kind"):
        own.parts(0.1, 0.1)
