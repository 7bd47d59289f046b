"""The reference of keys is what reading does: every key is known, judged, and said in messages."""

import copy
import datetime
import math
import re
import tomllib
from pathlib import Path

import pytest
from bad_cases import GOOD, SURFACES

from coverable_errors import MISSING
from feasibility import Search
from feasibility.cases import Case, CaseError, CollisionPart, all_keys, mesh_keys, surface_pieces
from feasibility.cases.keys import keys_of, kinds
from feasibility.cases.robot_table import RobotPart
from feasibility.cases.surface_table import SurfacePart
from feasibility.collisions import Collision
from surfaces.meshes.cells import clustering
from surfaces.piecewise import piecewise_surface

WRONG = datetime.date(2026, 1, 1)  # no key takes a date
ALTERNATIVES = {"name": "urdf", "urdf": "name", "points": "file", "file": "points",
                "cell_size": "cells", "colour": "faces",
                "limits_deg": "limits", "limits_m": "limits",
                "lock": "limits", "start": "start_deg", "start_deg": "start"}  # fmt: skip
UNITS = {"degrees": "deg", "metres": "m", "seconds": "s"}
GRID = {"cells": [3, 4]}
TABLES = ("robot", "surface", "task", "collision", "search")
PAPER = {
    "sphere": {"radius": 1.0, "u_deg": [10, 90], "v_deg": [0, 90], **GRID},
    "cylinder": {"radius": 1.0, "u_deg": [10, 90], "v": [0, 1], **GRID},
    "hyperboloid": {"radius": 1.0, "flare": 1.0, "u_deg": [10, 90], "v": [0, 1], **GRID},
    "plane": {"u": [0, 1], "v": [0, 1], **GRID},
}
OTHERS = {
    "robot.axis": ("", ("axis", 0), {"name": "rail", "type": "prismatic", "carries": "base",
                                     "limits_m": [0, 1]}),
    "robot.tcp": ("", ("tcp",), {}),
    "robot.base": ("", ("base",), {}),
    "surface.cut": ("mesh", ("cut",), {"point": [0, 0, 0], "normal": [0, 0, 1]}),
    "surface.facing": ("mesh", ("facing",), {"direction": [0, 0, 1], "within_deg": 30}),
    "surface.pieces": ("piecewise", ("pieces", 0), {"kind": "plane", **PAPER["plane"]}),
    "collision.clearances": ("", ("clearances", 0), {"pair": ["a", "b"], "value": 0.1}),
    "collision.scene": ("", ("scene", 0), {"name": "post", "kind": "capsule", "radius": 0.1,
                                           "length": 1.0}),
    "collision.tool": ("", ("tool", 0), {"kind": "capsule", "radius": 0.1, "length": 1.0}),
}  # fmt: skip
OF_SHAPES = {"size": {"kind": "box", "size": [1, 1, 1]}, "file": {"kind": "mesh", "file": "a.stl"}}
OF_SHAPES["scale"] = OF_SHAPES["file"]
"""What an object is that has a key which a capsule has not."""


def tables_of(kind):
    """A good case with this kind of surface."""
    tables = tomllib.loads(GOOD)
    if kind in PAPER:
        tables["surface"] = {"kind": kind, **PAPER[kind]}
    else:
        tables["surface"] = tomllib.loads(SURFACES[kind])
    tables["search"] = {}
    tables["collision"] = {}
    return tables


def place_of(key):
    """A good case in which the key may stand, its table there, and what messages call the table."""
    kind, path, inner = copy.deepcopy(OTHERS.get(key.table, (key.kind or "sphere", (), {})))
    tables = tables_of("mesh" if key.name == "smooth" else kind or "sphere")
    outer = key.table.split(".")[0]
    if outer != "robot":
        del tables["robot"]  # no arm is loaded for it
    if not path:
        return tables, tables[key.table], key.table
    if outer == "collision" and key.name in OF_SHAPES:
        inner = {"name": "post"} if "name" in inner else {}
        inner |= copy.deepcopy(OF_SHAPES[key.name])
    if key.table == "robot.axis" and key.name.endswith("_deg"):
        inner = {"name": "table", "type": "revolute", "carries": "surface"}
    tables[outer][path[0]] = [inner] if path[1:] else inner
    return tables, inner, key.table + "[0]" * len(path[1:])


def faults_of(tables):
    """The faults of reading these tables, by key, without those of what is left out here."""
    from feasibility.cases.case import _from_tables

    try:
        _from_tables(tables, "case", ())
    except CaseError as error:
        faults = [
            fault
            for fault in error.faults
            if "there is no such file" not in fault.message
            and not (fault.key == "robot" and "robot" not in tables)
        ]
        return {fault.key: fault for fault in reversed(faults)}
    return {}


