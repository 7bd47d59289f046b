"""The lemmas behind the parts of patches, each against the worst that its premises allow."""

import numpy as np
import pytest
from part_walks import residuals

from surfaces.parts import PartModels, SurfaceParts, around
from surfaces.patches.affine_models import CurveModel, arc, bounded_curve, turned, unit_model

SIGNS = np.array([-1.0, 1.0])


def test_an_arc_is_within_its_bounds_and_reaches_them():
    half = np.concatenate([10.0 ** np.linspace(-3, 0, 40), np.linspace(1.0, np.pi, 40)])
    found = arc(half)
    share = np.linspace(-1.0, 1.0, 2001)[:, None]
    t = share * half
    bow = np.abs(np.cos(t) - found.mean).max(axis=0)
    sway = np.abs(np.sin(t) - share * found.slope).max(axis=0)
    assert (bow <= found.bow + 1e-15).all()
    assert (sway <= found.sway + 1e-15).all()
    assert bow == pytest.approx(found.bow, rel=1e-6)
    assert sway == pytest.approx(found.sway, rel=1e-3, abs=1e-14)


def test_more_than_half_a_turn_is_the_whole_circle():
    assert [float(each[0]) for each in arc(np.array([7.0]))] == pytest.approx([0.0, 0.0, 1.0, 1.0])


