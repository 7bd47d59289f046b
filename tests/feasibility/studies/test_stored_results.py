"""What a store holds is judged before any of it is shown: one message, exit status 2."""

from __future__ import annotations

import json
import os
import random
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import hostile_stores as hostile
import pytest

from feasibility.cases import load_case
from feasibility.cli.main import main
from feasibility.placement.evaluator import Stage
from feasibility.placement.region import Pose
from feasibility.placement.study_tasks import StudyEvaluator
from feasibility.studies import Store, StudyTask, compare, open_workers, run_tasks
from feasibility.studies.store import StoreError
from feasibility.studies.stored import STAGES


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two cases, with its store."""
    return hostile.study_with_store(tmp_path_factory.mktemp("study"))


@pytest.mark.parametrize("seed", range(40))
def test_a_store_that_was_tampered_with_is_one_message_and_shows_nothing(
    seed: int, good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = hostile.tampered(good / "out.study", random.Random(seed), tmp_path)
    page, table = tmp_path / "page.html", tmp_path / "table.csv"
    asked = ["study", str(good / "study.toml"), "--out", str(store), "--workers", "0"]
    status = main([*asked, "--html", str(page), "--csv", str(table)])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert not page.exists()
    assert not table.exists()
    assert "out.study" in err
    assert err.count("\n") <= 2, "what it holds, and one message"
    assert all(line.isprintable() for line in err.splitlines())
    assert "Traceback" not in err


def test_every_value_of_a_result_is_judged(good: Path) -> None:
    """Each key of a stored verdict, replaced by each odd value that it may not have."""
    task = StudyTask(load_case("paper/4a").to_tables(), {})
    result = json.loads(hostile.rows(good / "out.study")[0][3])
    assert task.fault is not None
    assert task.fault(result) == ""
    for key in result:
        for odd in (*hostile.ODD, [hostile.SCRIPT], {"a": 1}, "\x1b[2J", "x\u202ey"):
            fault = task.fault({**result, key: odd})
            assert bool(fault) != hostile.allowed(key, odd), (key, odd)
            assert key in (fault or key)
        assert key in task.fault({k: v for k, v in result.items() if k != key})
    assert "more is not known" in task.fault({**result, "more": 1})


def test_what_a_store_may_say_is_no_program_on_the_page(good: Path, tmp_path: Path) -> None:
    path, page = tmp_path / "out.study", tmp_path / "page.html"
    path.write_bytes((good / "out.study").read_bytes())
    for key, parameters, status, text, seconds in hostile.rows(path):
        changed = json.dumps({**json.loads(text), "message": hostile.SCRIPT})
        hostile.put(path, (key, parameters, status, changed, seconds))
    asked = ["study", str(good / "study.toml"), "--out", str(path), "--workers", "0"]
    assert main([*asked, "--html", str(page)]) == 0
    assert hostile.SCRIPT not in page.read_text()


def test_what_works_keep_is_what_is_read_again(tmp_path: Path) -> None:
    """Outcomes, arms and trials pass their own judgement: a second run reads all from the store."""
    case = load_case("paper/4a").with_overrides(["surface.cells=[2, 3]"])
    poses = [Pose.of_values([x, 0.0, 0.0, 0.0, 0.0, 0.0]) for x in (0.0, 0.2, 3.0)]
    with open_workers(0) as workers, Store(tmp_path / "all.study") as store:
        for _ in range(2):
            compare(case, ["puma560", "ur5"], workers, store=store)
            evaluator = StudyEvaluator(case, workers, store)
            evaluator.try_all(poses, early=True)
            evaluator.check_all(poses, causes=True)
            run_tasks([StudyTask(case.to_tables(), {})], workers, store)
            assert len(store) == 2 + 3 + 3 + 1
    assert set(STAGES) == {str(stage) for stage in Stage}


@pytest.mark.parametrize("work", ["arms", "trials"])
def test_arms_and_trials_are_judged_too(work: str, tmp_path: Path) -> None:
    case = load_case("paper/4a").with_overrides(["surface.cells=[2, 3]"])
    path = tmp_path / "out.study"

    def run(store: Store) -> None:
        with open_workers(0) as workers:
            if work == "arms":
                compare(case, ["puma560"], workers, store=store)
            else:
                pose = Pose.of_values([0.0] * 6)
                StudyEvaluator(case, workers, store).check_all([pose], causes=False)

    with Store(path) as store:
        run(store)
    ((key, parameters, status, result, seconds),) = hostile.rows(path)
    for name, odd in (("verdict", 5), ("share", 1e300), ("message", None), ("cells", -1)):
        changed = json.dumps({**json.loads(result), name: odd})
        hostile.put(path, (key, parameters, status, changed, seconds))
        with Store(path) as store, pytest.raises(StoreError, match=f"is damaged: {name} must be"):
            run(store)


@pytest.mark.parametrize("end", ["-wal", "-shm", "-journal"])
def test_a_pipe_beside_a_store_is_not_waited_for(end: str, good: Path, tmp_path: Path) -> None:
    path = tmp_path / "out.study"
    path.write_bytes((good / "out.study").read_bytes())
    os.mkfifo(f"{path}{end}")
    with pytest.raises(StoreError, match=f"out.study{end} is not a regular file"):
        Store(path)


def test_a_store_that_holds_a_program_is_refused(good: Path, tmp_path: Path) -> None:
    """A view that never ends, and a trigger."""
    programs = (
        "CREATE VIEW more AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k FROM n) "
        "SELECT k FROM n",
        "CREATE TRIGGER always AFTER INSERT ON tasks BEGIN DELETE FROM tasks; END",
        "ALTER TABLE tasks ADD COLUMN more AS (zeroblob(900000000))",
    )
    for number, program in enumerate(programs):
        path = tmp_path / f"{number}.study"
        path.write_bytes((good / "out.study").read_bytes())
        with closing(sqlite3.connect(path)) as base:
            base.execute(program)
            base.commit()
        with pytest.raises(StoreError, match="more than one table of results"):
            Store(path)


def test_the_shape_says_what_is_expected(good: Path) -> None:
    task = StudyTask(load_case("paper/4a").to_tables(), {})
    result: dict[str, Any] = json.loads(hostile.rows(good / "out.study")[0][3])
    assert task.fault is not None
    assert task.fault({**result, "verdict": "maybe"}) == (
        "verdict must be feasible, infeasible or undecided, got 'maybe'"
    )
    assert task.fault({**result, "share": 1.5}) == "share must be a number in 0 .. 1, got 1.5"
    assert task.fault({**result, "covered": 10**6}) == "covered is more than cells"
    assert "components: " in task.fault({**result, "components": ["zz"]})
