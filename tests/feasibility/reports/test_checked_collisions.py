"""Studies, comparisons and late answers say which collisions were checked."""

from __future__ import annotations

import pytest
from small_cases import TEXTS

from feasibility.cases import Case
from feasibility.collisions import CHECKABLE, UNCHECKED
from feasibility.reports import comparison, study, too_late
from feasibility.studies import Arm, Comparison, read_study

SCENE = """
[[collision.scene]]
name = "floor"
kind = "halfspace"
"""
ARM = Arm("ur5", 6, 1.0, "feasible", "witness", "", share=1.0, covered=4, cells=4)


def study_of(*lines: str) -> study.Study:
    return read_study("\n".join(['base.case = "paper/4a"', *lines]))


@pytest.mark.parametrize("asked", ["", "[collision]", "[collision]\nself = false", SCENE])
def test_a_comparison_and_a_late_answer_say_what_the_case_asks_for(asked: str) -> None:
    case = Case.from_toml(TEXTS["plate"] + asked)
    names = [] if case.collision is None else list(case.collision.checked)
    found = Comparison("x", (ARM,), divided=False, critical=False, collision=case.collision)
    assert comparison.as_json(found)["collisions"] == names
    assert too_late.as_json(case, "late", 1.0)["collisions"] == names
    for text in (
        comparison.as_text(found), comparison.as_html(found), too_late.as_text(case, "late")
    ):  # fmt: skip
        assert (UNCHECKED in " ".join(text.split()).lower()) == (not names)
        said = text.lower()
        assert all((CHECKABLE[name].split()[-1] in said) for name in names)


def test_a_study_says_what_all_cases_check() -> None:
    alike = study_of('vary."collision.clearance" = [0.0, 0.01]')
    assert study.as_json(alike, [])["collisions"] == ["self", "surface"]
    assert UNCHECKED not in study.as_text(alike, [])
    mixed = study_of('vary."collision.surface" = [true, false]', 'vary."collision.self" = [true]')
    assert study.as_json(mixed, [])["collisions"] == ["self"]
    assert "in 1 of 2 cases collisions are checked with the arm itself" in study.as_text(mixed, [])
    none = study_of('vary."task.cone_deg" = [30, 40]')
    assert study.as_json(none, [])["collisions"] == []
    assert UNCHECKED in study.as_text(none, [])
    assert UNCHECKED in study.as_html(none, []).lower()
