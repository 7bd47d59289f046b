"""Numbers that are a thousand times too large, or radians: the command asks, and goes on."""

import math
import re

import pytest
from small_cases import TEXTS

from feasibility.cases import Case, CaseError, builtin_cases, unit_notes

ASKED = {
    "surface.u=[350, 650]": "surface.u .* millimetres.*\\[0.35, 0.65\\]",
    "surface.position=[400, 0, 100]": "surface.position .* millimetres.*\\[0.4, 0.0, 0.1\\]",
    "task.standoff=20": "task.standoff .* millimetres.* 0.02",
    "robot.tcp.position=[0, 0, 5]": "robot.tcp.position .* millimetres.* 0.005",
    "task.cone_deg=0.785": "task.cone_deg .* radians.* 44.98",
    "surface.rpy_deg=[0, 0, 1.57]": "surface.rpy_deg .* radians.* 89.95",
    "task.roll_deg=[-0.26, 0.26]": "task.roll_deg .* radians.*-14.9",
    f"robot.limits_deg={[[-3.1, 3.1]] * 6}": "robot.limits_deg .* radians.* 177.6",
    "robot.start_deg=[0, -1.5, 1.2, 0, 1.57, 0]": "robot.start_deg .* radians.* 68.75",
}
TAKEN = (
    "surface.position=[12, 0, 0]", "surface.u=[0, 25]", "task.standoff=1.5", "task.cone_deg=3",
    "task.roll_deg=[-5, 5]", "robot.limits_deg.elbow_joint=[-2, 2]", "surface.rpy_deg=[0, 0, 1]",
)  # fmt: skip


def noted(setting):
    case = Case.from_toml(TEXTS["plate"], overrides=[setting])
    return unit_notes(case.to_tables(), case.robot.build().length_unit)


@pytest.mark.parametrize("setting", ASKED)
def test_what_looks_like_another_unit_is_asked(setting):
    (note,) = noted(setting)
    assert re.search(ASKED[setting], note)


def test_the_command_asks_and_goes_on(tmp_path, ask):
    path, setting = tmp_path / "case.toml", "surface.position=[400, 0, 100]"
    path.write_text(TEXTS["plate"])
    status, _, err = ask("check", path, "--set", setting)
    assert status == 1
    assert err == f"note: {noted(setting)[0]}\n"


@pytest.mark.parametrize("setting", TAKEN)
def test_what_may_well_be_meant_is_not_asked(setting):
    assert noted(setting) == ()


def test_no_built_in_case_is_asked():
    for case in builtin_cases().values():
        assert unit_notes(case.to_tables(), case.robot.build().reach) == ()


def test_a_tool_that_no_arm_carries_is_refused_with_the_question():
    with pytest.raises(CaseError, match=r"tcp\.position.* beyond 10; millimetres\?"):
        Case.from_toml(TEXTS["plate"], overrides=["robot.tcp.position=[0, 0, 120]"])


def test_a_wall_is_compared_with_the_reach_of_the_arm():
    wall = {"surface": {"kind": "plane", "u": (0.0, 600.0)}}
    assert len(unit_notes(wall, 3.0)) == 1
    assert unit_notes(wall, math.inf) == ()
