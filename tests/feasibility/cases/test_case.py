"""Cases: what a file may say, that it comes back exactly, and that every fault is named."""

import math
import os
import pickle
import string
from dataclasses import replace

import numpy as np
import pytest
from bad_cases import BAD_CASES, GOOD, write
from hypothesis import given, settings
from hypothesis import strategies as st
from surface_parts import pairs, surfaces, triples

from feasibility import Search, Task
from feasibility.cases import Case, builtin_cases, load_case
from feasibility.cases.case import CaseError
from feasibility.cases.robot_table import RobotPart
from feasibility.cases.surface_keys import MOST_CELLS
from feasibility.cases.surface_table import SurfacePart

# Table II: position and cone; Table I by name; Table III by kind.
PAPER = {
    "4a": ("sphere", "set-1", (0, 0, 0), 45),
    "4b": ("sphere", "set-2", (0, 0, 0), 45),
    "4c": ("cylinder", "set-1", (0, 0, 0), 45),
    "4d": ("cylinder", "set-3", (0, 0, 0), 45),
    "4e": ("hyperboloid", "set-1", (0, 0, 0), 45),
    "4f": ("hyperboloid", "set-4", (0, 0, 0), 45),
    "5a": ("sphere", "set-1", (0, 0, 0), 5),
    "5b": ("sphere", "set-1", (0.005, 0, 0), 10),
    "5c": ("cylinder", "set-1", (0, 0.055, 0), 5),
    "5d": ("cylinder", "set-1", (0, 0.055, 0), 10),
    "5e": ("hyperboloid", "set-1", (1.095, 0, 0), 10),
    "5f": ("hyperboloid", "set-1", (1.15, 0, 0), 20),
}
SURFACES = {
    "sphere": {"radius": 1.0, "u_deg": (10.0, 90.0), "v_deg": (10.0, 180.0)},
    "cylinder": {"radius": 0.5, "u_deg": (-60.0, 60.0), "v": (0.0, 0.9)},
    "hyperboloid": {"radius": 0.5, "flare": 0.5, "u_deg": (130.0, 220.0), "v": (0.0, 0.5)},
}


def test_the_twelve_cases_of_the_paper_are_built_in():
    assert list(builtin_cases()) == [f"paper/{name}" for name in PAPER]
    for name, (kind, limits, position, cone) in PAPER.items():
        case = builtin_cases()[f"paper/{name}"]
        values = SURFACES[kind]
        assert case == Case(
            RobotPart(name="puma560", limits=limits),
            SurfacePart(kind, values, cells=(9, 10), position=tuple(map(float, position))),
            Task(standoff=0.005, cone_deg=float(cone)),
            Search(),
        )
        assert case.description
        assert case.name == f"paper/{name}"


def test_a_built_in_case_builds_what_the_paper_describes():
    robot, cells, task, search = load_case("paper/5e").build()
    assert (robot.name, robot.n, cells.shape, task.cone_deg) == ("puma560", 6, (9, 10), 10.0)
    assert np.degrees(robot.upper).tolist() == pytest.approx([180] * 6)
    assert cells.surface.side == "inside"
    # The middle cell of a row: height 0.225 m, angle 175 degrees, about the moved axis.
    k = cells.index(4, 4)
    radius = 0.5 * math.hypot(1.0, 0.225 / 0.5)
    angle = math.radians(175)
    expected = [1.095 + radius * math.cos(angle), radius * math.sin(angle), 0.225]
    assert cells.centres[k] == pytest.approx(expected, abs=1e-12)
    assert search == Search()


finite = st.floats(-1e6, 1e6)
names = st.text(
    st.characters(blacklist_categories=("Cs",), blacklist_characters="\0"), min_size=1, max_size=12
).filter(str.strip)


tables = st.dictionaries(names, pairs(-720, 720), min_size=1, max_size=3)


