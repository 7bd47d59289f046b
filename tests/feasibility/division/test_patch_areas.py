"""Patches as areas: what of a division is certified, patch by patch."""

from dataclasses import replace

import numpy as np
import pytest
from landings import random_landings
from small_cases import small_case

from feasibility.area import CertifiedArea
from feasibility.collisions import Collision
from feasibility.division import PatchAreas, divide, patch_areas
from feasibility.reports import division as report
from feasibility.viewer import view_division


@pytest.fixture(scope="module")
def divided():
    """The small plate, its cells shared out between two patches with the same walk."""
    made = divide(*small_case("plate").build())
    (patch,) = made.patches
    half = len(patch.cells) // 2
    both = tuple(
        replace(patch, cells=cells, area=float(made.cells.areas[cells].sum()))
        for cells in (patch.cells[:half], patch.cells[half:])
    )
    return replace(made, fewest=replace(made.fewest, patches=both))


@pytest.fixture(scope="module")
def areas(divided):
    return patch_areas(divided)


def test_patches_are_areas_of_their_own_motions(divided, areas):
    assert isinstance(areas, PatchAreas)
    assert len(areas.patches) == len(divided.patches) >= 2
    tiles = []
    for patch, found in zip(divided.patches, areas.patches, strict=True):
        assert isinstance(found, CertifiedArea)
        assert set(found.tiles.cell.tolist()) <= set(patch.cells.tolist())
        assert found.area == pytest.approx(patch.area)
        landings = random_landings(divided, found, 60, np.random.default_rng(5))
        assert landings.failed == 0
        tiles += np.unique(found.tiles.cell).tolist()
    assert areas.share == pytest.approx(areas.area / divided.cells.areas.sum())
    assert sorted(tiles) == list(range(len(divided.cells)))


def test_they_are_reported_when_asked_for(divided, areas):
    assert "certified" not in report.as_text(divided, "behind")
    assert "certified_area" not in report.as_json(divided)
    said = report.as_json(divided, areas=areas)
    assert said["certified_area"] == areas.share
    assert sum(said["of_patches_m2"]) == pytest.approx(said["certified_area_m2"])
    words = " ".join(report.as_text(divided, "behind", areas=areas).split())
    assert "of the area" in words
    assert f"patch {len(divided.patches)} " in words


def test_they_are_tinted(divided, areas):
    one = replace(divided, fewest=replace(divided.fewest, patches=divided.patches[1:]))
    drawn = view_division(one, areas=replace(areas, patches=areas.patches[1:]))
    entries = [entry.label for entry in drawn.legend.entries]
    certified = [entry for entry in entries if "certified" in entry]
    assert certified == ["certified of patch 1 (100.0 %)"]


def test_refused_walks_and_collisions_have_none(divided):
    first, *others = divided.patches
    refused = replace(first, refusal="for a test")
    plan = replace(divided.fewest, patches=(refused, *others))
    without = patch_areas(replace(divided, fewest=plan))
    assert without.patches[0] is None
    assert "patch 1 none" in report.as_text(replace(divided, fewest=plan), "behind", areas=without)
    bodies = replace(divided, task=replace(divided.task, collision=Collision()))
    why = patch_areas(bodies)
    assert "where collisions are checked" in why
    assert report.as_json(bodies, areas=why)["certified_area"] is None
