"""What the page can change: values of the page into a case, and a case into values."""

import math

import numpy as np
import pytest
from command_table import FILES

from coverable import Case, CaseError, load_case
from feasibility.live.controls import Controls

PLATE = Case.from_toml(FILES["plate.toml"], name="plate")
RAIL = Case.from_toml(FILES["rail.toml"])


def controls_of(case):
    return Controls(case, case.robot.build(case.surface.frame))


@pytest.fixture(scope="module")
def plate():
    return controls_of(PLATE)


def test_values_that_are_as_they_were_leave_the_case_as_it_was_written(tmp_path):
    for name in ("paper/4b", "paper/5c"):
        controls = controls_of(load_case(name))
        assert controls.changed(controls.values) is controls.changed({}) is controls.case
    text = f"# Mine.\n{FILES['plate.toml']}# The end.\n"
    (tmp_path / "plate.toml").write_text(text)
    changed = controls_of(load_case(tmp_path / "plate.toml")).changed({"cone_deg": 22})
    assert changed.as_written() == text.replace("cone_deg = 30", "cone_deg = 22.0")


def test_limits_of_one_joint_keep_those_of_a_named_set():
    controls = controls_of(load_case("paper/4b"))
    changed = controls.changed({"limits": {"joint4": [-20, 20]}})
    assert changed.robot.limits is None
    old, new = controls.robot, changed.robot.build()
    fourth = old.joint_names.index("joint4")
    others = np.arange(old.n) != fourth
    assert np.allclose(new.lower[others], old.lower[others], rtol=0, atol=1e-11)
    assert np.allclose(new.upper[others], old.upper[others], rtol=0, atol=1e-11)
    assert (new.lower[fourth], new.upper[fourth]) == (math.radians(-20), math.radians(20))


def test_joints_that_slide_have_millimetres_and_joints_that_turn_freely_no_limits():
    rail = controls_of(RAIL)
    assert rail.values["position"] == [1000.0 * v for v in RAIL.surface.position]
    assert rail.values["limits"]["rail"] == [-200.0, 200.0]
    shown = {joint["name"]: joint for joint in rail.described()["joints"]}
    assert (shown["rail"]["unit"], shown["shoulder_pan_joint"]["unit"]) == ("mm", "deg")
    changed = rail.changed({"limits": {"rail": [0, 100]}}).robot.build()
    assert (changed.lower[0], changed.upper[0]) == (0.0, 0.1)
    kinova = PLATE.with_overrides(["robot.name=kinova"])
    free = controls_of(kinova)
    joints = free.robot.joint_names
    assert [name for name in joints if free.values["limits"][name] is None] == [
        name
        for name, kind in zip(joints, free.robot.joint_kinds, strict=True)
        if kind == "continuous"
    ]
    held = free.changed({"limits": {joints[0]: [-90, 90]}}).robot.build()
    assert np.isfinite(held.lower).sum() == np.isfinite(free.robot.lower).sum() + 1


SENSELESS = (
    {"standoff": -3}, {"cone_deg": 200}, {"limits": {"elbow_joint": [20, -20]}},
    {"limits": {"elbow_joint": [5, 5]}}, {"limits": {"elbow_joint": None}},
    {"limits": {"no such": [1, 2]}}, {"position": [1, 2]}, {"position": [1, 2, 1e300]},
    {"cone_deg": "steep"}, {"cone_deg": math.nan}, {"cone_deg": True},
    {"robot": {"urdf": "/etc/passwd"}}, [1], None,
    {"standoff": "far", "rpy_deg": 3, "limits": 4},
)  # fmt: skip


def test_what_makes_no_sense_is_refused_in_words(plate, approved):
    said = []
    for values in SENSELESS:
        with pytest.raises(CaseError) as refused:
            plate.changed(values)
        said.append(f"{values}: {refused.value}")
    assert len(refused.value.faults) == 3, "all faults are told together"
    approved("live/refused", "\n".join(said))