@st.composite
def robots(draw):
    limits = draw(
        st.sampled_from(
            [
                {},
                {"limits": draw(names)},
                {"limits_deg": tuple(draw(st.lists(pairs(-720, 720), min_size=1, max_size=4)))},
                {"limits_deg": draw(tables)},
            ]
        )
    )
    if not limits and draw(st.booleans()):
        limits = {"limits_m": draw(tables)}
    plain = st.text(string.ascii_letters + string.digits + "_- é", min_size=1).filter(str.strip)
    source = draw(
        st.sampled_from([{"name": draw(plain)}, {"urdf": os.path.abspath(draw(plain) + ".urdf")}])
    )
    axis = draw(st.none() | triples.filter(lambda a: math.hypot(*a) > 1e-6))
    fixed = (
        {}
        if "limits_deg" in limits or "limits_m" in limits
        else draw(st.dictionaries(names, finite, max_size=2))
    )
    return RobotPart(
        **source,
        **limits,
        approach_axis=axis,
        tool_frame=draw(st.none() | names),
        lock=fixed,
        package_dirs=tuple(draw(st.lists(plain.map(os.path.abspath), max_size=2))),
    )


positive = st.floats(1e-9, 1e6)
tasks = st.builds(Task, st.floats(0, 1e3), st.floats(0, 180), st.none() | positive)
searches = st.builds(
    Search,
    method=st.sampled_from(["complete", "greedy"]),
    seed=st.integers(0, 2**63 - 1),
    time_limit=st.none() | positive,
    step_deg=st.floats(1e-4, 30),
    moves=st.sampled_from(["single", "all"]),
    starts=st.just("all") | st.integers(1, 1000),
    cap=st.integers(1, 10**9),
)


@st.composite
def cases(draw):
    return Case(draw(robots()), draw(surfaces()), draw(tasks), draw(searches))


@given(cases())
@settings(max_examples=100)
def test_toml_gives_back_the_same_case(case):
    text = case.to_toml()
    again = Case.from_toml(text)
    assert again == case
    assert again.to_toml() == text
    assert case.with_overrides([]) == case


@pytest.mark.parametrize("name", BAD_CASES, ids=str)
def test_a_bad_case_is_refused_with_its_key_and_what_was_expected(name, tmp_path):
    path = write(tmp_path, BAD_CASES[name].content)
    with pytest.raises(CaseError) as caught:
        load_case(path).build()
    error = caught.value
    assert BAD_CASES[name].key in [fault.key for fault in error.faults]
    for words in BAD_CASES[name].words:
        assert words in str(error)
    assert len(str(error)) < 6000
    assert str(error).isprintable() or all(line.isprintable() for line in str(error).split("\n"))


def test_all_faults_come_together():
    text = """
        colour = "red"
        [robot]
        name = "pumma560"
        limits = "set-1"
        limits_deg = [[10, -10]]
        [surface]
        kind = "sphere"
        radius = true
        u_deg = [90, 10]
        v_deg = [10, nan]
        celss = [9, 10]
        [task]
        cone_deg = 200
        [search]
        seed = 1.0
        moves = "sngle"
    """
    with pytest.raises(CaseError) as caught:
        Case.from_toml(text)
    assert sorted(fault.key for fault in caught.value.faults) == [
        "colour",
        "robot",
        "robot.limits",
        "robot.limits_deg[0]",
        "search.moves",
        "search.seed",
        "surface.cells",
        "surface.celss",
        "surface.radius",
        "surface.u_deg",
        "surface.v_deg",
        "task.cone_deg",
        "task.standoff",
    ]
    message = str(caught.value)
    assert message.startswith("case: 13 faults:\n  ")
    for words in ('"cells"', '"single"', "'puma560'", "the wrong way round", "got True"):
        assert words in message
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.faults) == (message, caught.value.faults)


