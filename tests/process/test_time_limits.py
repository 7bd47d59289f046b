"""`time_limit` is kept by the whole command: whenever it is up, the answer says so and claims less.

The clock that is given runs out at the n-th look at it, for as many n as there are looks; a block
that the clock enforces ends at once then, as if its work never ended.
"""

import contextlib
import json
import math
import signal
import time

import numpy as np
import pytest
from jobs import TEXTS, EndingClock, case_named, ends_at, run_coverable, verdict_named
from samples import spread

import coverable
from coverable import Evidence, check, compare, divide, open_workers, run_tasks, save_result, verify
from feasibility.cases.toml import as_read
from feasibility.clock import Clock, OutOfTime, compiling
from feasibility.interrupts import enforcing, limited
from feasibility.studies.run import StudyTask

LIMIT = ("--set", "search.time_limit=3600")
PLACE = ("--workers", "0", "--x", "0.3", "0.4", "--count", "2")
QUESTIONS = {
    "check plate": ("check", "plate"),
    "path": ("path", "plate"),
    "divide": ("divide", "long plate"),
    "explain": ("explain", "long plate"),
    "place": ("place", "plate", *PLACE),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("cases")
    for name, text in TEXTS.items():
        (made / f"{name}.toml").write_text(text)
    return made


def ask(folder, name, look, *more):
    command, case, *rest = QUESTIONS[name]
    clock = ends_at(look, clocks := [])
    said = run_coverable(command, folder / f"{case}.toml", *rest, *LIMIT, *more, clock=clock)
    return said, sum(clock.looks[0] for clock in clocks)


@pytest.mark.parametrize("name", QUESTIONS)
def test_a_command_ends_with_an_answer_wherever_the_time_is_up(name, folder):
    """Undecided as long as it matters, and at last what it would have been."""
    whole, looks = ask(folder, name, math.inf, "--json")
    known = json.loads(whole.out)
    assert looks >= 5
    undecided = 0
    for look in sorted({*range(2), *spread(range(looks), 3)}):
        said, _ = ask(folder, name, look, "--json")
        found = json.loads(said.out)
        answer = found.get("verdict") or found["answer"]
        undecided += answer == "undecided"
        assert said.status == (3 if answer == "undecided" else whole.status), (look, said)
        if answer == "undecided" and name != "explain":
            assert "time limit" in said.out, look
        if look == 0:
            assert "ran out while the arm was loaded" in said.out
            assert "nothing was searched" in said.out
        if answer != "undecided" and name != "place":
            assert answer == (known.get("verdict") or known["answer"])
    assert undecided >= 2


@pytest.mark.parametrize("name", ["plate", "long plate"])
def test_a_verdict_claims_no_more_than_there_was_time_for(name):
    """A motion that nobody has judged is no witness; causes that nobody looked into are none."""
    case, clock = case_named(name).build(), EndingClock()
    whole = check(*case, clock=clock)
    whole.causes  # noqa: B018 - made within the time limit
    for look in range(clock.looks[0] + 1):
        found = check(*case, clock=EndingClock(at=look))
        causes, last = found.causes, look == clock.looks[0]
        if found.answer is coverable.Answer.UNDECIDED:
            assert found.evidence is Evidence.BUDGET
            assert (found.witness, found.certificate, found.proof) == (None, None, None)
        else:
            assert found.answer is whole.answer
            assert verify(found).holds
        assert len(causes) in (0, len(found.cells) - found.n_covered)
        assert last <= (found.answer is whole.answer)
        assert last <= (found.n_covered == whole.n_covered)


def test_a_division_in_no_time_leaves_cells_unsettled():
    case, clock = case_named("long plate").build(), EndingClock()
    whole, ended = divide(*case, clock=clock), 0
    for look in range(1, clock.looks[0] + 1):
        try:
            found = divide(*case, clock=EndingClock(at=look))
        except OutOfTime:  # before the search began
            continue
        ended += found.ended
        assert found.ended or not found.optimal
        assert all(patch.accepted for patch in found.patches)
        assert len(found.unsettled) + len(found.left_out) + found.n_covered == len(found.cells)
        assert found.ended or all(cause.proved for cause in found.left_out)
        assert found.n_covered <= whole.n_covered
    assert 1 <= ended < clock.looks[0]


def test_files_that_are_not_written_are_named(folder, tmp_path):
    asked = [("check plate", 0, "--html", "a.html"), ("path", 4, "--out", "a.csv")]
    for name, look, flag, file in [*asked, ("place", 1, "--map", "a.png")]:
        said, _ = ask(folder, name, look, flag, tmp_path / file)
        assert said.status == 3
        assert flag in said.err or "no map: the time limit of 3600 s ran out" in said.err
        assert not (tmp_path / file).exists()
    # A map takes longer than all before it: what is known is still said.
    _, looks = ask(folder, "place", math.inf)
    said, _ = ask(folder, "place", looks - 1, "--map", tmp_path / "a.png")
    assert (said.status, said.err) == (0, "no map: the time limit of 3600 s ran out\n")


def test_what_is_not_verified_in_time_does_not_hold(folder, tmp_path):
    verdict = verdict_named("plate")
    saved = tmp_path / "a.result"
    save_result(verdict, case_named("plate"), saved)
    motion = tmp_path / "walk.csv"
    np.savetxt(
        motion, verdict.witness.q, delimiter=",", comments="",
        header=",".join(verdict.robot.joint_names),
    )  # fmt: skip
    for what in ([folder / "plate.toml", motion], [saved]):
        assert run_coverable("verify", *what, *LIMIT).status == 0
        looks = run_coverable("verify", *what, *LIMIT, clock=ends_at(math.inf, made := [])) and made
        for look in range(looks[0].looks[0]):
            said = run_coverable("verify", *what, *LIMIT, "--json", clock=ends_at(look))
            found = json.loads(said.out)
            assert said.status == 1
            assert (found["verdict"], found["in_time"]) == ("does not hold", False)
            assert "limit of 3600 s ran out" in found["refusals"][0]["text"]
    late = verify(verdict_named("long plate"), clock=Clock(1e-9))
    assert (late.holds, late.late, late.claim) == (False, True, "proof")


def test_one_limit_for_all_that_is_done_for_a_case_of_a_study():
    """Cutting, verdict, patches and critical cone: nothing is begun when the time is up."""
    case = case_named("long plate").with_overrides(["search.time_limit=1e-6"])
    with open_workers(0) as workers:
        (row,) = run_tasks([StudyTask(as_read(case.to_tables()), {})], workers)
        (arm,) = compare(case, ["ur5"], workers, critical=True).arms
    assert (row.result["verdict"], row.result["evidence"]) == ("undecided", "budget")
    assert (arm.verdict, arm.patches, arm.critical_cone_deg) == ("undecided", None, None)


def test_compiling_moves_the_deadline_and_nothing_else_does():
    from numba import njit

    clock = Clock(10.0).start()
    before, compiled = clock.deadline, compiling.seconds()
    assert 9.0 < clock.left <= 10.0
    assert clock.deadline == before

    @njit
    def work(x):
        return x + 1

    assert work(1) == 2
    took = compiling.seconds() - compiled
    assert took > 0.0
    assert clock.deadline == pytest.approx(before + took, abs=1e-9)
    # What was compiled before a clock starts is not given to it.
    assert Clock(10.0).begin(5.0).deadline == pytest.approx(15.0, abs=1e-9)
    assert clock.part(0.5).limit == pytest.approx(0.5 * clock.left, rel=1e-3)
    assert not clock.out_of_time
    assert Clock(10.0).begin(time.monotonic() - 10.1).out_of_time
    assert Clock().start().left == math.inf


def within(clock, work):
    """Some work in a command, as long as there is time."""
    with enforcing(), clock.enforced():
        work()


def for_ever():
    while True:
        signal.pause()


def test_work_that_never_ends_is_ended_soon_after_its_limit():
    """Not before the limit, so that what looks at the clock itself ends first."""
    clock = Clock(0.01).start()
    with pytest.raises(OutOfTime):
        within(clock, for_ever)
    assert clock.left < -0.3


def test_the_limit_that_ends_first_counts_and_one_that_is_dropped_rings_again():
    def dropping():
        with contextlib.suppress(OutOfTime):
            for_ever()
        for_ever()

    for inner, outer, error in ((0.0, 60.0, KeyError), (60.0, 0.0, OutOfTime)):
        first, then = (lambda left=outer: left), (lambda left=inner: left)
        with pytest.raises(error), enforcing(), limited(first, OutOfTime), limited(then, KeyError):
            for_ever()
    with pytest.raises(OutOfTime):
        within(Clock(0.01).start(), dropping)
    dropped = contextlib.suppress(OutOfTime)
    with pytest.raises(OutOfTime), enforcing(), limited(lambda: 0.0, OutOfTime), dropped:
        for_ever()


def test_elsewhere_than_in_a_command_nothing_is_enforced():
    with Clock(1.0).begin(time.monotonic() - 10.0).enforced():
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)  # nothing would call for it
