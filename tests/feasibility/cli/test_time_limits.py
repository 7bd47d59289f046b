"""`time_limit` is kept by the whole command: whatever takes long ends, and the answer says so.

The clock is a made-up one: it jumps past the limit where a piece of work begins that never ends.
"""

from __future__ import annotations

import json
import signal
import sys
import time

import pytest
from schema import CHECK, conforms
from small_cases import TEXTS, small_case, small_verdict

import feasibility.cases.robot_table
import feasibility.cases.surface_table
import feasibility.checking
import feasibility.division
import feasibility.division.plans
import feasibility.division.surface_division
import feasibility.paths
import feasibility.placement
import feasibility.roadmap.causes
import feasibility.roadmap.complete
import feasibility.sensitivity.explanation
import feasibility.timing
import feasibility.verifying
from feasibility import clock as clocks
from feasibility import interrupts, verify
from feasibility.cli.main import main
from feasibility.clock import Clock, OutOfTime, compiling
from feasibility.interrupts import interruptible
from feasibility.placement import StudyEvaluator
from feasibility.reports.verdict import as_csv
from feasibility.results import save_result
from feasibility.roadmap import warm_up
from feasibility.studies.outcome import evaluate
from feasibility.studies.robot_comparison import assess

LIMIT = 3600.0  # [s]


class Time:
    """The time of day, which a test may put forward."""

    def __init__(self) -> None:
        self.ahead = 0.0

    def monotonic(self) -> float:
        return time.monotonic() + self.ahead

    def endless(self, *_: object, **__: object) -> None:
        """Work that never ends, long after the limit."""
        self.ahead += 2 * LIMIT
        while True:
            pass

    def over(self, seconds: float) -> None:
        """Work that never ends, so much later."""
        self.ahead += seconds
        while True:
            pass


@pytest.fixture
def clock(monkeypatch):
    made = Time()
    monkeypatch.setattr(clocks, "time", made)
    monkeypatch.setattr(interrupts, "LONGEST", 0.01)  # sees at once that it was put forward
    return made


@pytest.fixture
def ask(tmp_path, capsys):
    """Run a command on a small case within the limit: ask(case, *args) -> status, out, err."""
    small_verdict("plate")  # kernels
    capsys.readouterr()  # that they were compiled, say

    def asked(text, command, *args):
        case = tmp_path / "case.toml"
        case.write_text(TEXTS[text])
        given = [] if "--time-limit" in args else ["--set", f"search.time_limit={LIMIT}"]
        status = main([command, str(case), *given, *map(str, args)])
        return status, *capsys.readouterr()

    return asked


BUILDING = [
    (feasibility.cases.robot_table.RobotPart, "build"),
    (feasibility.cases.surface_table.SurfacePart, "cut"),
]
COMMANDS = ["check", "path", "divide", "explain", "place"]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(("owner", "name"), BUILDING)
def test_loading_and_cutting(command, owner, name, ask, clock, monkeypatch):
    """Also where only `place --time-limit` gives the limit."""
    monkeypatch.setattr(owner, name, clock.endless)
    limit = ["--time-limit", LIMIT] if command == "place" else []
    status, out, err = ask("plate", command, "--json", *limit)
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, err) == (3, "")
    assert (found["verdict"], found["evidence"]) == ("undecided", "budget")
    assert "time limit of 3600 s ran out while the arm was loaded" in found["message"]
    assert "nothing was searched" in found["message"]


def test_files_that_are_not_written_are_named(ask, clock, monkeypatch, tmp_path):
    monkeypatch.setattr(*BUILDING[1], clock.endless)
    status, out, err = ask("plate", "check", "--html", tmp_path / "a.html")
    assert status == 3
    assert out.startswith("undecided: the time limit ran out before the search began.")
    assert err == f"nothing written to --html: {tmp_path / 'a.html'}\n"
    assert not (tmp_path / "a.html").exists()


@pytest.mark.parametrize("step", ["search.arrays_of", "complete.warm_up"])
@pytest.mark.parametrize("command", ["check", "path"])
def test_preparing_the_search(command, step, ask, clock, monkeypatch):
    """Curves between 90,001 cells, say, or kernels that are loaded from a slow disk."""
    monkeypatch.setattr(f"feasibility.roadmap.{step}", clock.endless)
    status, out, _ = ask("plate", command, "--json")
    found = json.loads(out)
    assert (status, found["verdict"], found["covered"]) == (3, "undecided", 0)
    assert "nothing was searched" in found["message"]
    if command == "check":
        conforms(found, CHECK)
        assert "Why 12 cells are missed was not looked into" in found["message"]