def test_many_faults_stay_readable():
    rows = "\n".join(f"k{k} = 1" for k in range(3000))
    with pytest.raises(CaseError) as caught:
        Case.from_toml(GOOD + rows)
    assert len(caught.value.faults) == 3000
    assert len(str(caught.value).splitlines()) == 22
    assert str(caught.value).endswith("... and 2980 more")


def test_overrides_replace_add_and_remove_keys():
    case = load_case("paper/4a")
    changed = case.with_overrides(
        ["task.cone_deg=10", "surface.position=[0, 0.5, 0]", "robot.limits=set-2", "search.seed=7"]
    )
    assert changed == replace(
        case,
        robot=replace(case.robot, limits="set-2"),
        surface=replace(case.surface, position=(0.0, 0.5, 0.0)),
        task=Task(0.005, 10.0),
        search=Search(seed=7),
    )
    assert changed.name == "paper/4a"
    free = case.with_overrides(["robot.limits=", "robot.limits_deg.joint4=[-90, 90]"])
    assert free.robot == RobotPart(name="puma560", limits_deg={"joint4": (-90.0, 90.0)})
    assert case == load_case("paper/4a")  # unchanged


def test_an_override_removes_a_whole_table_and_makes_none_to_remove_from():
    case = Case.from_toml(GOOD, overrides=["collision.clearance=0.01", "search.seed=3"])
    assert case.with_overrides(["collision=", "search="]) == Case.from_toml(GOOD)
    assert Case.from_toml(GOOD, overrides=["collision.clearance="]).collision is None


def test_a_description_names_what_was_changed():
    """The built-in one speaks of the cone before: 45 deg beside an answer for 10 was misleading."""
    case = load_case("paper/4a", ["task.cone_deg=10", "search.seed=7"])
    assert case.description.endswith("cone 45 deg; changed: task.cone_deg=10, search.seed=7")
    assert load_case("paper/4a").description.endswith("cone 45 deg")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("task.cone_deg", "has no '='"),
        ("=5", "does not begin with a key"),
        ("task..cone=5", "does not begin with a key"),
        ("cone_deg=5", "needs a table and a key"),
        ("task.cone_deg=[1", "is not valid TOML"),
        ("task.cone_deg=1\nstandoff = 2", "more than one setting"),
        ("robot.limits.joint1=[0, 1]", "limits is not a table"),
        ("task.cone=5", 'did you mean "cone_deg"?'),
        ("task.cone_deg=ten", "got 'ten'"),
        ("task.cone_deg=nan", "got nan"),
        ("task.cone_deg=true", "got True"),
        ("surface.cells=[2000, 2000]", "coarser grid"),
        ("task.standoff=", "is missing"),
    ],
)
def test_bad_overrides_are_named(setting, words):
    with pytest.raises(CaseError, match="paper/4a") as caught:
        load_case("paper/4a", [setting])
    assert words in str(caught.value)


def test_an_override_can_complete_a_file(tmp_path):
    path = write(tmp_path, GOOD.replace("cone_deg = 45", ""))
    assert load_case(path, ["task.cone_deg=45"]) == Case.from_toml(GOOD)


def test_paths_are_relative_to_the_case_file(tmp_path, monkeypatch):
    (tmp_path / "meshes").mkdir()
    arm = GOOD.replace('name = "puma560"', 'urdf = "arm.urdf"\npackage_dirs = ["meshes"]')
    case = load_case(write(tmp_path, arm.replace('limits = "set-1"', "")))
    assert case.robot.urdf == str(tmp_path / "arm.urdf")
    assert case.robot.package_dirs == (str(tmp_path / "meshes"),)
    monkeypatch.chdir(tmp_path)
    assert Case.from_toml(case.to_toml()) == case
    assert case.with_overrides(["robot.urdf=other.urdf"]).robot.urdf == str(tmp_path / "other.urdf")


