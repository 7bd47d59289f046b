"""Study files: the tasks they make, against products and counts; faults, all of them at once."""

import itertools
import json

import numpy as np
import pytest
from bad_input import goods
from jobs import run_coverable
from mesh_writers import GOOD

from coverable import Case, CaseError, CoverableError, load_case, load_study, read_study
from feasibility.cases.toml import as_read
from feasibility.cases.toml_text import toml_document
from feasibility.studies.reach_study import reach_case

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


def test_a_study_of_reach_is_a_case(tmp_path) -> None:
    good, file = goods("poses"), tmp_path / "b" / "reach.yaml"
    file.parent.mkdir()
    file.write_text(good["study"])
    (tmp_path / "package.xml").write_text("<package><name>parts</name></package>")
    (tmp_path / "b" / "a.pcd").write_text(good["cloud"])
    with pytest.raises(CoverableError, match=r"names package://parts/a\.ply; .*seen: parts"):
        reach_case(file)
    (tmp_path / "a.ply").write_bytes(GOOD["little.ply"])
    case = Case.from_toml(run_coverable("cases", file).out, base_dir=file.parent)
    asked = case.to_tables()["collision"]
    assert (asked["clearance"], asked["scene"][0]["name"]) == (0.01, "part")
    assert asked["allow"] == (("tool0", "part"), ("wrist_3_link", "part"))
    assert case.to_tables()["surface"]["neighbours"] == 250.0  # twice as far as the next
    (tmp_path / "b" / "a.pcd").write_text(good["cloud"].replace("2\n", "1\n").rsplit("\n", 2)[0])
    assert Case.from_toml(reach_case(file)).to_tables()["surface"]["neighbours"] == 1.0
    for bad in (good["study"].replace("b/a.pcd", "package.xml"), "pcd: a.pcd"):
        file.write_text(bad)
        with pytest.raises(CoverableError, match=r"a file in \.pcd|no study of REACH"):
            reach_case(file)


def keys(text: str, folder=None) -> list[str]:
    return [task.key for task in read_study(text, folder).tasks]


def test_tasks_are_the_product_in_order_and_cases_written_in_full() -> None:
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
        # What the case of it writes: so keys do not depend on how it is said.
        case = Case.from_toml(toml_document(tables))
        assert json.loads(json.dumps(tables)) == as_read(case.to_tables())


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
    assert keys(SAMPLED) == [task.key for task in tasks]
    assert not set(keys(SAMPLED.replace("seed = 3", "seed = 4"))) & set(keys(SAMPLED))
    assert keys(SAMPLED.replace("count = 50", "count = 64"))[:50] == keys(SAMPLED)


def test_the_base_is_a_case_with_keys_replaced(tmp_path) -> None:
    (tmp_path / "mine.toml").write_text(load_case("paper/5a").to_toml())
    text = (
        'base.case = "mine.toml"\nbase.robot = { name = "ur5", base.position = [0, 0, 0.1] }\n'
        'base.task.standoff = 0.02\nvary."task.cone_deg" = [20]\n'
        'vary.robots = ["ur3", { name = "ur10", base.position = [0, 0, 0.2] }]'
    )
    mine = as_read(load_case("paper/5a").to_tables())
    mine["task"] |= {"cone_deg": 20.0, "standoff": 0.02}
    for task, name, z in zip(
        read_study(text, tmp_path).tasks, ("ur3", "ur10"), (0.1, 0.2), strict=True
    ):  # arms stand where the case has its arm, unless they say otherwise
        assert (task.tables["robot"]["name"], task.tables["task"]) == (name, mine["task"])
        assert task.tables["robot"]["base"]["position"] == [0.0, 0.0, z]
        assert task.tables["surface"] == mine["surface"]


def test_the_key_says_what_a_task_is_and_nothing_else() -> None:
    plain = keys('base.case = "paper/4a"\nvary."task.cone_deg" = [20, 30]')
    said_otherwise = keys(
        'vary.task.cone_deg = { from = 20.0, to = 30.0, steps = 2 }\ndescription = "same"\n'
        'base = { case = "paper/4a", task = { cone_deg = 7 }, surface = { position = [0, 0, 0] } }'
    )
    assert plain == said_otherwise
    assert keys('base.case = "paper/4a"\nvary."task.cone_deg" = [30, 20]') == plain[::-1]
    other = keys('base.case = "paper/4a"\nbase.search.seed = 1\nvary."task.cone_deg" = [20, 30]')
    assert not set(other) & set(plain)


WHOLE = "[[-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90], [-90, 90]]"
VARY = 'base.case = "paper/4a"\n[vary]\n'
ARMS = 'base.case = "paper/4a"\nbase.robot.name = "puma560"\nvary.robots = ["puma560", "ur5"]\n'
FAULTY = [
    "a = 1\ndescription = 5",
    "base = [",
    "base = 3\nvary = 4",
    'base.case = "paper/4z"\nbase.taks = {}\nvary.count = 3',
    'base.case = "paper/4a"\nvary = {}',
    'base.case = "none.toml"\nother = 1\nvary.robbots = 1',
    'base.case = "paper/4a"\nbase.robot = 3\nvary.task = 5\nvary.robots = []\nvary.seed = -1',
    VARY + 'robots = ["ur5", "urfive", { name = "ur5", limitss = 3 }, { urdf = "none.urdf" }]\n'
    '"task.cone_deg" = [20, -1, nan, "a", true]\n"task.standof" = [1]\n'
    '"surface.radius" = { from = 1, to = 1, steps = 1 }\n"surface.cells" = [[1, 2], [3]]',
    VARY + 'robots = ["ur5", 7]\n"task.cone_deg" = []\n"surface.position" = { x = nan }',
    VARY + '"surface.position".y = { range = [0.4, 0.2] }\n"surface.position".z = { range = [0.4, '
    '0.4] }\n"surface.position".x = { range = [0.4, inf] }\n"surface.positon" = [1]\ncount = 4',
    VARY + 'robots = ["puma560", "ur5"]\n"robot.limits" = ["set-1", "set-9"]',
    VARY + '"task.cone_deg" = 30\n"surface.position" = 2024-01-01',
    VARY + '"task.cone_deg" = [30]\ntask.cone_deg = [40]\n"task.standoff" = { range = [0, 1] }',
    VARY + '"surface.position" = { x = { from = 0, to = 1, steps = 2000 }, '
    "y = { from = 0, to = 1, steps = 999 } }",
    VARY + '"task.cone_deg" = { from = 10, to = 45, steps = 20000 }',
    VARY + '"task.standoff" = [0.1, -1, -2]\n'
    '"task.cone_deg" = { from = 170, to = 200, steps = 31 }',
    # each value is good with the first of the other; causes are told once for all that have them
    f'{ARMS}vary."robot.limits_deg" = [{WHOLE}, {{ joint1 = [-90, 90] }}, {{ joint2 = [0, 9] }}]\n'
    '"vary"."task.cone_deg" = [20, 30, 45]',
]


def test_every_fault_is_told_with_its_place(approved, tmp_path) -> None:
    told = []
    for text in FAULTY:
        with pytest.raises(CaseError) as caught:
            read_study(text, tmp_path)
        assert all(fault.message for fault in caught.value.faults)
        told.append(f"{' ; '.join(text.splitlines())}\n-> {caught.value}")
    approved("faulty_studies", "\n".join(told))
    (tmp_path / "latin.toml").write_bytes(b"a = '\xff'")
    with pytest.raises(CaseError, match="UTF-8"):
        load_study(tmp_path / "latin.toml")