def test_certification(ask, clock, monkeypatch):
    """A motion that no replay has judged is no witness."""
    monkeypatch.setattr(feasibility.roadmap.complete, "_replayed", clock.endless)
    status, out, _ = ask("plate", "check", "--json")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, found["verdict"], found["evidence"]) == (3, "undecided", "budget")
    assert (found["covered"], found["certificate"]) == (12, None)
    assert "before the independent replay" in found["message"]


def test_causes(ask, clock, monkeypatch):
    monkeypatch.setattr(feasibility.roadmap.complete, "causes_of", clock.endless)
    status, out, _ = ask("long plate", "check", "--json")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, found["verdict"], found["uncovered"]) == (1, "infeasible", [])
    missed = found["cells"] - found["covered"]
    assert f"Why {missed} cells are missed was not looked into" in found["message"]


@pytest.mark.parametrize(
    ("owner", "name"), [(feasibility.paths, "coverage_path"), (feasibility.timing, "trajectory")]
)
def test_paths(owner, name, ask, clock, monkeypatch, tmp_path):
    monkeypatch.setattr(owner, name, clock.endless)
    status, out, err = ask("plate", "path", "--json", "--out", tmp_path / "a.csv")
    found = json.loads(out)
    assert (status, found["verdict"], found["trajectory"]) == (3, "undecided", None)
    assert "time limit of 3600 s ran out before the path was timed" in found["message"]
    assert "--out: nothing written to" in err
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [("plans", "Patches were not planned and replayed"), ("_causes", "")],
)
def test_divisions(name, words, ask, clock, monkeypatch):
    monkeypatch.setattr(feasibility.division.surface_division, name, clock.endless)
    status, out, _ = ask("long plate", "divide", "--json")
    found = json.loads(out)
    assert (status, found["answer"]) == (3, "undecided")
    assert words in found["message"]
    assert found["left_out"] == []
    assert len(found["unsettled"]) + found["covered"] == found["cells"]


def test_a_division_that_is_not_prepared(ask, clock, monkeypatch):
    monkeypatch.setattr("feasibility.roadmap.search.arrays_of", clock.endless)
    status, out, _ = ask("plate", "divide", "--json")
    assert (status, json.loads(out)["verdict"]) == (3, "undecided")
    assert "while the search was prepared" in json.loads(out)["message"]


def test_explanations(ask, clock, monkeypatch):
    """The verdict stands; the thresholds are unknown, each by its name."""
    monkeypatch.setattr(feasibility.sensitivity.explanation, "Prober", clock.endless)
    status, out, _ = ask("plate", "explain")
    assert status == 0
    assert "The time limit ran out before any threshold was searched; unknown: cone" in out


@pytest.mark.parametrize("name", ["try_all", "check_all"])
def test_placements(name, ask, clock, monkeypatch):
    monkeypatch.setattr(StudyEvaluator, name, clock.endless)
    status, out, _ = ask("plate", "place", "--workers", 0, "--x", 0.3, 0.4, "--count", 4)
    assert (status, "the time limit ran out" in " ".join(out.split())) == (3, True)


def test_stations_and_map(ask, clock, monkeypatch, tmp_path):
    monkeypatch.setattr(feasibility.placement, "map_around_best", clock.endless)
    picture = tmp_path / "a.png"
    args = "--workers", 0, "--x", 0.3, 0.4, "--count", 4, "--map", picture
    status, _, err = ask("plate", "place", *args)
    assert (status, err) == (0, "no map: the time limit of 3600 s ran out\n")
    assert not picture.exists()


JUDGES = [*BUILDING, (feasibility.verifying, "replay_over_surface")]


