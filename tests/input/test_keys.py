"""The reference of keys is what reading does: every key is known, judged, and said in messages."""

import copy
import datetime
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import bad_input
import pytest

from coverable import Case, CaseError, Collision, Search
from coverable.errors import MISSING, Fault
from feasibility.cases.collision_table import CollisionPart
from feasibility.cases.keys import Key, all_keys, keys_of, own_keys
from feasibility.cases.toml import as_read
from feasibility.cases.toml_text import toml_document

Tables = dict[str, Any]
WRONG = datetime.date(2026, 1, 1)  # no key takes a date
ALTERNATIVES = {"name": "urdf", "urdf": "name", "points": "file", "file": "points",
                "cell_size": "cells", "colour": "faces",
                "limits_deg": "limits", "limits_m": "limits",
                "lock": "limits", "start": "start_deg", "start_deg": "start"}  # fmt: skip
UNITS = {"degrees": "deg", "metres": "m", "seconds": "s"}
TABLES = ("robot", "surface", "task", "collision", "search")
OTHERS: dict[str, tuple[str, tuple[str | int, ...], Tables]] = {
    "robot.axis": ("", ("axis", 0), {"name": "rail", "type": "prismatic", "carries": "base",
                                     "limits_m": [0, 1]}),
    "robot.tcp": ("", ("tcp",), {}),
    "robot.base": ("", ("base",), {}),
    "surface.cut": ("mesh", ("cut",), {"point": [0, 0, 0], "normal": [0, 0, 1]}),
    "surface.facing": ("mesh", ("facing",), {"direction": [0, 0, 1], "within_deg": 30}),
    "surface.pieces": ("piecewise", ("pieces", 0), {"kind": "plane", "u": [0, 1], "v": [0, 1],
                                                    "cells": [3, 4]}),
    "collision.clearances": ("", ("clearances", 0), {"pair": ["a", "b"], "value": 0.1}),
    "collision.scene": ("", ("scene", 0), {"name": "post", "kind": "capsule", "radius": 0.1,
                                           "length": 1.0}),
    "collision.tool": ("", ("tool", 0), {"kind": "capsule", "radius": 0.1, "length": 1.0}),
}  # fmt: skip
OF_SHAPES = {"size": {"kind": "box", "size": [1, 1, 1]}, "file": {"kind": "mesh", "file": "a.stl"}}
OF_SHAPES["scale"] = OF_SHAPES["file"]
"""What an object is that has a key which a capsule has not."""


def tables_of(kind: str) -> Tables:
    good = bad_input.goods("case")
    tables = tomllib.loads(good.get(kind, good["sphere"]))
    if kind not in good:  # what its keys show makes one
        written = "\n".join(key.written for key in own_keys(kind).values())
        tables["surface"] = {"kind": kind, "cells": [3, 4], **tomllib.loads(written)}
    return {**tables, "search": {}, "collision": {}}


def place_of(key: Key) -> tuple[Tables, Tables, str]:
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


def faults_of(tables: Tables) -> dict[str, Fault]:
    """The faults of these tables, by key, but of what is left out here; a case comes back."""
    try:
        case = Case.from_toml(toml_document(tables))
        again = Case.from_toml(case.to_toml())
        assert (again, again.to_toml()) == (case, case.to_toml())
    except CaseError as error:
        return {
            fault.key: fault
            for fault in reversed(error.faults)
            if "there is no such file" not in fault.message
            and not (fault.key == "robot" and "robot" not in tables)
        }
    return {}


def with_value(key: Key, value: object) -> tuple[dict[str, Fault], str]:
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


def title(key: Key) -> str:
    return f"{key.table}:{key.kind}:{key.name}"


@pytest.mark.parametrize("key", all_keys(), ids=title)
def test_a_key_is_taken_judged_and_missed(key: Key) -> None:
    """Its example is accepted, a date is not, and where it is needed it alone is missed."""
    faults, _ = with_value(key, tomllib.loads(key.written)[key.name])
    assert not faults
    faults, name = with_value(key, WRONG)
    assert any(fault.startswith(name) for fault in faults)
    for fault in faults.values():
        unit = re.search(r"\((degrees|metres|seconds)\)", fault.message)
        assert unit is None or UNITS[unit[1]] == key.unit
    faults, name = with_value(key, MISSING)
    if key.default is None or key.default.startswith("needed by "):
        assert faults[name].message.startswith("is missing")
        assert "such as" in faults[name].message
    elif key.default.startswith("none: "):  # one of two is needed
        assert all(fault.message.startswith("is missing") for fault in faults.values())
        assert set(faults) & {name, f"{key.table}.{ALTERNATIVES[key.name]}"}
    elif key.name == "degree":  # (3, 3), for which the net is too small
        assert set(faults) == {"surface.points"}
    else:
        assert not faults
    assert key.type
    assert re.fullmatch(r"\S.*\.", key.meaning)
    assert key.name.endswith("_deg") == (key.unit.split("/")[0] == "deg")
    assert "|" not in f"{key.type}{key.meaning}{key.default}"


