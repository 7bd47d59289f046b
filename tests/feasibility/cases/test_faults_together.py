"""Several faults come together, in one table and across tables, also those only a URDF shows."""

import copy
import itertools

import pytest

from feasibility.cases import CaseError
from feasibility.cases.case import _from_tables

ARM = """
<robot name="arm"><link name="base"/><link name="cart"/><link name="upper"/><link name="hand"/>
<link name="finger"/>
<joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="cart"/><child link="upper"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="wrist" type="revolute"><parent link="upper"/><child link="hand"/>
<origin xyz="1 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/>
<axis xyz="0 1 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint></robot>
"""
GOOD = {
    "robot": {"urdf": "", "tool_frame": "hand"},
    "surface": {"kind": "mesh", "file": "", "side": "outside", "cells": 12},
    "task": {"standoff": 0.0, "cone_deg": 30},
    "search": {},
}
# The place of a value that is wrong, the value, and what a message says of it.
FAULTS = [
    ("robot.lock.elbow", 0.0, "lock names 'elbow'"),
    ("robot.lock.grip", 9.0, "lock holds joint 'grip'"),
    ("robot.lock.wrist", "shut", "robot.lock.wrist: must be a finite number"),
    ("robot.limits_deg.turn", [10, -10], "robot.limits_deg.turn"),
    ("robot.limits_deg.slide", [-1, 1], "gives degrees for joint 'slide'"),
    ("robot.limits_deg.ellbow", [-1, 1], "'ellbow'"),
    ("robot.limits_m.wrist2", "wide", "robot.limits_m.wrist2"),
    ("robot.limits_m.turn2", [0, 1], "'turn2'"),
    ("robot.tool_frame", "hnad", "no link 'hnad'"),
    ("robot.approach_axis", [0, 0, 0], "robot.approach_axis"),
    ("robot.package_dirs", "meshes", "robot.package_dirs"),
    ("robot.colour", "red", "robot.colour"),
    ("surface.file", "no.stl", "no.stl"),
    ("surface.scale", -1.0, "surface.scale"),
    ("surface.position", [0, 0], "surface.position"),
    ("surface.cut", {"point": [0, 0, 0]}, "surface.cut.normal"),
    ("task.standoff", -1.0, "task.standoff"),
    ("task.cone_deg", None, "task.cone_deg: is missing"),
    ("search.seed", -1, "search.seed"),
]


@pytest.fixture
def good(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    tables = copy.deepcopy(GOOD)
    tables["robot"]["urdf"] = str(tmp_path / "arm.urdf")
    (tmp_path / "square.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    tables["surface"]["file"] = str(tmp_path / "square.off")
    return tables


def message(tables):
    """What reading and building a case says; empty where nothing is wrong."""
    try:
        _from_tables(copy.deepcopy(tables), "case", ()).build()
    except CaseError as error:
        return str(error)
    return ""


def spoil(tables, faults):
    """The tables with some values replaced."""
    tables = copy.deepcopy(tables)
    for place, value, _ in faults:
        *folders, key = place.split(".")
        table = tables
        for folder in folders:
            table = table.setdefault(folder, {})
        table[key] = value
        if value is None:
            del table[key]
    return tables


def test_the_good_case_is_good(good):
    assert message(good) == ""


def test_every_two_faults_come_together(good):
    for faults in itertools.combinations(FAULTS, 2):
        said = message(spoil(good, faults))
        for place, _, words in faults:
            assert words in said, (place, said)


def test_all_faults_come_together_and_none_twice(good):
    said = message(spoil(good, FAULTS))
    for _, _, words in FAULTS:
        assert words in said
    lines = said.splitlines()[1:]
    assert len(set(lines)) == len(lines)


def test_metres_on_a_joint_that_turns_beside_other_faults(good):
    """The three of a user: a wrong lock, reversed limits, and metres on a revolute joint."""
    tables = spoil(good, [FAULTS[0], FAULTS[3], ("robot.limits_m.wrist", [0, 1], "")])
    said = message(tables)
    for words in ("lock names 'elbow'", "robot.limits_deg.turn", "gives metres for joint 'wrist'"):
        assert words in said