@pytest.mark.parametrize(("owner", "name"), JUDGES)
def test_what_is_not_verified_in_time_does_not_hold(
    owner, name, clock, monkeypatch, tmp_path, capsys
):
    case, motion, saved = (tmp_path / name for name in ("case.toml", "walk.csv", "a.result"))
    case.write_text(TEXTS["plate"])
    motion.write_text(as_csv(small_verdict("plate")))
    save_result(small_verdict("plate"), small_case("plate"), saved)
    monkeypatch.setattr(owner, name, clock.endless)
    for what in ([case, motion], [saved]):
        asked = ["verify", *map(str, what), "--set", f"search.time_limit={LIMIT}"]
        capsys.readouterr()
        assert main([*asked, "--json"]) == 1
        found = json.loads(capsys.readouterr().out)
        assert (found["verdict"], found["in_time"]) == ("does not hold", False)
        assert "limit of 3600 s ran out" in found["refusals"][0]["text"]
        assert main(asked) == 1
        assert capsys.readouterr().out.startswith("does not hold: not verified in time.")


def test_a_proof_is_verified_within_a_limit_in_python_too():
    verdict = small_verdict("long plate")
    assert verify(verdict).holds
    found = verify(verdict, clock=Clock(1e-9))
    assert (found.holds, found.late, found.claim) == (False, True, "proof")


@pytest.mark.parametrize("work", [evaluate, assess])
def test_one_limit_for_all_that_is_done_for_a_case_of_a_study(work, clock, monkeypatch):
    """Cutting, verdict, patches and critical cone together: here the cutting takes too long."""
    small_verdict("plate")  # kernels
    module = sys.modules[work.__module__]
    cut = module.cut_of

    def slow(case):
        clock.ahead += 2 * LIMIT
        return cut(case)

    def refuse(*_, **__):
        raise AssertionError("this is begun after the end of the time")

    monkeypatch.setattr(module, "cut_of", slow)
    monkeypatch.setattr(feasibility.division, "divide", refuse)
    case = small_case("plate").with_overrides([f"search.time_limit={LIMIT}"])
    request = {"compare": {"divide": True, "critical": True}} if work is assess else {}
    found = work({**case.to_tables(), **request})
    assert (found["verdict"], found["evidence"]) == ("undecided", "budget")
    if work is assess:
        assert (found["patches"], found["critical_cone_deg"]) == (None, None)


# the clock itself


def test_compiling_does_not_count(clock):
    """Nor does what a kernel that is being compiled makes compile."""
    made = Clock(10.0).start()
    compiling.change(+1)
    clock.ahead += 50.0
    compiling.change(+1)
    clock.ahead += 50.0
    assert made.left == pytest.approx(10.0, abs=1.0)
    compiling.change(-1)
    compiling.change(-1)
    clock.ahead += 5.0
    assert made.left == pytest.approx(5.0, abs=1.0)
    assert made.part(0.5).left == pytest.approx(2.5, abs=1.0)
    clock.ahead += 6.0
    assert made.out_of_time


def test_what_was_compiled_before_does_not_count_either(clock):
    compiling.change(+1)
    clock.ahead += 50.0
    compiling.change(-1)
    assert Clock(10.0).start().left == pytest.approx(10.0, abs=1.0)


def test_numba_says_when_it_compiles(clock):
    from numba import njit

    warm_up()
    made = Clock(LIMIT).start()
    before = compiling.seconds()
    assert made.left > 0.0  # listens

    @njit
    def work(x):
        return x + clock_free

    clock_free = 1
    assert work(1) == 2
    assert compiling.seconds() > before


@pytest.mark.parametrize("limit", [2.0, 100.0])
def test_work_ends_within_a_tenth_and_a_second_of_the_limit(limit, clock):
    """Not before the limit, either: what looks at the clock itself ends first."""
    with interruptible():
        made = Clock(limit).start()
        with made.enforced():
            clock.ahead += limit + 0.05 * limit
        with pytest.raises(OutOfTime), made.enforced():
            clock.over(0.05 * limit + 0.5)


def test_a_library_that_drops_the_end_of_time_changes_nothing(clock):
    def drops():
        try:
            clock.endless()
        except Exception:  # noqa: BLE001 - as libraries do
            return

    with interruptible(), pytest.raises(OutOfTime), Clock(LIMIT).start().enforced():
        drops()


def test_elsewhere_than_in_a_command_nothing_is_enforced(clock):
    with Clock(LIMIT).start().enforced():
        clock.ahead += 2 * LIMIT
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)  # nothing would call for it