def test_a_bend_holds_whatever_the_second_derivative_does_within_its_bound():
    """It jumps between the bound and its negative at random places."""
    rng = np.random.default_rng(1)
    half, most, steps = 0.7, 3.0, 4000
    s = np.linspace(-half, half, steps + 1)
    worst = 0.0
    for trial in range(100):
        cuts = np.sort(rng.uniform(-half, half, rng.integers(0, 6) if trial else 0))
        second = most * np.where(np.searchsorted(cuts, s[:-1] + half / steps) % 2 == 0, 1.0, -1.0)
        width = 2.0 * half / steps
        slope = np.concatenate([[0.0], np.cumsum(second) * width])
        value = np.concatenate([[0.0], np.cumsum((slope[:-1] + slope[1:]) / 2.0 * width)])
        value += rng.normal() + rng.normal() * s
        places = np.stack([value, 0.0 * value], axis=1)[[0, steps // 2, steps], None]
        model = bounded_curve(places, np.array([[most, 0.0]]), np.array([half]))
        left = value - model.centre[0, 0] - model.slope[0, 0] * s / half
        worst = max(worst, np.abs(left).max() / model.error[0, 0])
    assert 0.999 <= worst <= 1.0 + 1e-6


def test_a_turned_curve_lies_in_its_model():
    """What is left of the curve anything in its bounds; stretched, and with the angle first."""
    rng = np.random.default_rng(2)
    for _ in range(150):
        centre, slope = rng.normal(size=(2, 1, 2))
        error = rng.uniform(size=(1, 2)) * 10.0 ** rng.uniform(-6, 0)
        low, high = np.sort(rng.uniform(-3.0, 3.2, 2))
        stretch = 10.0 ** rng.uniform(-2, 2, 3)
        model = turned(
            CurveModel(centre, slope, error), np.array([low]), np.array([high]), 0, stretch
        ).model()
        x = rng.uniform(-1.0, 1.0, (400, 2))
        x[:100] = np.sign(x[:100])
        off = rng.uniform(-1.0, 1.0, (400, 2))
        off[::2] = np.sign(off[::2])
        r, z = (centre + x[:, 1:] * slope + off * error).T
        angle = (low + high) / 2.0 + x[:, 0] * (high - low) / 2.0
        places = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1) * stretch
        left = places - model.centre - np.einsum("kc,cd->kd", x, model.slopes[0])
        assert np.linalg.norm(left, axis=1).max() <= model.error[0] * (1.0 + 1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_unit_vectors_lie_in_their_model(dimension):
    """Whatever is left of the vectors, in the largest box and ball that the bounds allow."""
    rng = np.random.default_rng(dimension)
    told = 0
    for _ in range(600):
        centre = rng.normal(size=(1, dimension)) * 10.0 ** rng.uniform(-2, 2)
        size = np.linalg.norm(centre)
        axis = centre / size
        slopes = rng.normal(size=(1, 2, dimension)) * size * 10.0 ** rng.uniform(-3, 0.2)
        if rng.uniform() < 0.3:  # mostly along the vector, so that only its length changes
            slopes = slopes @ axis.T @ axis + 0.01 * slopes
        ahead, across = size * 10.0 ** rng.uniform(-4, 0.2, 2)
        c, g, radius = unit_model(centre, slopes, np.array([ahead]), np.array([across]))
        told += radius[0] < 1.0
        x = rng.uniform(-1.0, 1.0, (300, 2))
        x[:150] = np.sign(x[:150])
        beside = rng.normal(size=(300, dimension))
        beside -= (beside @ axis.T) * axis
        beside *= across / np.linalg.norm(beside, axis=1, keepdims=True)
        along = ahead * rng.choice([-1.0, 0.0, 1.0], (300, 1)) * axis
        vectors = centre + np.einsum("kc,cd->kd", x, slopes[0]) + along + beside
        unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        left = unit - c - np.einsum("kc,cd->kd", x, g[0])
        assert np.linalg.norm(left, axis=1).max() <= radius[0] + 1e-12
    assert told > 180


def test_vectors_that_may_be_zero_have_a_model_that_always_holds():
    zero = unit_model(np.zeros((1, 3)), np.ones((1, 2, 3)), np.zeros(1), np.zeros(1))
    lost = unit_model(np.full((1, 3), np.nan), np.ones((1, 2, 3)), np.zeros(1), np.zeros(1))
    for centre, slopes, radius in (zero, lost):
        assert not centre.any()
        assert not slopes.any()
        assert radius == 1.0


def random_models(rng, count):
    radius = 10.0 ** rng.uniform(-3, 1, (count, 2))
    slopes = rng.normal(size=(count, 2, 6)) * 10.0 ** rng.uniform(-3, 1, (count, 1, 1))
    return PartModels(rng.normal(size=(count, 6)), slopes, radius, np.zeros((count, 2, 2)))


def test_a_part_above_two_others_holds_both():
    rng = np.random.default_rng(7)
    one, other = random_models(rng, 400), random_models(rng, 400)
    both = around(one, other)
    none = np.full((400, 2), -1)
    parts = SurfaceParts(both.centre, both.slopes, both.radius, none, none[:, 0])
    for models in (one, other):
        for _ in range(20):
            x = rng.choice(SIGNS, (400, 2))
            off = rng.normal(size=(400, 2, 3))
            off *= models.radius[..., None] / np.linalg.norm(off, axis=2, keepdims=True)
            places = models.centre + np.einsum("kc,kcd->kd", x, models.slopes) + off.reshape(-1, 6)
            held = residuals(parts, np.arange(400), 0.0 * x, places[:, :3], places[:, 3:])
            normal = parts.radius[:, 1] > 1.0  # then any unit vector is held, no others
            assert (held[:, 0] <= parts.radius[:, 0]).all()
            assert (held[~normal, 1] <= parts.radius[~normal, 1]).all()


def test_models_that_are_not_numbers_hold_everything():
    models = random_models(np.random.default_rng(8), 6)
    models.centre[0, 0] = models.slopes[1, 0, 4] = models.radius[2, 0] = np.nan
    models.radius[3, 1], models.radius[4, 0], models.radius[5] = np.inf, np.inf, 1e-3
    guarded = models.guarded()
    assert np.isfinite(guarded.centre).all()
    assert np.isfinite(guarded.slopes).all()
    assert (np.isinf(guarded.radius[:, 0]) == [True, False, True, False, True, False]).all()
    assert (guarded.radius[[1, 3], 1] >= 1.0).all()
    assert not guarded.centre[[1, 3], 3:].any()
    assert guarded.radius[5] == pytest.approx([1e-3, 1e-3], abs=1e-9)
    assert (guarded.radius[5] > 1e-3).all()