def with_value(key, value):
    """The faults of a good case with one key set, and the key as messages write it."""
    tables, table, name = place_of(key)
    if key.name in ALTERNATIVES:
        table.pop(ALTERNATIVES[key.name], None)
    if key.kind == "bspline" and key.name != "degree":  # the examples fit each other
        table |= {"degree": [1, 1], "points": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0.2], [1, 1, 0]]]}
        table.pop("points" if key.name == "file" else "", None)
    elif key.name == "degree":
        table["points"] = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0.2], [1, 1, 0]]]
    elif key.name == "xacro_args":
        table["urdf"] = f"{table.pop('name')}.urdf.xacro"
    elif key.name == "coverage":
        table["footprint"] = 0.06
    if value is MISSING:
        table.pop(key.name, None)
    else:
        table[key.name] = value
    return faults_of(tables), f"{name}.{key.name}"


def title(key):
    return f"{key.table}:{key.kind}:{key.name}"


every_key = pytest.mark.parametrize("key", all_keys(), ids=title)


@every_key
def test_the_example_of_a_key_is_accepted(key):
    faults, _ = with_value(key, tomllib.loads(key.written)[key.name])
    assert not faults


@every_key
def test_a_key_is_judged(key):
    faults, name = with_value(key, WRONG)
    assert any(fault.startswith(name) for fault in faults)
    for fault in faults.values():
        unit = re.search(r"\((degrees|metres|seconds)\)", fault.message)
        assert unit is None or UNITS[unit[1]] == key.unit


@every_key
def test_a_key_that_is_needed_is_missed_and_no_other(key):
    faults, name = with_value(key, MISSING)
    if key.default is None or key.default.startswith("needed by "):
        fault = faults[name]
        assert fault.message.startswith("is missing")
        assert "such as" in fault.message
    elif key.default.startswith("none: "):  # one of two is needed
        assert all(fault.message.startswith("is missing") for fault in faults.values())
        assert set(faults) & {name, f"{key.table}.{ALTERNATIVES[key.name]}"}
    elif key.name == "degree":  # (3, 3), for which the net is too small
        assert set(faults) == {"surface.points"}
    else:
        assert not faults


@pytest.mark.parametrize("table", [*TABLES, *OTHERS])
def test_an_unknown_key_is_answered_with_those_of_the_table_each_once(table):
    key = next(key for key in all_keys() if key.table == table)
    tables, inner, name = place_of(key)
    inner["zzzz"] = 1
    said = faults_of(tables)[f"{name}.zzzz"].message
    known = re.search(r"known are (.*)$", said)[1].split(", ")
    assert known == list(keys_of(table, inner.get("kind", "")))
    assert len(set(known)) == len(known)


@pytest.mark.parametrize(
    ("table", "line", "words"),
    [
        ("surface", "standoff", "it belongs to [task]"),
        (
            "robot",
            "kind",
            "it belongs to [surface], [surface.pieces], [collision.scene] or [collision.tool]",
        ),
        ("task", "thickness", "it belongs to [collision]"),
        ("collision", "name", "it belongs to [robot], [robot.axis] or [collision.scene]"),
        ("collision", "cone_deg", "it belongs to [task]"),
        ("task", "time_limit", "it belongs to [search]"),
        ("task", "search", "it belongs to [search]"),
        ("surface", "within_deg", "it belongs to [surface.facing]"),
        ("search", "zzzz", "known are method, seed"),
    ],
)
def test_a_key_of_another_table_is_sent_there(table, line, words):
    tables = tables_of("sphere")
    tables[table][line] = 1
    assert words in faults_of(tables)[f"{table}.{line}"].message


NOTHING = ("x", True, math.nan, math.inf, [], {}, [0, math.nan, 0])


