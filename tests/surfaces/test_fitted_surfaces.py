"""Surfaces from a user's formula, from grids of points, and from a class of one's own."""

import math
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from bounds import holds
from jobs import said_without_ours
from part_walks import lost
from specimens import EQUAL, ball, ring, sampled

import coverable
from coverable import check, grid, load_robot, parallel_passes, parametric, piecewise, view
from feasibility.cases.keys import KEYS
from feasibility.certification.motion_replay import replay_over_surface
from surfaces.places.offset_surfaces import offset_surface
from surfaces.places.places import Places
from surfaces.sheet import sheet_of

PAGE = Path(__file__).parents[2] / "docs" / "own_surfaces.md"


def blocks(kind):
    return re.findall(rf"^```{kind}\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)


@pytest.mark.parametrize("name", EQUAL)
def test_a_formula_makes_the_patch_that_it_is_equal_to(name):
    formula, u, v, patch = EQUAL[name]
    found = parametric(formula, u, v)
    off, leans = found.deviations
    assert 0.0 < off < 3e-7
    assert leans < 1e-5
    mine, exact = found.cells(7, 6), patch.cells(7, 6)
    sign = np.sign((mine.normals * exact.normals).sum(axis=1))
    assert (sign == sign[0]).all()
    assert np.linalg.norm(mine.normals - sign[0] * exact.normals, axis=1).max() <= leans + 1e-12
    np.testing.assert_allclose(mine.areas, exact.areas, rtol=1e-5)
    assert mine.pairs.tolist() == exact.pairs.tolist()
    # Between the places where it was measured, too.
    some = np.random.default_rng(0).uniform(*zip(u, v, strict=True), size=(2000, 2)).T
    holds(off, np.linalg.norm(found.point(*some) - patch.point(*some), axis=1), used=0.3)


def test_ends_that_meet_smoothly_are_joined_and_those_at_a_kink_are_not():
    whole = parametric(ring, (0, math.tau), (0, math.tau))
    tube = grid(sampled(ring, (0, math.tau), (0, 1.0), (33, 5)))
    assert (whole.u_closed, whole.v_closed, tube.u_closed, tube.v_closed) == (*[True] * 3, False)
    assert len(whole.cells(5, 4).pairs) == 4 * 20

    def leaf(u, v):
        return u * (1 - u), u * (1 - u) * (0.7 - u), v + 0 * u

    kinked, corner = parametric(leaf, (0, 1), (0, 1)), grid(sampled(leaf, (0, 1), (0, 1), (21, 5)))
    assert not kinked.u_closed
    assert not corner.u_closed
    assert any("kink" in note for note in kinked.notes)
    assert any("crease" in note for note in corner.notes)


def test_it_states_its_deviation_and_where_outward_is():
    found = parametric(ball, (0.2, 1.2), (0, 1), side="outside")
    assert "deviates by at most" in found.notes[0]
    assert found.normal(0.7, 0.5) @ found.point(0.7, 0.5) > 0.99
    joined = piecewise([found, parametric(ball, (0.2, 1.2), (1, 2))])
    each = [piece.deviations for piece in joined.pieces]
    assert joined.deviations == tuple(np.max(each, axis=0))
    flat = grid(sampled(lambda u, v: (u, v, 0.0 * u), (0, 1), (0, 2), (4, 5)))
    assert flat.normal(0.5, 0.5).tolist() == [0.0, 0.0, 1.0]
    assert "(0, 0, 1) in the middle" in flat.notes[1]


@pytest.mark.parametrize("name", EQUAL)
def test_a_grid_runs_through_its_points_and_near_the_surface_they_are_of(name):
    formula, u, v, patch = EQUAL[name]
    points = sampled(formula, u, v, (25, 31))
    found = grid(points)
    if name != "hyperboloid":  # whose rows are not evenly far apart
        nodes = np.meshgrid(*(np.linspace(0, 1, count) for count in (25, 31)), indexing="ij")
        np.testing.assert_allclose(found.point(*nodes), points, atol=1e-12)
    assert np.abs(found.closest(points.reshape(-1, 3)).height).max() < 1e-12
    off = np.abs(patch.closest(found.cells(9, 9).centres).height).max()
    stated = float(found.notes[0].split("by up to ")[1].split(" mm")[0]) / 1e3
    # The bilinear surface cuts off the sagitta of a step; the spline does not.
    assert off < min(1e-5, 0.01 * stated)
    assert 1e-5 < stated < 1e-2


def test_models_are_wider_by_what_a_spline_deviates():
    found = parametric(*EQUAL["torus"][:3])
    further = replace(found, off=(1e-3 + found.off[0], 1e-2 + found.off[1]))
    for twisted in (False, True):
        one, other = (
            each.placed_models(*each.part_roots, 1.0, twisted)[0] for each in (found, further)
        )
        np.testing.assert_allclose(other.radius - one.radius, [[1e-3, 1e-2]])


@pytest.fixture(scope="module")
def names():
    found = {}
    exec(compile("\n".join(blocks("python")), PAGE.name, "exec", dont_inherit=True), found)
    return found


def test_the_class_of_the_page_is_the_surface_of_its_formula(names):
    screw, rise = names["screw"], names["screw"].rise
    spline = parametric(
        lambda u, v: (v * np.cos(u), v * np.sin(u), rise * u), screw.u_range, screw.v_range,
        side="inside", position=screw.position,
    ).cells(6, 4)  # fmt: skip
    own = names["flank"]
    np.testing.assert_allclose(own.centres, spline.centres, atol=1e-8)
    np.testing.assert_allclose(own.normals, -spline.normals, atol=1e-6)
    np.testing.assert_allclose(own.areas, spline.areas, rtol=1e-6)
    rng = np.random.default_rng(0)
    u, v, height = rng.uniform(-0.9, 0.9, 200), rng.uniform(0.12, 0.28, 200), 0.03
    found = screw.closest(screw.point(u, v) + height * screw.normal(u, v))
    np.testing.assert_allclose(np.stack([found.u, found.v]), [u, v], atol=1e-9)
    np.testing.assert_allclose(found.height, height, atol=1e-12)
    assert found.inside.all()


def test_the_class_of_the_page_needs_no_more_than_its_formulas(names):
    """Parts for proofs, sheets, paths for the replay with u directions, motions, and their page."""
    screw, cells = names["screw"], names["flank"]
    assert not lost(screw, np.random.default_rng(0))
    assert 0.0 < sheet_of(screw).deviation < 1e-3
    offset = offset_surface(screw, 0.02, directed=True)
    x = np.array([[0.0, 0.2], [0.1, 0.21]])
    start, end = (Places(np.zeros(1, dtype=int), x[k : k + 1]) for k in (0, 1))
    t = np.linspace(0.0, 1.0, 41)[:, None]
    dense = Places(np.zeros(41, dtype=int), x[0] + t * (x[1] - x[0]))
    stated = offset.paths(start, end).deviations[0, 2]
    for values, bound in zip(offset.at(dense), stated, strict=True):
        off = np.linalg.norm(values - values[0] - t * (values[-1] - values[0]), axis=1).max()
        assert 0.4 * bound < off < bound
    task, robot = coverable.Task(0.02, 60, roll_deg=(-175, 175)), load_robot("puma560")
    verdict = check(robot, cells, task)
    assert verdict.feasible
    assert replay_over_surface(robot, cells, task, verdict.witness.q).accepted
    assert len(view(verdict).html()) > 10_000
    far = replace(screw, position=np.array([3.0, 0.0, 0.0])).cells(2, 2)
    assert str(check(robot, far, task).evidence) == "proof"
    assert parallel_passes(screw, 0.05).count > 3


OF_A_CASE = """
import pathlib; from feasibility.cases import keys
keys.KEYS, coverable.helicoid = pathlib.Path("keys.toml"), helicoid
case = coverable.load_case("case.toml")
assert coverable.Case.from_toml(case.to_toml()).surface == case.surface
assert coverable.check(*case.build()).feasible
case.with_overrides(["surface.rise=-0.1"])
"""


def test_the_class_of_the_page_has_keys_by_rows_of_a_table(tmp_path):
    rows, case = blocks("toml")
    (tmp_path / "keys.toml").write_text(KEYS.read_text("utf-8") + rows)
    (tmp_path / "case.toml").write_text(case)
    said = said_without_ours("\n".join([*blocks("python"), OF_A_CASE]), tmp_path, {})
    assert "surface.rise: must be a finite number > 0 (m per radian), got -0.1" in said


def test_a_kind_that_cannot_be_followed_is_measured(names):
    class Unknown(names["Helicoid"]):
        def local_point(self, u, v):
            return super().local_point(np.where(u > 2.0, 0.0, u), v)

    own = Unknown(**{f.name: getattr(names["screw"], f.name) for f in fields(names["screw"])})
    with pytest.raises(coverable.SurfaceError, match=r"np\.greater is not known"):
        sheet_of(own)
    places = [Places(np.zeros(1, dtype=int), np.array([[u, 0.2]])) for u in (0.0, 0.1)]
    known, measured = (
        offset_surface(one, 0.02, directed=True).paths(*places).deviations[0, 2]
        for one in (names["screw"], own)
    )
    np.testing.assert_allclose(measured, 2.0 * known, rtol=0.1)