def test_limits_by_joint_name_replace_only_those(tmp_path):
    text = GOOD.replace('limits = "set-1"', "[robot.limits_deg]\njoint4 = [-90, 45]")
    robot = load_case(write(tmp_path, text)).build().robot
    plain = load_case("paper/4a", ["robot.limits="]).build().robot
    degrees = np.degrees(np.column_stack([robot.lower, robot.upper]))
    expected = np.degrees(np.column_stack([plain.lower, plain.upper]))
    expected[3] = [-90, 45]
    assert degrees == pytest.approx(expected, abs=1e-12)


SLIDER = """
<robot name="slider"><link name="base"/><link name="cart"/><link name="tool"/>
<joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="turn" type="continuous"><parent link="cart"/><child link="tool"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint></robot>
"""


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ("limits_deg = [[-10, 10], [-20, 20]]", "'slide', which slides; use limits_m"),
        ("limits_deg = { slide = [-10, 10] }", "'slide', which slides; use limits_m"),
        ("limits_m = { turn = [-1, 1] }", "'turn', which turns; use limits_deg"),
        ("limits_deg = { trun = [-10, 10] }", "no free joint 'trun'"),
        ("limits_deg = [[-10, 10]]", "shape (2, 2)"),
    ],
)
def test_limits_must_fit_the_joints(tmp_path, limits, words):
    (tmp_path / "arm.urdf").write_text(SLIDER)
    text = GOOD.replace('name = "puma560"', 'urdf = "arm.urdf"')
    case = load_case(write(tmp_path, text.replace('limits = "set-1"', limits)))
    with pytest.raises(CaseError) as caught:
        case.build()
    assert {fault.key.partition(".")[0] for fault in caught.value.faults} == {"robot"}
    assert words in str(caught.value)


def test_sliding_and_turning_joints_have_their_own_units(tmp_path):
    (tmp_path / "arm.urdf").write_text(SLIDER)
    text = GOOD.replace('name = "puma560"', 'urdf = "arm.urdf"').replace(
        'limits = "set-1"', "limits_deg = { turn = [-90, 450] }\nlimits_m = { slide = [0, 0.5] }"
    )
    robot = load_case(write(tmp_path, text)).build().robot
    assert robot.lower.tolist() == pytest.approx([0.0, -math.pi / 2])
    assert robot.upper.tolist() == pytest.approx([0.5, 2.5 * math.pi])


@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "missing", "unnamed", "link"])
def test_only_regular_files_are_read(tmp_path, kind):
    path = tmp_path / "case.toml"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path = "/dev/zero"
    elif kind == "link":
        path.symlink_to(tmp_path / "nowhere")
    elif kind == "unnamed":
        path = ""
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert len(caught.value.faults) == 1


def test_an_unknown_name_is_answered_with_the_nearest_case():
    with pytest.raises(CaseError, match=r'did you mean "paper/4a"\?'):
        load_case("paper/4A")


def test_a_file_may_have_windows_line_ends_and_a_byte_order_mark(tmp_path):
    path = write(tmp_path, b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_case(path) == Case.from_toml(GOOD)


def test_grids_from_one_cell_to_the_cap():
    one = load_case("paper/4a", ["surface.cells=[1, 1]"])
    assert len(one.build().cells) == 1
    side = math.isqrt(MOST_CELLS)
    assert load_case("paper/4a", [f"surface.cells=[{side}, {side}]"]).surface.cells == (side, side)


POSED = """
[robot]
name = "ur5"
tcp = { position = [0, 0, 0.12] }
base = { position = [0, 0, 0.8], rpy_deg = [0, 0, 90] }
reference_axis = [0, 1, 1]
[surface]
kind = "plane"
u = [0, 0.2]
v = [0, 0.1]
cells = [2, 1]
[task]
standoff = 0.0
cone_deg = 30
"""


def test_tcp_base_and_reference_axis_come_through():
    case = Case.from_toml(POSED)
    assert Case.from_toml(case.to_toml()) == case
    robot = case.with_overrides(["robot.tcp.rpy_deg=[0, 90, 0]"]).build().robot
    np.testing.assert_allclose(
        robot.tcp[:3], [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.12]], atol=1e-12
    )
    np.testing.assert_allclose(
        robot.base[:3], [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0.8]], atol=1e-12
    )
    np.testing.assert_allclose(robot.reference_axis, [0, 1, 0])


