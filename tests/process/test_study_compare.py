"""`compare`: what is said of each arm is what its own `check` says."""

import csv
import json
from dataclasses import replace

import pytest
from jobs import PLATE, run_coverable

from coverable import Case, CaseError, check, compare, divide, load_case, open_workers, read_study

STRIP = PLATE.replace("[0.4, 0.6]", "[0.3, 0.7]").replace("[3, 4]", "[4, 2]")
STRIP = STRIP.replace("[0, 0, 0.3]", "[0, 0, 0.2]") + "search.seed = 4\n"
ROBOTS = ("ur3", "ur5", "puma560", "xarm7")  # of these ur3 misses a part


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    (tmp_path / "strip.toml").write_text(STRIP)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_compare_says_of_each_arm_what_check_and_divide_say(folder) -> None:
    said = run_coverable(
        "compare", "strip.toml", "--robots", ", ".join(ROBOTS), "--workers", 0, "--json",
        "--csv", "a.csv", "--set", "search.method=greedy",
    )  # fmt: skip
    assert said.status == 0
    told = json.loads(said.out)
    lines = list(csv.DictReader((folder / "a.csv").read_text("utf-8").splitlines()))
    assert [arm["robot"] for arm in told["robots"]] == list(ROBOTS)
    for arm, line in zip(told["robots"], lines, strict=True):
        setup = load_case("strip.toml", [f"robot.name={arm['robot']}"]).build()
        verdict = check(*setup)
        assert (arm["verdict"], arm["message"]) == (str(verdict.answer), verdict.message)
        assert (arm["cells"], arm["covered"]) == (8, verdict.n_covered)
        assert arm["share"] == pytest.approx(verdict.n_covered / 8) == float(line["share"])
        assert (arm["joints"], arm["reach_m"]) == (setup.robot.n, pytest.approx(setup.robot.reach))
        assert (arm["margins"] is not None) == (arm["cause"] is None) == verdict.feasible
        division = divide(*setup)
        assert arm["patches"] == len(division.patches)
        assert arm["patches_share"] == pytest.approx(division.n_covered / 8)
        assert line["verdict"] == arm["verdict"]
    assert {arm["verdict"] for arm in told["robots"]} == {"feasible", "infeasible"}
    # The best comes first.
    rank = {arm["robot"]: arm for arm in told["robots"]}
    best = [rank[name] for name in told["ranking"]]
    order = [((arm["margins"] or {}).get("limit_deg", -1.0), arm["share"]) for arm in best]
    assert order == sorted(order, reverse=True)


CELL = 'robot.base.position = [0, 0, 0.1]\nrobot.axis = [{ name = "table", type = "revolute", ' + (
    'carries = "surface", limits_deg = [-9, 9] }]\n'
)
NOZZLE = "robot.tcp = { position = [0.02, 0, 0.08], rpy_deg = [0, 30, 0] }\n"


@pytest.mark.parametrize("more", [CELL, NOZZLE + "robot.approach_axis = [0, 0, 1]\n"])
def test_other_arms_stand_in_the_same_cell_with_the_same_tool(more, tmp_path) -> None:
    case = Case.from_toml(STRIP + more, name="cell")
    other = Case.from_toml(STRIP.replace("ur5", "ur10") + more).build()
    with open_workers(0) as workers:
        arm = compare(case, ["ur5", "ur10"], workers).arms[1]
        verdict = check(*other)
        assert (arm.message, arm.joints) == (verdict.message, other.robot.n)
        assert arm.covered == verdict.n_covered
        if more is not CELL:  # a tool whose numbers would point elsewhere on this flange
            with pytest.raises(CaseError, match=r"with robot = .*kinova.*tcp does not fit"):
                compare(case, ["ur5", "kinova"], workers)
            (tmp_path / "nozzle.toml").write_text(STRIP + more)
            with pytest.raises(CaseError, match=r"kinova has a tool frame.*tcp does not fit"):
                read_study('base.case = "nozzle.toml"\nvary.robots = ["kinova"]', tmp_path)


@pytest.mark.parametrize(("name", "z", "turns", "given"), [
    ("puma560", 0.2, 3, 12.0), ("ur3", 0.4, 19, 12.0), ("ur3", 9.0, None, 12.0)])  # fmt: skip
def test_the_critical_cone_is_where_the_verdict_turns(name, z, turns, given) -> None:
    """At the cone that is named there is a motion; half a degree below none is found."""
    settings = [f"robot.name={name}", "surface.u=[0.3, 0.5]", "surface.v=[-0.05, 0.05]",
                "surface.cells=[2, 1]", f"task.cone_deg={given}",
                f"surface.position=[0, 0, {z}]"]  # fmt: skip
    case = load_case("strip.toml", settings)
    robot, cells, task, search, *_ = case.build()
    with open_workers(0) as workers:
        (arm,) = compare(case, [name], workers, critical=True).arms
    cone = arm.critical_cone_deg
    if turns is None:
        assert cone is None
        return
    assert cone == pytest.approx(turns, abs=1.0)
    assert (arm.verdict == "feasible") == (cone <= given)
    assert check(robot, cells, replace(task, cone_deg=cone), search).feasible
    if cone > 3.0:
        assert not check(robot, cells, replace(task, cone_deg=cone - 0.5), search).feasible