@pytest.mark.parametrize("table", [*TABLES, *OTHERS])
def test_a_table_names_its_keys_each_once(table: str) -> None:
    """Where a key is not known, and where the table is none."""
    key = next(key for key in all_keys() if key.table == table)
    tables, inner, name = place_of(key)
    inner["zzzz"] = 1
    known = re.search(r"known are (.*)$", faults_of(tables)[f"{name}.zzzz"].message)
    assert known
    assert known[1].split(", ") == list(keys_of(table, inner.get("kind", "")))
    kind, path, _ = OTHERS.get(table, ("sphere", (table,), {}))
    tables = tables_of(kind or "sphere")
    place = tables[table.split(".")[0]] if table in OTHERS else tables
    place[path[0]] = [5] if path[1:] else 5
    said = faults_of(tables)[table + "[0]" * len(path[1:])].message
    assert said.startswith("must be a table")
    assert ", ".join(keys_of(table)) in said


NOTHING = ("x", True, math.nan, math.inf, [], {}, [0, math.nan, 0])


def edges_of(said: str) -> tuple[list[Any], list[Any]] | None:
    """Values that a type takes, and values that it refuses; None for types without edges."""
    if found := re.fullmatch(r"an? .*number in (\S+) \.\. (\S+)", said):
        low, high = map(float, found.groups())
        return [low, high], [low - 1e-6 * (1 + abs(low)), high * (1 + 1e-6) + 1e-9, *NOTHING]
    if found := re.fullmatch(r"a number > (\S+) and <= (\S+)", said):
        low, high = map(float, found.groups())
        return [low + 1e-6, high], [low, high * (1 + 1e-6), *NOTHING]
    if found := re.fullmatch(r"(?:'all' or )?a whole number >= (\d+)", said):
        low = int(found[1])
        return [low, low + 1], [low - 1, low + 0.5, float(low), 2**64, *NOTHING]
    if re.fullmatch(r"('\w+', )*'\w+' or '\w+'", said):
        return re.findall(r"'(\w+)'", said), ["inward", 0, *NOTHING]
    starts = {
        "a finite number > 0": ([1e-3], [0, -1e-9, *NOTHING]),
        "a finite number >= 0": ([0, 1e-3], [-1e-9, *NOTHING]),
        "two whole numbers >= 1": ([[1, 1], [2, 3]],
                                   [[0, 1], [1, 0], [1], [1, 1, 1], [1.0, 1], 1, *NOTHING]),
        "three finite numbers": ([[1, -2.5, 3]], [[0, 0], [0, 0, 0, 0], 0, *NOTHING]),
        "three finite numbers that are not all zero": ([[0, 0, -1e-3]], [[0, 0, 0]]),
        "a pair [low, high]": ([], [[0.5, 0.5], [0.6, 0.4], [0.1], [0.1, 0.2, 0.3], 0.1, *NOTHING]),
        "the path of": ([], ["", " ", 0, True, math.nan, [], {}, ["part"]]),
        "true or false": ([True, False], [0, 1, "true", [], {}]),
    }  # fmt: skip
    fits = [one for one in starts if re.fullmatch(rf"{re.escape(one)}(?! > 0)( .*|,.*)?", said)]
    return starts[max(fits, key=len)] if fits else None


RANGES = [key for key in all_keys() if edges_of(key.type)]
assert len(RANGES) > 0.6 * len(all_keys())


@pytest.mark.parametrize("key", RANGES, ids=title)
def test_reading_takes_what_the_reference_says_and_nothing_else(key: Key) -> None:
    edges = edges_of(key.type)
    assert edges
    for taken, values in zip((True, False), edges, strict=True):
        for value in values:
            faults, name = with_value(key, value)
            assert any(fault.startswith(name) for fault in faults) != taken, value


def test_the_reference_has_every_default() -> None:
    plain = Case.from_toml(toml_document({**tables_of("sphere"), "search": {}}))
    tables = plain.to_tables()
    for table in ("surface", "search"):
        for key in keys_of(table).values():
            value = tables[table].get(key.name)
            if key.name not in tables_of("sphere")[table] and value is not None:
                assert as_read(value) == tomllib.loads(f"x = {key.default}")["x"]
    assert str(keys_of("surface")["side"].default).startswith(plain.surface.side)
    tolerance = plain.task.effective_tolerance
    assert float(str(keys_of("task")["tolerance"].default).split(";")[0]) == tolerance
    for name in ("clearance", "tool_clearance", "thickness", "shapes", "surface"):
        value = tomllib.loads(f"x = {keys_of('collision')[name].default}")["x"]
        assert value == getattr(CollisionPart(), name) == getattr(Collision(), name)
    assert set(keys_of("search")) == {*Search.__dataclass_fields__}


def test_the_page_of_the_reference_is_in_step() -> None:
    from feasibility.reports.keys import as_page

    page = Path(__file__).parents[2] / "docs" / "keys.md"
    assert page.read_text("utf-8") == as_page(), "run: python docs/keys.py"
