"""Certified area as it is printed, written as JSON, and drawn."""

import json
from dataclasses import replace

import pytest
from small_cases import small_case, small_verdict

from feasibility import check
from feasibility.area import area_json, area_words, measured_area
from feasibility.cli.main import main
from feasibility.clock import Clock
from feasibility.collisions import Collision
from feasibility.viewer import view


def test_the_plate_is_certified_whole():
    verdict = small_verdict("plate")
    area = measured_area(verdict, Clock())
    assert area is verdict.certified_area
    assert area_words(area).startswith("100.0 % of the area (0.04 m2, ")
    assert area_json(area) == {
        "certified_area": pytest.approx(1.0),
        "certified_area_m2": pytest.approx(0.04),
        "partly_certified": [],
    }


def test_cells_in_part_and_cells_without_are_told_apart():
    area = small_verdict("long plate").certified_area
    said = area_json(area)
    shares = {tuple(one["cell"]): one["share"] for one in said["partly_certified"]}
    assert said["certified_area"] == pytest.approx(area.share)
    assert shares[3, 1] == 0.0
    assert 0.0 < shares[0, 0] < 1.0
    words = area_words(area)
    assert "2 cells in part, the least [0, " in words
    assert words.endswith("6 cells not at all")
    spent = replace(area, budget=area.evaluations)
    assert "not everything was examined" in area_words(spent)


def test_where_there_is_none_the_reason_is_said():
    verdict = small_verdict("plate")
    bodies = replace(verdict, task=replace(verdict.task, collision=Collision()))
    why = measured_area(bodies, Clock())
    assert area_words(why) == why
    assert "where collisions are checked" in why
    assert area_json(why) == {"certified_area": None, "certified_area_note": why}


def test_the_command_says_it_when_asked(capsys, tmp_path):
    file = tmp_path / "plate.toml"
    file.write_text(small_case("plate").to_toml())
    assert main(["check", str(file), "--json"]) == 0
    assert "certified_area" not in json.loads(capsys.readouterr().out)
    assert main(["check", str(file), "--json", "--area"]) == 0
    assert json.loads(capsys.readouterr().out)["certified_area"] == pytest.approx(1.0)
    page = tmp_path / "plate.html"
    assert main(["check", str(file), "--area", "--html", str(page)]) == 0
    assert "certified   100.0 % of the area" in capsys.readouterr().out
    assert "certified area (100.0 %)" in page.read_text()


def test_the_picture_has_it_once_it_is_known():
    verdict = check(*small_case("plate").build())
    before = view(verdict)
    assert verdict.certified_area.share == pytest.approx(1.0)
    after = view(verdict)
    new = {entry.label for entry in after.legend.entries} - {
        entry.label for entry in before.legend.entries
    }
    assert new == {"certified area (100.0 %)"}
    assert before.readout is not None
    assert after.readout is not None
    name, unit, shares = after.readout.rows[-1]
    assert (name, unit) == ("certified", "%")
    assert set(shares) == {100.0}
    assert [row[0] for row in before.readout.rows] == [row[0] for row in after.readout.rows[:-1]]