def edges_of(said):
    """Values that a type takes, and values that it refuses; None for types without edges."""
    if found := re.fullmatch(r"an? .*number in (\S+) \.\. (\S+)", said):
        low, high = map(float, found.groups())
        return [low, high], [low - 1e-6 * (1 + abs(low)), high * (1 + 1e-6) + 1e-9, *NOTHING]
    if found := re.fullmatch(r"a number > (\S+) and <= (\S+)", said):
        low, high = map(float, found.groups())
        return [low + 1e-6, high], [low, high * (1 + 1e-6), *NOTHING]
    if re.fullmatch(r"a finite number > 0", said):
        return [1e-3], [0, -1e-9, *NOTHING]
    if re.fullmatch(r"a finite number >= 0", said):
        return [0, 1e-3], [-1e-9, *NOTHING]
    if found := re.fullmatch(r"(?:'all' or )?a whole number >= (\d+)", said):
        low = int(found[1])
        return [low, low + 1], [low - 1, low + 0.5, float(low), 2**64, *NOTHING]
    if said.startswith("two whole numbers >= 1"):
        return [[1, 1], [2, 3]], [[0, 1], [1, 0], [1], [1, 1, 1], [1.0, 1], 1, *NOTHING]
    if said == "three finite numbers":
        return [[0, 0, 0], [1, -2.5, 3]], [[0, 0], [0, 0, 0, 0], 0, *NOTHING]
    if said == "three finite numbers that are not all zero":
        return [[0, 0, -1e-3]], [[0, 0, 0], [0, 0], [0, 0, 0, 1], *NOTHING]
    if said.startswith("a pair [low, high]"):
        return [], [[0.5, 0.5], [0.6, 0.4], [0.1], [0.1, 0.2, 0.3], 0.1, *NOTHING]
    if said.startswith("the path of"):
        return [], ["", " ", 0, True, math.nan, [], {}, ["part"]]
    if said == "true or false":
        return [True, False], [0, 1, "true", None, [], {}]
    if re.fullmatch(r"('\w+', )*'\w+' or '\w+'", said):
        return re.findall(r"'(\w+)'", said), ["inward", 0, *NOTHING]
    return None


RANGES = [key for key in all_keys() if edges_of(key.type)]


@pytest.mark.parametrize("key", RANGES, ids=title)
def test_reading_takes_what_the_reference_says_and_nothing_else(key):
    takes, refuses = edges_of(key.type)
    for value in takes:
        faults, name = with_value(key, value)
        assert not any(fault.startswith(name) for fault in faults), value
    for value in refuses:
        faults, name = with_value(key, value)
        assert any(fault.startswith(name) for fault in faults), value


def test_most_keys_have_such_a_type():
    assert len(RANGES) > 0.6 * len(all_keys())


@pytest.mark.parametrize("table", [*TABLES, *OTHERS])
def test_a_table_that_is_none_names_its_keys(table):
    kind, path, _ = OTHERS.get(table, ("sphere", (table,), {}))
    tables = tables_of(kind or "sphere")
    place = tables[table.split(".")[0]] if table in OTHERS else tables
    place[path[0]] = [5] if path[1:] else 5
    said = str(faults_of(tables)[table + "[0]" * len(path[1:])].message)
    assert said.startswith("must be a table")
    assert ", ".join(keys_of(table)) in said


def test_a_missing_table_names_its_keys():
    said = faults_of({})["task"].message
    assert "standoff, cone_deg" in said
    assert "cone_deg = 45" in said


def test_the_reference_has_every_field_and_its_default():
    assert set(keys_of("robot")) == {*RobotPart.__dataclass_fields__}
    assert set(keys_of("search")) == {*Search.__dataclass_fields__}
    own = {"self" if name == "self_" else name for name in CollisionPart.__dataclass_fields__}
    assert set(keys_of("collision")) == own
    for name in ("clearance", "tool_clearance", "thickness", "shapes", "surface"):
        value = tomllib.loads(f"x = {keys_of('collision')[name].default}")["x"]
        assert value == getattr(CollisionPart(), name) == getattr(Collision(), name)
    for key in keys_of("search").values():
        value = getattr(Search(), key.name)
        if value is None:
            continue
        assert tomllib.loads(f"x = {key.default}")["x"] == value
    plain = SurfacePart("plane", {}, (1, 1))
    for name in ("position", "rpy_deg"):
        assert tuple(tomllib.loads(f"x = {keys_of('surface')[name].default}")["x"]) == getattr(
            plain, name
        )
    assert keys_of("surface")["side"].default.startswith(plain.side)
    tolerance = Case.from_toml(GOOD).task.effective_tolerance
    assert float(keys_of("task")["tolerance"].default.split(";")[0]) == tolerance


def test_every_kind_has_its_keys():
    assert set(kinds()) == {*PAPER, *SURFACES}


def test_every_key_says_what_it_is():
    for key in all_keys():
        assert key.type, title(key)
        assert re.fullmatch(r"\S.*\.", key.meaning), title(key)
        assert key.name.endswith("_deg") == (key.unit.split("/")[0] == "deg"), title(key)
        assert "|" not in f"{key.type}{key.meaning}{key.default}", title(key)


def test_the_page_of_the_reference_is_in_step():
    from feasibility.reports.keys import as_page

    page = Path(__file__).parents[3] / "docs" / "keys.md"
    assert page.read_text("utf-8") == as_page(), "run: python docs/keys.py"


def test_a_case_may_have_as_many_pieces_and_cells_as_the_surfaces():
    assert surface_pieces.MOST_PIECES == piecewise_surface.MOST_PIECES
    assert mesh_keys.MOST_MESH_CELLS == clustering.MOST_CELLS
