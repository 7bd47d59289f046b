"""Study files: the tasks they make, against products and counts; every fault with its place."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest

from coverable_errors import worded
from feasibility.cases import Case, as_read, load_case, toml_document
from feasibility.cases.case import CaseError
from feasibility.studies import load_study
from feasibility.studies.file import read_study

GRID = """
base.case = "paper/4a"
[vary]
robots = ["ur5", { name = "puma560", limits = "set-2" }]
"task.cone_deg" = [20, 45]
"surface.position" = { x = [0.0, 0.1], z = { from = 0, to = 1, steps = 3 } }
[vary.surface]
cells = [[3, 4], [9, 10]]
"""

SAMPLED = """
base.case = "paper/4a"
[vary]
"surface.position" = { x = { range = [-0.5, 0.5] }, y = { range = [1, 3] } }
"surface.rpy_deg".yaw = { range = [-90, 90] }
"task.standoff" = { range = [0.001, 0.01] }
sampler = "sobol"
count = 50
seed = 3
"""


def test_tasks_are_the_product_in_order() -> None:
    study = read_study(GRID)
    robots = ["ur5", {"name": "puma560", "limits": "set-2"}]
    product = list(
        itertools.product(robots, [20.0, 45.0], [0.0, 0.1], [0.0, 0.5, 1.0], [[3, 4], [9, 10]])
    )
    labels = "robot", "task.cone_deg", "surface.position.x", "surface.position.z", "surface.cells"
    assert study.labels == labels
    assert [tuple(task.parameters.values()) for task in study.tasks] == product
    assert len({task.key for task in study.tasks}) == len(product) == 48
    for task, (robot, cone, x, z, cells) in zip(study.tasks, product, strict=True):
        tables = task.tables
        assert tables["robot"] == ({"name": robot} if isinstance(robot, str) else robot)
        assert tables["task"]["cone_deg"] == cone
        assert tables["surface"]["position"] == [x, 0.0, z]
        assert tables["surface"]["cells"] == cells


def test_tasks_are_cases_written_in_full() -> None:
    """What a task holds is what the case of it writes: so keys do not depend on how it is said."""
    for study in (read_study(GRID), read_study(SAMPLED)):
        for task in study.tasks:
            case = Case.from_toml(toml_document(task.tables))
            assert json.loads(json.dumps(task.tables)) == as_read(case.to_tables())


def test_arms_stand_where_the_case_has_its_arm_unless_they_say_otherwise() -> None:
    text = """
        base.case = "paper/4a"
        base.robot = { name = "puma560", base = { position = [0, 0, 0.1] } }
        vary.robots = ["ur5", { name = "ur10", base = { position = [0, 0, 0.2] } }]
    """
    one, other = (task.tables["robot"] for task in read_study(text).tasks)
    assert (one["name"], one["base"]["position"]) == ("ur5", [0.0, 0.0, 0.1])
    assert other["base"]["position"] == [0.0, 0.0, 0.2]


def test_the_key_says_what_a_task_is_and_nothing_else() -> None:
    def keys(text: str) -> list[str]:
        return [task.key for task in read_study(text).tasks]

    plain = keys('base.case = "paper/4a"\nvary."task.cone_deg" = [20, 30]')
    said_otherwise = keys(
        'vary.task.cone_deg = { from = 20.0, to = 30.0, steps = 2 }\ndescription = "same"\n'
        'base = { case = "paper/4a", task = { cone_deg = 7 }, surface = { position = [0, 0, 0] } }'
    )
    assert plain == said_otherwise
    assert keys('base.case = "paper/4a"\nvary."task.cone_deg" = [30, 20]') == plain[::-1]
    other = keys('base.case = "paper/4a"\nbase.search.seed = 1\nvary."task.cone_deg" = [20, 30]')
    assert not set(other) & set(plain)


COLLISION = """
base.case = "paper/4a"
base.collision.scene = [{ name = "part", kind = "mesh", file = "a.stl" }]
base.collision.srdf = "a.srdf"
[vary]
"collision.clearance" = [0.0, 0.01]
[vary.collision]
tool = [[], [{ kind = "mesh", file = "b.stl" }]]
"""


def test_collisions_vary_and_their_files_count(tmp_path) -> None:
    files = [tmp_path / name for name in ("a.stl", "a.srdf", "b.stl")]

    def tasks(changed: int | None = None):
        for k, file in enumerate(files):
            file.write_text("new content" if k == changed else "old")
        return read_study(COLLISION, tmp_path).tasks

    first = tasks()
    tables = [task.tables["collision"] for task in first]
    assert [(table["clearance"], len(table.get("tool", []))) for table in tables] == [
        (0.0, 0), (0.0, 1), (0.01, 0), (0.01, 1)
    ]  # fmt: skip
    assert tables[0]["scene"][0]["file"] == str(files[0])
    assert tables[0]["srdf"] == str(files[1])
    assert tables[1]["tool"][0]["file"] == str(files[2])
    keys = [task.key for task in first]
    assert len(set(keys)) == 4
    for changed, same in ((0, []), (1, []), (2, [0, 2])):
        after = [task.key for task in tasks(changed)]
        assert [k for k in range(4) if after[k] == keys[k]] == same, changed


def test_a_changed_file_is_another_task(tmp_path) -> None:
    solid = "solid a\n{}endsolid a\n"
    facet = (
        "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 0.1 0 {z}\nvertex 0 0.1 {z}\n"
        "endloop\nendfacet\n"
    )
    text = (
        'base.robot.name = "ur5"\nbase.surface = { kind = "mesh", file = "a.stl", scale = 1.0, '
        'cells = 2, side = "outside" }\n'
        'base.task = { standoff = 0.01, cone_deg = 30 }\nvary."task.cone_deg" = [20]'
    )

    def key(z: float) -> str:
        (tmp_path / "a.stl").write_text(solid.format(facet.format(z=z)))
        (task,) = read_study(text, tmp_path).tasks
        assert task.tables["surface"]["file"] == str(tmp_path / "a.stl")
        return task.key

    assert key(0.0) != key(0.5)
    assert key(0.0) == key(0.0)


def test_samples_are_a_sobol_sequence_in_the_ranges() -> None:
    tasks = read_study(SAMPLED).tasks
    values = np.array([list(task.parameters.values()) for task in tasks])
    low, high = np.array([[-0.5, 1, -90, 0.001], [0.5, 3, 90, 0.01]])
    assert values.shape == (50, 4)
    unit = (values - low) / (high - low)
    assert ((unit >= 0) & (unit <= 1)).all()
    # Any 2^k points of the sequence have one point in each of the 2^k slices of every axis.
    for axis in range(4):
        assert sorted((32 * unit[:32, axis]).astype(int)) == list(range(32))
    again = read_study(SAMPLED).tasks
    assert [task.key for task in again] == [task.key for task in tasks]
    other = read_study(SAMPLED.replace("seed = 3", "seed = 4")).tasks
    assert not {task.key for task in other} & {task.key for task in tasks}
    more = read_study(SAMPLED.replace("count = 50", "count = 64")).tasks
    assert [task.key for task in more[:50]] == [task.key for task in tasks]


def test_steps_are_even_and_end_where_they_should() -> None:
    tasks = read_study(
        'base.case = "paper/4a"\nvary."task.cone_deg" = { from = 45, to = 10.1, steps = 7 }'
    ).tasks
    values = [task.parameters["task.cone_deg"] for task in tasks]
    assert values == pytest.approx(np.linspace(45, 10.1, 7), abs=1e-12)
    assert values[0] == 45
    assert values[-1] == 10.1


def test_the_base_is_a_case_with_keys_replaced(tmp_path) -> None:
    (tmp_path / "mine.toml").write_text(load_case("paper/5a").to_toml())
    vary = '\nvary."task.cone_deg" = [20]'
    plain = read_study('base.case = "mine.toml"' + vary, tmp_path).tasks[0].tables
    mine = as_read(load_case("paper/5a").to_tables())
    mine["task"]["cone_deg"] = 20.0
    assert plain == mine
    changed = read_study(
        'base.case = "mine.toml"\nbase.robot.name = "ur5"\nbase.task.standoff = 0.02' + vary,
        tmp_path,
    )
    mine["robot"], mine["task"]["standoff"] = {"name": "ur5"}, 0.02
    assert changed.tasks[0].tables == mine


FAULTY = {
    # text: places that have to be named, each with a word of what is said there
    """
    a = 1
    """: {"a": "is not known", "base": "missing", "vary": "missing"},
    """
    base.case = "paper/4z"
    base.taks = {}
    vary.count = 3
    """: {"base.case": "did you mean", "base.taks": "not known", "vary.count": "range"},
    """
    base.case = "paper/4a"
    vary = {}
    """: {"vary": "empty"},
    """
    base = 3
    vary = 4
    """: {"base": "a table", "vary": "a table"},
    """
    base.case = "paper/4a"
    base.robot = 3
    vary.task = 5
    vary.robots = []
    vary.seed = -1
    """: {"base.robot": "table", "vary.task": "table", "vary.robots": "array", "vary.seed": ">= 0"},
    """
    base.case = "paper/4a"
    [vary]
    robots = ["ur5", "urfive", { name = "ur5", limitss = 3 }, 7]
    """: {"vary.robots[3]": "a name or a table"},
    """
    base.case = "paper/4a"
    [vary]
    robots = ["ur5", "urfive", { name = "ur5", limitss = 3 }, { urdf = "none.urdf" }]
    "task.cone_deg" = [20, -1, nan, "a", true]
    "task.standof" = [1]
    "surface.radius" = { from = 1, to = 1, steps = 1 }
    "surface.cells" = [[1, 2], [3]]
    """: {
        "vary.robots[1]": "no robot",
        "vary.robots[2]": "limitss",
        "vary.robots[3]": "no such file",
        "vary.task.cone_deg[1]": "0 .. 180",
        "vary.task.cone_deg[2]": "0 .. 180",
        "vary.task.cone_deg[3]": "0 .. 180",
        "vary.task.cone_deg[4]": "0 .. 180",
        "vary.task.standof[0]": "standoff",
        "vary.surface.radius.steps": "2 ..",
        "vary.surface.cells[1]": "two whole numbers",
    },
    """
    base.case = "paper/4a"
    [vary]
    sampler = "halton"
    "surface.position" = { x = { range = [1, 1] }, y = { range = [2, 1] }, w = 1, z = [] }
    "surface.rpy_deg" = { roll = { range = [1, nan] }, yaw = ["a"] }
    "task.cone_deg" = { range = [100, 200] }
    """: {
        "vary.sampler": "sobol",
        "vary.surface.position.x.range": "empty range",
        "vary.surface.position.y.range": "wrong way round",
        "vary.surface.position.w": "x, y or z",
        "vary.surface.position.z": "is empty",
        "vary.surface.rpy_deg.roll.range": "finite",
        "vary.surface.rpy_deg.yaw": "finite",
        "vary.task.cone_deg[1]": "0 .. 180",
        "vary.count": "missing",
    },
    """
    base.case = "paper/4a"
    [vary]
    robots = ["puma560", "ur5"]
    "robot.limits" = ["set-1", "set-9"]
    """: {"vary.robots[1]": "no limit set", "vary.robot.limits[1]": "set-9"},
    """
    base.case = "paper/4a"
    [vary]
    "task.cone_deg" = 30
    "surface.position" = 2024-01-01
    """: {'vary."surface.position"': "date"},
    """
    base.case = "paper/4a"
    [vary]
    "task.cone_deg" = [30]
    task.cone_deg = [40]
    """: {"vary.task.cone_deg": "written twice"},
    """
    base.case = "paper/4a"
    [vary]
    [vary.surface.position]
    x = { from = 0, to = 1, steps = 2000 }
    y = { from = 0, to = 1, steps = 999 }
    """: {"vary": "1998000 tasks"},
    """
    base.case = "paper/4a"
    [vary]
    "task.cone_deg" = { from = 10, to = 45, steps = 20000 }
    """: {"vary": "20000 cases"},
    "base = [": {"": "TOML"},
}  # fmt: skip


@pytest.mark.parametrize("text", FAULTY)
def test_every_fault_is_told_with_its_place(text: str) -> None:
    with pytest.raises(CaseError) as caught:
        read_study(text)
    faults = caught.value.faults
    for place, word in FAULTY[text].items():
        told = [
            fault
            for fault in faults
            if fault.key.split(": ")[0] == place and word in worded(fault, ": ")
        ]
        assert told, f"nothing about {place} with {word!r} in {faults}"


def test_combinations_that_make_no_case_are_told() -> None:
    """Each value is good with the first of the other; the two last ones together are not."""
    with pytest.raises(CaseError, match=r"robot = 'ur5'.*joint1.*: robot: .*no free joint"):
        read_study(
            'base.case = "paper/4a"\nbase.robot.name = "puma560"\n'
            'vary.robots = ["puma560", "ur5"]\nvary."robot.limits_deg" = ['
            "[[-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90]], "
            "{ joint1 = [-90, 90] }]"
        )


def test_a_cause_is_told_once_for_all_combinations_that_have_it() -> None:
    """Three limits and three cones with each of two arms: six bad combinations, two causes."""
    whole = "[[-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90]]"
    with pytest.raises(CaseError) as caught:
        read_study(
            'base.case = "paper/4a"\nbase.robot.name = "puma560"\n'
            'vary.robots = ["puma560", "ur5"]\n"vary"."task.cone_deg" = [20, 30, 45]\n'
            f'vary."robot.limits_deg" = [{whole}, {{ joint1 = [-90, 90] }}, {{ joint2 = [0, 9] }}]'
        )
    faults = [(fault.key, fault.message) for fault in caught.value.faults]
    assert len(faults) == 2
    for joint, (key, message) in zip(("joint1", "joint2"), faults, strict=True):
        assert key.startswith(f"vary: with robot = 'ur5', robot.limits_deg = {{'{joint}'")
        assert "cone" not in key
        assert f"no free joint '{joint}'" in message
        assert message.endswith("(3 combinations with that)")


def test_values_that_are_wrong_alike_are_counted() -> None:
    with pytest.raises(CaseError) as caught:
        read_study(
            'base.case = "paper/4a"\nvary."task.standoff" = [0.1, -1, -2]\n'
            'vary."task.cone_deg" = { from = 170, to = 200, steps = 31 }'
        )
    told = {fault.key: fault.message for fault in caught.value.faults}
    assert [key.split(":")[0] for key in told] == [
        *(f"vary.task.standoff[{k}]" for k in (1, 2)),
        *(f"vary.task.cone_deg[{k}]" for k in (11, 12, 13)),
        "vary.task.cone_deg",
    ]
    assert told["vary.task.cone_deg"].startswith("17 more values are no better for task.cone_deg")


def test_files_that_are_none(tmp_path) -> None:
    (tmp_path / "latin.toml").write_bytes(b"a = '\xff'")
    (tmp_path / "large.toml").write_bytes(b"#" * 300_000)
    for name, word in (
        ("none.toml", "no such file"),
        (".", "is a folder"),
        ("latin.toml", "UTF-8"),
        ("large.toml", "larger than"),
    ):
        with pytest.raises(CaseError, match=word):
            load_study(tmp_path / name)


def test_junk_is_refused_in_one_piece() -> None:
    """Whatever stands for a value, the answer is a study or a CaseError with places."""
    junk = ["1", "-1", "0", "nan", "inf", "''", "'x'", "[]", "{}", "[[]]", "true", "1979-05-27",
            "[1, 'a']", "{ range = 3 }", "{ from = 'a', to = 1, steps = 2 }", "[[1, 2, 3]]",
            "{ range = [1, 2], steps = 3 }", "{ x = {} }", "{ x = 1 }", str(10**400)]  # fmt: skip
    places = [
        "base.case", "base.robot", "base.task.cone_deg", "vary.robots", 'vary."task.cone_deg"',
        'vary."surface.position"', "vary.surface.rpy_deg", "vary.count", 'vary."robot.limits_deg"',
        'vary."surface.position.x"', 'vary."search.seed"', 'vary."surface.u_deg"', 'vary.""',
        'vary."."', 'vary."robot.lock.a"', "description",
    ]  # fmt: skip
    good, told = 0, []
    for place, value in itertools.product(places, junk):
        case = "" if place == "base.case" else 'base.case = "paper/4a"\n'
        extra = "" if place.startswith("vary") else 'vary."task.cone_deg" = [30]\n'
        try:
            study = read_study(f"{case}{extra}{place} = {value}")
        except CaseError as error:
            told.append(error.faults)
        else:
            good += 1
            assert study.tasks
            assert all(math.isfinite(task.tables["task"]["cone_deg"]) for task in study.tasks)
    assert good > 5
    assert all(faults and all(fault.message for fault in faults) for faults in told)
