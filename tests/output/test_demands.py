"""Whatever a case demands, no command says "feasible" or "holds" where it is not held."""

from dataclasses import replace

import numpy as np
import pytest
from command_table import forged
from jobs import run_coverable as asked

import coverable
from coverable import Pose, Region, load_case, load_motion, load_result, place, station_plan, verify
from feasibility.cases.keys import all_keys
from feasibility.cli.main import parser_of
from feasibility.demands.every_demand import DEMANDS, further
from feasibility.verdict import Walk

CASE = """
    robot.name = "ur5"
    robot.limits_deg = { shoulder_pan_joint = [-60, 40], shoulder_lift_joint = [-100, -20], \
elbow_joint = [20, 120], wrist_1_joint = [40, 130], wrist_2_joint = [60, 140], \
wrist_3_joint = [-200, -120] }
    surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [2, 2], \
position = [0, 0, 0.3], side = "outside" }
    task = { standoff = 0.02, cone_deg = 30 }
"""
GREEDY = ("search.method=greedy", "search.step_deg=0.5", "search.moves=all", "task.tolerance=0.02")
BOX = 'name = "flood", kind = "box", size = [0.3, 0.3, 0.1], position = [0.5, 0, 0.37]'
FLOOD = f"collision.scene=[{{ {BOX} }}]"
UNTIL, SOON = "search.evaluations=500", "search.evaluations=200"
IMPOSSIBLE = {
    "standoff": ["task.standoff=2.5"],
    "tolerance": ["surface.position=[0, 0, 1.5]"],
    "cone": ["task.approach=[0, 0, 1]", SOON],
    "roll": ["task.roll_deg=[70, 75]", SOON],
    "limits": ["robot.limits_deg.elbow_joint=[-1, 1]"],
    "collisions": ["collision.self=false", "collision.surface=false", UNTIL, FLOOD],
    "start": ["robot.start_deg=[0, -90, 90, 90, 90, -160]"],
    "speed": ["task.speed=3.0"],
    "distance from singularities": ["task.min_manipulability=0.9", SOON],
    "placement error": ["task.placement_error={ position = 0.5, angle_deg = 0 }", SOON],
    "coverage": ["task.footprint=0.02", "task.coverage=0.99"],
}
"""Of each demand, what no motion of this arm holds."""
FEWER = ("--set", "surface.cells=[1, 2]", "--set", "search.evaluations=500")  # to search often
OF_THE_ARM = "says which arm it is"
MEASURE = "says what another demand is measured by"
NO_DEMANDS = {
    **dict.fromkeys(
        ("robot.name", "robot.urdf", "robot.xacro_args", "robot.package_dirs", "robot.tool_frame",
         "robot.lock", "robot.axis", "robot.base", "robot.base.*", "robot.axis.*"),
        OF_THE_ARM,
    ),
    **dict.fromkeys(
        ("robot.approach_axis", "robot.reference_axis", "robot.tcp", "robot.tcp.*",
         "task.footprint"),
        MEASURE,
    ),
    "task.smooth": "says which surface is meant: all judges take the smoothed copy",
    "task.home_deg": "says where path comes from: the entry is checked as it is made",
}  # fmt: skip
JUDGING = {"check", "verify", "divide", "explain", "path", "place"}
OTHERS = {
    **dict.fromkeys(("live", "study", "compare"), "what they say is what check says"),
    "warm-up": "compiles, and is about no case",
    "show": "shows what a file says, and judges nothing",
    **dict.fromkeys(("cases", "robots", "keys"), "are about no motion"),
}


def test_every_key_is_a_demand_with_a_judge_or_has_a_reason_to_be_none():
    judged = [key for demand in DEMANDS for key in demand.keys]
    assert len(judged) == len(set(judged))
    assert set(IMPOSSIBLE) == {demand.name for demand in DEMANDS}
    for key in all_keys():
        if key.table.partition(".")[0] in ("robot", "task", "collision"):
            names = f"{key.table}.{key.name}", f"{key.table}.*", f"{key.table.partition('.')[0]}.*"
            known = [name for name in names if name in judged or name in NO_DEMANDS]
            assert known, (
                f"{names[0]}: who judges it (feasibility/demands/every_demand.py), or why nobody?"
            )
    (commands,) = (action for action in parser_of()._actions if action.choices)
    assert set(commands.choices) == JUDGING | set(OTHERS)


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demands")
    case, motion, found, tree = (str(folder / name) for name in ("a.toml", "a.csv", "a", "tree"))
    (folder / "a.toml").write_text(CASE)
    assert asked("check", case, "--witness", motion, "--save", found).status == 0
    settings = [part for setting in GREEDY for part in ("--set", setting)]
    assert asked("check", case, *settings, "--save", tree).status == 0
    return case, motion, found, tree


