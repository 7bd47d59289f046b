"""What the page can change: values of the page into a case, and a case into values."""

import math

import numpy as np
import pytest
from command_table import FILES

from coverable import Case, CaseError, load_case
from feasibility.live.controls import BASE, LIMITS, SURFACE, TASK, TCP, Controls
from feasibility.live.workbench import Workbench

PLATE = Case.from_toml(FILES["plate.toml"], name="plate")
RAIL = Case.from_toml(FILES["rail.toml"])
POST = """
[collision]
scene = [{ name = "box", kind = "box", size = [0.1, 0.1, 0.5], position = [0.4, 0.5, 0.25] },
         { name = "held", kind = "box", size = [0.1, 0.1, 0.1], frame = "wrist_3_link" }]
"""


def controls_of(case):
    return Controls(case, case.robot.build(case.surface.frame))


def test_values_that_are_as_they_were_leave_the_case_as_it_was_written(tmp_path):
    for name in ("paper/4b", "paper/5c"):
        controls = controls_of(load_case(name))
        assert controls.changed(controls.values) is controls.changed({}) is controls.case
    text = f"# Mine.\n{FILES['plate.toml']}# The end.\n"
    (tmp_path / "plate.toml").write_text(text)
    changed = controls_of(load_case(tmp_path / "plate.toml")).changed({(TASK, "cone"): 22})
    assert changed.as_written() == text.replace("cone_deg = 30", "cone_deg = 22.0")


def test_limits_of_one_joint_keep_those_of_a_named_set():
    controls = controls_of(load_case("paper/4b"))
    changed = controls.changed({(LIMITS, "joint4"): (-20, 20)})
    assert changed.robot.limits is None
    old, new = controls.robot, changed.robot.build()
    fourth = old.joint_names.index("joint4")
    others = np.arange(old.n) != fourth
    assert np.allclose(new.lower[others], old.lower[others], rtol=0, atol=1e-11)
    assert np.allclose(new.upper[others], old.upper[others], rtol=0, atol=1e-11)
    assert (new.lower[fourth], new.upper[fourth]) == (math.radians(-20), math.radians(20))


def test_joints_that_slide_have_millimetres_and_joints_that_turn_freely_no_limits():
    rail = controls_of(RAIL)
    assert rail.values[SURFACE, "x"] == 1000.0 * RAIL.surface.position[0]
    assert rail.values[LIMITS, "rail"] == (-200.0, 200.0)
    units = {dial.name: dial.unit for dial in rail.dials if dial.group == LIMITS}
    assert (units["rail"], units["shoulder_pan_joint"]) == ("mm", "deg")
    changed = rail.changed({(LIMITS, "rail"): (0, 100)}).robot.build()
    assert (changed.lower[0], changed.upper[0]) == (0.0, 0.1)
    free = controls_of(PLATE.with_overrides(["robot.name=kinova"]))
    first = free.robot.joint_names[0]
    assert free.values[LIMITS, first] == (-360.0, 360.0)
    held = free.changed({(LIMITS, first): (-90, 90)}).robot.build()
    assert np.isfinite(held.lower).sum() == np.isfinite(free.robot.lower).sum() + 1


def test_base_tool_axes_and_objects_are_moved_and_nothing_else():
    rail = controls_of(Case.from_toml(FILES["rail.toml"] + POST))
    new = {(BASE, "z"): 150.0, (TCP, "z"): 120.0, (TCP, "pitch"): 30.0}
    changed = rail.changed(new | {("axis rail", "yaw"): 90.0, ("object box", "y"): 700.0})
    before, after = rail.case.to_tables(), changed.to_tables()
    assert after["robot"]["base"]["position"][2] == 0.15
    assert after["robot"]["tcp"] == {"position": (0.0, 0.0, 0.12), "rpy_deg": (0.0, 30.0, 0.0)}
    assert after["robot"]["axis"][0]["rpy_deg"] == (0.0, 0.0, 90.0)
    first, second = after["collision"]["scene"]
    assert first["position"] == (0.4, 0.7, 0.25)
    assert second == before["collision"]["scene"][1]
    for table in ("surface", "task", "search"):
        assert after[table] == before[table]
    again = controls_of(changed)
    assert {dial: value for dial, value in again.values.items() if value != rail.values[dial]} == (
        new | {("axis rail", "yaw"): 90.0, ("object box", "y"): 700.0}
    )
    # What stands on an axis or a link has no place of its own in the picture.
    assert rail.in_root_frame == [SURFACE, "object box"]
    assert controls_of(PLATE).in_root_frame == [SURFACE, BASE]


@pytest.mark.parametrize(("values", "said"), [
    ({(TASK, "standoff"): -3.0}, "task.standoff: must be a finite number >= 0"),
    ({(LIMITS, "elbow_joint"): (20.0, -20.0)}, "the wrong way round"),
    ({(LIMITS, "elbow_joint"): (-10.0, 10.0)}, "robot.start_deg"),
    ({(SURFACE, "x"): 1e300}, "surface.position: must be three finite numbers"),
    ({(TCP, "x"): 1e300}, "robot.tcp.position: must"),
])  # fmt: skip
def test_what_makes_no_sense_is_refused_in_words(values, said):
    case = PLATE.with_overrides(["robot.start_deg=[0,-90,90,0,90,0]"])
    with pytest.raises(CaseError, match="plate: ") as refused:
        Workbench(case).build(controls_of(case).changed(values))
    assert said in str(refused.value)
