"""A changed case in the words of its file: comments, paths and short arrays stay."""

import pytest
from small_cases import TEXTS

from feasibility.cases import Case, load_case

FILE = """\
# My cell.
[robot]
urdf = "arms/my.urdf"  # the small one

[surface]  # from CAD
kind = "mesh"
file = "part #1.stl"   # beside this file
position = [
    0.4,  # forwards
    -0.1, 0.2,
]
side = "outside"
cells = 6

[task]
standoff = 0.02
cone_deg = 30          # of the nozzle

[[collision.scene]]    # a shelf
name = "shelf"
kind = "mesh"
file = "/abs/shelf.stl"
"""
NO_CONE = TEXTS["plate"].replace("task.cone_deg = 30", "")
CHANGES = {
    ("task.cone_deg=25.5",): [("cone_deg = 30 ", "cone_deg = 25.5 ")],
    ("surface.rpy_deg=[0, 0, 5]",): [("cells = 6\n", "cells = 6\nrpy_deg = [0.0, 0.0, 5.0]\n")],
    ("robot.limits_deg.a=[-1, 1]", "task.standoff=0.1"): [
        ("one\n", "one\nlimits_deg.a = [-1.0, 1.0]\n"), ("= 0.02", "= 0.1"),
    ],
    ("surface.file=../other.stl",): [('"part #1.stl"', '"../other.stl"')],
    ("search.seed=4",): [("shelf.stl\"\n", "shelf.stl\"\n\n[search]\nseed = 4\n")],
}  # fmt: skip


@pytest.mark.parametrize("settings", CHANGES)
def test_only_what_has_changed_is_changed(settings, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(FILE)
    case, expected = load_case("case.toml", settings), FILE
    for old, new in CHANGES[settings]:
        expected = expected.replace(old, new, 1)
    assert case.as_written() == expected
    assert Case.from_toml(case.as_written(), tmp_path) == case
    assert load_case("case.toml").as_written() == FILE


@pytest.mark.parametrize(
    "settings",
    [
        ("collision=",),
        ("collision.scene=",),
        ("robot.urdf=", "robot.name=ur5", "robot.tcp={ position = [0, 0, 0.1] }"),
        ("surface.position=", "task.roll_deg=[-5, 5]", "task.home_deg=[1, 2]"),
    ],
)
@pytest.mark.parametrize("text", [FILE, TEXTS["plate"], TEXTS["long plate"], NO_CONE])
def test_what_is_written_says_the_case(settings, text, tmp_path):
    """However the file is written, or where it alone is no case."""
    more = ["task.cone_deg=9"] if text == NO_CONE else []
    case = Case.from_toml(text, tmp_path, overrides=[*settings, *more])
    assert Case.from_toml(case.as_written(), tmp_path) == case
    assert str(tmp_path) not in case.as_written()


def test_short_arrays_stand_on_one_line():
    assert "\nposition = [0.0, 0.0, 0.0]\n" in load_case("paper/4a").as_written()