def says_yes(ask, known, settings):
    """What says that the motion is there: commands, and the search for a placement."""
    case, motion, found, tree = known
    flags = [part for setting in settings for part in ("--set", setting)]

    def asked_of(path):
        """The same result file, as if it had been found for the case with these settings."""
        case = load_result(path).case.with_overrides(settings)
        return forged(path, lambda _: case.to_toml())

    commands = {
        "check": ("check", case, *flags),
        "verify a motion": ("verify", case, motion, *flags),
        "verify a result": ("verify", asked_of(found)),
        "verify a tree": ("verify", asked_of(tree)),
        "divide": ("divide", case, *flags),
        "explain": ("explain", case, *FEWER, *flags),
        "path": ("path", case, *flags),
    }
    said = {name for name, args in commands.items() if ask(*args).status == 0}
    setup = load_case(case, settings).build()
    here = Pose.of_surface(setup.cells.surface)
    region = Region.around(here, {"x": (here.position[0] - 1e-3, here.position[0] + 1e-3)})
    try:
        placed = place(*setup[:3], region, count=1, rounds=0, keep=1)
    except ValueError:  # refused
        return said
    if placed.answer == "feasible":
        said.add("place")
    plan = station_plan(placed, coverable.evaluator_here(*setup[:3], coverable.Search()), count=1)
    whole = len(plan.trials) > 0 and not len(plan.cells(-1))
    return said | {"stations"} if whole and plan.certified and not plan.not_judged else said


def test_every_command_says_yes_where_everything_holds(ask, known):
    assert len(says_yes(ask, known, [])) == len(says_yes(ask, known, [SOON])) == 9


@pytest.mark.parametrize("demand", [demand.name for demand in DEMANDS])
def test_no_command_says_yes_where_a_demand_is_not_held(ask, known, demand):
    assert says_yes(ask, known, IMPOSSIBLE[demand]) == set()


def test_every_joint_every_demand_and_every_motion_is_judged(known):
    robot, cells, task = load_case(known[0]).build()[:3]
    q = load_motion(known[1], robot).q
    begun = replace(robot, start=q[0])
    assert verify(begun, cells, task, q).holds
    with pytest.raises(ValueError, match="working must be an array"):
        verify(begun, cells, task, q, working=np.ones(3))
    for off in 1e-3 * np.eye(robot.n):
        assert not verify(replace(robot, start=q[0] + off), cells, task, q).holds
    much = replace(task, footprint=0.005, coverage=0.99, speed=0.3)
    assert "99 % is required" in verify(begun, cells, much, q).refusal, "not the speed alone"
    bent = q.copy()
    bent[:, 4] = np.linspace(0.0, 0.3, len(q))  # through a singularity, and fast
    good, bad = (Walk(rows, np.full(len(q), -1)) for rows in (q, bent))
    for demanded in ({"speed": 0.3}, {"min_manipulability": 0.05}):
        asked_for = replace(task, **demanded)
        assert not further(robot, cells, asked_for, [good, good]).faults
        assert further(robot, cells, asked_for, [good, bad]).faults


def test_what_is_not_held_is_named_as_the_cause(ask, known):
    """`explain` advised 21 changes of limits where the coverage is what is missing."""
    coverage, speed = (
        [part for setting in IMPOSSIBLE[name] for part in ("--set", setting)]
        for name in ("coverage", "speed")
    )
    said = {name: ask(name, known[0], *coverage, *FEWER).out for name in ("explain", "divide")}
    assert all("99 % is required" in " ".join(text.split()) for text in said.values())
    assert "makes it feasible" not in said["explain"]
    for name in ("explain", "divide"):
        assert "at 3 m/s" in " ".join(ask(name, known[0], *speed, *FEWER).out.split())
    setup = load_case(known[0], IMPOSSIBLE["speed"]).build()
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.0, 0.01)})
    found = place(*setup[:3], region, count=1, rounds=0, keep=1)
    assert "none was found that does so at 3 m/s" in found.message
    assert found.cause is None
