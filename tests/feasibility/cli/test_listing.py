"""`coverable robots` and `coverable keys`: what there is, what is said, and names of nothing."""

import json

import pytest

from feasibility.cases import all_keys
from robots import GROUPS, list_robots


def test_keys_prints_each_key_with_type_unit_default_and_meaning(ask):
    status, out, err = ask("keys")
    assert (status, err) == (0, "")
    for key in all_keys():
        for text in (key.written, key.type, key.unit, key.default or "needed", key.meaning):
            assert text in out


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        ("task", lambda key: key.table == "task"),
        ("surface", lambda key: key.table.startswith("surface")),
        ("surface.cut", lambda key: key.table == "surface.cut"),
        ("mesh", lambda key: key.kind == "mesh"),
        ("surface.mesh", lambda key: key.kind == "mesh"),
        ("surface step", lambda key: key.kind == "step"),
    ],
)
def test_keys_of_one_table_or_kind(ask, asked, wanted):
    status, out, _ = ask("keys", *asked.split(), "--json")
    rows = json.loads(out)["keys"]
    assert status == 0
    expected = [
        {"table": key.table, "kind": key.kind or None, "key": key.name, "type": key.type,
         "unit": key.unit or None, "default": key.default, "meaning": key.meaning,
         "example": key.example}
        for key in all_keys() if wanted(key)
    ]  # fmt: skip
    assert rows == expected != []


@pytest.mark.parametrize(
    ("asked", "words"),
    [("serach", '"search"'), ("?", "there are robot, "), ("", "surface, sphere, ")],
)
def test_keys_of_a_table_that_there_is_not(ask, asked, words):
    status, out, err = ask("keys", asked)
    assert (status, out) == (2, "")
    assert words in err


def test_robots_lists_joints_reach_and_limits_manipulators_first(ask):
    status, out, err = ask("robots")
    lines = out.splitlines()
    names = [info.name for info in list_robots()]
    assert (status, err) == (0, "")
    listed = {line.split()[0]: line for line in lines if " m  " in line}
    assert list(listed) == names
    heads = [lines.index(title.capitalize()) for title in GROUPS.values()]
    assert heads == sorted(heads)
    puma = listed["puma560"]
    assert "1.41 m" in puma
    assert "-180..180" in puma
    assert "set-1, set-2, set-3, set-4" in puma
    kinova = listed["kinova"]
    assert "6 (3 continuous)" in kinova
    assert "free, 47..313, 19..341, free, 30..330, free" in kinova

    status, out, _ = ask("robots", "--json")
    rows = {row["name"]: row for row in json.loads(out)["robots"]}
    assert list(rows) == names
    groups = [row["group"] for row in rows.values()]
    assert groups == sorted(groups, key=list(GROUPS).index)
    for name, group in (("ur5", "manipulator"), ("so101", "manipulator"), ("b1_z1", "legged"),
                        ("pr2_left", "humanoid"), ("talos_arm", "humanoid")):  # fmt: skip
        assert rows[name]["group"] == group
    assert rows["puma560"]["joints"][0] == {
        "name": "joint1",
        "kind": "revolute",
        "limits_deg": [-180.0, 180.0],
    }
    assert rows["kinova"]["joints"][0]["limits_deg"] is None
    assert len(rows["panda"]["joints"]) == rows["panda"]["degrees_of_freedom"] == 7


@pytest.mark.parametrize("name", ["ur10e", "iiwa", "kr210", "my_arm"])
def test_an_unknown_robot_is_answered_with_how_to_bring_a_urdf(ask, name):
    status, out, err = ask("check", "paper/4a", "--set", f"robot.name={name}")
    assert (status, out) == (2, "")
    assert f"there is no robot '{name}'" in err
    for words in ('urdf = "my_arm.urdf" in a case', "load_robot(", "xacro", "coverable robots"):
        assert words in err