def test_faults_of_tcp_and_base_are_said_together():
    with pytest.raises(CaseError) as caught:
        Case.from_toml(
            POSED,
            overrides=[
                "robot.tcp.position=[0, 0, 10000]",
                "robot.base.rpy=[0, 0, 90]",
                "robot.reference_axis=[0, 0, 1]",
                "robot.approach_axis=[0, 0, 2]",
            ],
        )
    assert [fault.key for fault in caught.value.faults] == [
        "robot.base.rpy",
        "robot.reference_axis",
        "robot.tcp.position",
    ]


MOUNTED = POSED.replace(
    "[surface]",
    """[[robot.axis]]
name = "rail"
type = "prismatic"
carries = "base"
axis = [0, 1, 0]
limits_m = [-0.5, 0.5]
max_velocity_m = 0.7
[[robot.axis]]
name = "table"
type = "revolute"
carries = "surface"
position = [0.6, 0, 0]
limits_deg = [-90, 90]
max_velocity_deg = 90
[surface]""",
)


def test_composed_axes_come_through():
    case = Case.from_toml(MOUNTED)
    assert Case.from_toml(case.to_toml()) == case
    robot = case.build().robot
    assert robot.joint_names[:2] == ("table", "rail")
    assert robot.surface_link == "table"
    np.testing.assert_allclose(robot.upper[:2], [np.pi / 2, 0.5])
    np.testing.assert_allclose(robot.max_velocity[:2], [np.pi / 2, 0.7])
    other = case.with_overrides(["surface.frame=forearm_link"]).build().robot
    assert other.joint_names == ("wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
    assert case.with_overrides(["robot.limits_m={ rail = [0, 0.1] }"]).build().robot.upper[1] == 0.1


@pytest.mark.parametrize(
    ("setting", "key", "message"),
    [
        ("surface.frame=nowhere", "surface.frame", "no link 'nowhere' that could carry"),
        ("surface.frame=wrist_3_link", "surface.frame", "it moves with the tool"),
        ("surface.frame=3", "surface.frame", "the name of a link"),
        ("robot.axis=3", "robot.axis", "an array of tables"),
        ("robot.axis=[{ name = 'a', type = 'prismatic', carries = 'base', limits_deg = [0, 1] }]",
         "robot.axis[0].limits_deg", "use limits_m"),
        ("robot.axis=[{ name = 'a', type = 'revolute', carries = 'tool' }]",
         "robot.axis[0].carries", "'base' or 'surface'"),
        ("robot.axis=[{ type = 'revolute', carries = 'base' }]", "robot.axis[0].name", "missing"),
        ("robot.axis=[{ name = 'tool0', type = 'revolute', carries = 'base' }]", "robot.axis",
         "is the name of a link already"),
        ("robot.start=[0, 0, 0]", "robot.start", "has 3 values; expected one for each of table, r"),
        ("robot.start_deg=[0, 0, 0, 0, 0, 0, 0, 0]", "robot.start_deg", "'rail', which slides"),
        ("robot.start=[9, 0, 0, 0, 0, 0, 0, 0]", "robot.start", "puts joint 'table' at 9, outside"),
        ("robot.start=[0, nan]", "robot.start", "numbers"),
    ],
)  # fmt: skip
def test_faults_of_axes_frames_and_starts(setting, key, message):
    with pytest.raises(CaseError) as caught:
        Case.from_toml(MOUNTED, overrides=[setting]).build()
    found = {fault.key: fault for fault in caught.value.faults}
    assert message in found[key].message
