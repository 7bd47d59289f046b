"""Studies: the table is the same whoever works, and however often everyone is killed."""

from __future__ import annotations

import csv
import io
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import study_works
from small_cases import TEXTS, small_case, small_verdict

from feasibility.cases import Case, as_read
from feasibility.cli.main import main
from feasibility.notices import NOTICE
from feasibility.roadmap import warm_up_in_turn
from feasibility.studies import (
    Store,
    StudyTask,
    arm_of,
    bits_of,
    cells_of,
    cut_of,
    load_study,
    open_workers,
    run_tasks,
)
from feasibility.studies.outcome import evaluate, outcome_of
from feasibility.studies.scheduling import WorkersError
from feasibility.studies.store import StoreError

SHARED = Path(__file__).parent


def numbers(count, work=study_works.double, **more):
    """Tasks about the numbers 0, 1, 2, ..."""
    return [StudyTask({"number": k, **more}, {"number": k}, work) for k in range(count)]


def facts(rows):
    """Rows without the time that they took."""
    return [(dict(row.parameters), row.status, row.result) for row in rows]


@pytest.fixture(scope="module")
def pool():
    """Two worker processes."""
    with open_workers(2, warm=False) as workers:
        yield workers


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The table of the plates, made by this process alone."""
    rows = study_works.run_plates(tmp_path_factory.mktemp("plain") / "a.study", 0)
    verdicts = [row.result["verdict"] for row in rows]
    assert min(verdicts.count("feasible"), verdicts.count("infeasible")) >= 6
    return facts(rows)


# -- one task ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TEXTS)
def test_an_outcome_says_what_the_verdict_says(name) -> None:
    verdict, case = small_verdict(name), small_case(name)
    outcome = evaluate({title: as_read(t) for title, t in case.to_tables().items()})
    assert outcome == outcome_of(verdict)
    assert outcome["verdict"] == str(verdict.answer)
    assert outcome["covered"] == int(verdict.covered.sum())
    areas = verdict.cells.areas
    if len(areas):
        assert outcome["share"] == pytest.approx(areas[verdict.covered].sum() / areas.sum())
    assert sum(outcome["causes"].values()) == len(verdict.cells) - verdict.n_covered
    assert outcome["examined"] <= sum(outcome["causes"].values())
    if verdict.method == "complete":
        said = {str(cause.kind) for cause in verdict.causes}
        assert set(outcome["causes"]) <= said
    covers = [cells_of(bits, len(verdict.cells)) for bits in outcome["components"]]
    for cells in verdict.components:
        assert any(cover[cells].all() for cover in covers)
    for a, cover in enumerate(covers):
        assert any(set(np.flatnonzero(cover)) == set(cells) for cells in verdict.components)
        assert not any((cover <= other).all() for b, other in enumerate(covers) if a != b)
    margins = outcome["margins"]
    if verdict.witness is not None and margins is not None:
        q, robot = verdict.witness.q, verdict.robot
        least = np.degrees(np.minimum(q - robot.lower, robot.upper - q).min())
        assert margins["limit_deg"] == pytest.approx(least)
        assert 0.0 <= margins["cone_deg"] <= verdict.task.cone_deg
        assert 0.0 < margins["reach_m"] < robot.reach


def test_bits_hold_any_cells() -> None:
    rng = np.random.default_rng(1)
    for n in [0, 1, 7, 8, 9, 90, 1000]:
        cover = rng.random(n) < 0.5
        assert np.array_equal(cells_of(bits_of(cover), n), cover)
    with pytest.raises(ValueError, match="cells"):
        cells_of("ff", 9)


def test_a_mesh_cut_once_and_placed_is_the_mesh_cut_in_place(tmp_path) -> None:
    """To the last bit: so a study says what `check` says."""
    vertices = [(x, y, 0.1 * x * y) for x in (0, 0.1, 0.2) for y in (0, 0.1, 0.2)]
    faces = [(a, a + 3, a + 1) for a in (0, 1, 3, 4)] + [
        (a + 1, a + 3, a + 4) for a in (0, 1, 3, 4)
    ]
    rows = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    rows += [" ".join(map(str, vertex)) for vertex in vertices]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces]
    (tmp_path / "a.off").write_text("\n".join(rows))
    rng = np.random.default_rng(2)
    for k, cells in enumerate((5, 5, 5, '"auto"')):
        position, rpy = rng.normal(size=3).tolist(), rng.uniform(-180, 180, size=3).tolist()
        case = Case.from_toml(
            f"""
            robot.name = "ur5"
            surface = {{ kind = "mesh", file = "a.off", scale = 1.0, side = "outside",
                cells = {cells}, position = {position}, rpy_deg = {rpy} }}
            task = {{ standoff = 0.01, cone_deg = 30, footprint = [0.2, 0.15] }}
            """.replace("\n                cells", " cells"),
            tmp_path,
        )
        placed, fresh = cut_of(case), case.surface.cut(case.task.disc)
        for name in ("centres", "normals", "areas", "pairs"):
            assert np.array_equal(getattr(placed, name), getattr(fresh, name)), (k, name)
        for name in ("rotation", "position", "side"):
            ours, theirs = getattr(placed.surface, name), getattr(fresh.surface, name)
            assert np.array_equal(ours, theirs)
        for name in ("first", "cubics", "derivative_bounds", "deviations"):
            ours, theirs = getattr(placed.curves, name), getattr(fresh.curves, name)
            assert np.array_equal(ours, theirs), name


def test_cells_of_a_patch_are_as_fine_as_the_footprint_needs() -> None:
    """As `check` cuts it: with "auto", a study and `compare` said that there was no footprint."""
    case = small_case("plate").with_overrides(["surface.cells=auto", "task.footprint=0.1"])
    cells = cut_of(case)
    assert cells.shape == (4, 4)
    assert np.array_equal(cells.centres, case.build().cells.centres)


def test_an_arm_is_loaded_once() -> None:
    case = small_case("plate")
    assert arm_of(case) is arm_of(case.with_overrides(["task.cone_deg=5"]))
    narrow = case.with_overrides(["robot.limits_deg={ shoulder_pan_joint = [-10, 10] }"])
    assert arm_of(narrow) is not arm_of(case)
    assert np.degrees(arm_of(narrow).upper[0]) == pytest.approx(10)


# -- many tasks -------------------------------------------------------------------------------


def test_rows_come_in_the_order_of_the_tasks(pool, tmp_path) -> None:
    """Whatever the order in which they end: here the first one is the last to end."""
    work = study_works.double_but_the_first_is_last
    tasks, seen = numbers(40, work, mark=str(tmp_path / "mark"), last=39), []
    rows = run_tasks(tasks, pool, progress=lambda done, total, text: seen.append((done, total)))
    assert [row.result["double"] for row in rows] == list(range(0, 80, 2))
    assert seen == sorted(seen)
    assert seen[-1] == (40, 40)


def test_the_same_task_is_done_once(pool) -> None:
    tasks = [StudyTask({"n": k % 3}, {"k": k}, study_works.whoami) for k in range(30)]
    with Store(":memory:") as store:
        rows = run_tasks(tasks, pool, store)
        assert len(store) == 3
    assert [dict(row.parameters) for row in rows] == [{"k": k} for k in range(30)]
    for k, row in enumerate(rows):
        assert row.result == rows[k % 3].result
    assert os.getpid() not in {row.result["pid"] for row in rows}


def test_a_work_that_moves_to_another_module_keeps_its_tasks(monkeypatch) -> None:
    """What was kept is found again; a work of another name, or another package, is another."""
    before = StudyTask({"n": 1}, {}, evaluate).key
    assert StudyTask({"n": 1}, {}, study_works.double).key != before
    monkeypatch.setattr(evaluate, "__module__", "feasibility.somewhere.else")
    assert StudyTask({"n": 1}, {}, evaluate).key == before
    monkeypatch.setattr(evaluate, "__module__", "elsewhere")
    assert StudyTask({"n": 1}, {}, evaluate).key != before


def test_nothing_to_do(pool) -> None:
    assert run_tasks([], pool) == ()


@pytest.mark.parametrize("here", [True, False])
def test_tasks_that_fail_are_told_and_tried_again(pool, here, tmp_path) -> None:
    tasks = numbers(9, study_works.fail_odd)
    tasks.append(StudyTask({"number": 99}, {"number": 99}, study_works.not_json))
    with Store(tmp_path / "a.study") as store, open_workers(0) as mine:
        workers = mine if here else pool
        for _ in range(2):
            rows = run_tasks(tasks, workers, store)
            for k, row in enumerate(rows):
                if k % 2 == 0:
                    assert (row.status, row.result["number"]) == ("done", k)
                else:
                    assert row.status == "failed"
                    assert row.result["verdict"] == "undecided"
            assert rows[3].result["message"] == "ValueError: 3 is odd"
            assert "JSON" in rows[9].result["message"]


def test_only_what_has_changed_is_done(pool, tmp_path) -> None:
    path = tmp_path / "a.study"
    with Store(path) as store:
        before = run_tasks(
            [StudyTask({"n": k}, {}, study_works.whoami) for k in range(9)], pool, store
        )
    with Store(path) as store, open_workers(0) as workers:
        after = run_tasks(
            [StudyTask({"n": k}, {}, study_works.whoami) for k in range(3, 12)], workers, store
        )
    assert facts(after)[:6] == facts(before)[3:]
    assert {row.result["pid"] for row in after[6:]} == {os.getpid()}


# -- killing ----------------------------------------------------------------------------------


def test_tasks_that_kill_their_worker(tmp_path) -> None:
    """The deadly ones are given up, and only they; what was beside them is done."""
    tasks = numbers(40, study_works.die_first, folder=str(tmp_path), deadly=[7, 23], once=[11, 12])
    with open_workers(2, warm=False) as workers:
        rows = run_tasks(tasks, workers)
        # What is left of the pool still works.
        assert run_tasks(numbers(3), workers)[2].result["double"] == 4
    for k, row in enumerate(rows):
        if k in (7, 23):
            assert row.status == "failed"
            assert row.result["verdict"] == "undecided"
            assert "worker died, 3 times" in row.result["message"]
        else:
            assert (row.status, row.result["double"]) == ("done", 2 * k)


def test_workers_killed_from_outside(undisturbed, tmp_path) -> None:
    killed = []

    def kill(done, total, text) -> None:
        if len(killed) < 2 and done >= (8, total)[len(killed)]:
            victim = multiprocessing.active_children()[-1]
            os.kill(victim.pid, signal.SIGKILL)
            killed.append(victim.pid)

    with Store(tmp_path / "a.study") as store, open_workers(2) as workers:
        rows = run_tasks(study_works.plates(), workers, store, kill)
    assert len(killed) == 2
    assert facts(rows) == undisturbed


def start(code: str, *arguments: object) -> subprocess.Popen[str]:
    """Another process that can import what these tests share."""
    environment = {**os.environ, "PYTHONPATH": f"{SHARED}{os.pathsep}{SHARED.parent}"}
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


INTERRUPTED = """
import sys
from study_works import run_plates, stop_after_keeping
if __name__ == "__main__":
    stop_after_keeping()
    try:
        run_plates(sys.argv[1], int(sys.argv[2]))
    except KeyboardInterrupt:
        sys.exit(130)
"""


def stored(path) -> int:
    """How many rows a store holds that another process writes."""
    return study_works.kept(path) if path.exists() else 0


def wait_for(holds) -> None:
    """Until something holds."""
    while not holds():
        time.sleep(0.01)


def wait_until_kept(process) -> None:
    """Until a process that runs `stop_after_keeping` has stopped."""
    line = process.stdout.readline()
    assert line == "kept\n", process.stderr.read()


def workers_of(pid: int) -> set[int]:
    """Processes that a process has started, as far as they are Python's."""
    found = set[int]()
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.add(int(path.parent.name))
    return found


def alive(pid: int) -> bool:
    """Is there such a process, not only its remains?"""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


STUDY_COMMAND = """
import sys
from feasibility.cli.main import main
if __name__ == "__main__":
    study, out, csv, *how = sys.argv[1:]
    sys.exit(main(["study", study, "--out", out, "--csv", csv, *how]))
"""


KILLED_COMMAND = STUDY_COMMAND.replace(
    "    study, out",
    "    from study_works import stop_after_keeping; stop_after_keeping()\n    study, out",
)


@pytest.fixture(scope="module")
def in_peace(tmp_path_factory):
    """A study file, and the CSV table that the command writes of it, left in peace."""
    folder = tmp_path_factory.mktemp("peace")
    (folder / "plates.toml").write_text(study_works.STUDY, encoding="utf-8")
    assert command(folder / "plates.toml", folder / "0", "--workers", "0") == 0
    text = (folder / "0.csv").read_text(encoding="utf-8")
    lines = list(csv.DictReader(io.StringIO(text)))
    verdicts = [line["verdict"] for line in lines]
    assert len(lines) == 24
    assert min(verdicts.count("feasible"), verdicts.count("infeasible")) >= 6
    assert any(0.0 < float(line["share"]) < 1.0 for line in lines)
    return folder / "plates.toml", text


def command(study, stem, *how) -> int:
    """`coverable study`, in this process."""
    return main(["study", f"{study}", "--out", f"{stem}.study", "--csv", f"{stem}.csv", *how])


def test_the_command_killed_and_run_again(in_peace, tmp_path) -> None:
    """What was kept stays, workers end with their parent, and the table is that of one run.

    `tests/benchmarks/bench_kills.py` kills at random moments, with more cases and more workers.
    """
    study, text = in_peace
    before = set(multiprocessing.active_children())
    path, held, orphans = tmp_path / "a.study", [], set[int]()
    for count in (0, 1):
        with start(KILLED_COMMAND, study, path, tmp_path / "a.csv", "--workers", count) as process:
            wait_until_kept(process)
            orphans |= workers_of(process.pid)
            process.kill()
        held.append(stored(path))
        assert not (tmp_path / "a.csv").exists()
    assert 0 < held[0] < held[1] < 24
    with Store(path) as store:
        kept = store.find(task.key for task in load_study(study).tasks)
    assert len(kept) == held[-1]
    assert command(study, tmp_path / "a", "--workers", "1") == 0
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == text
    assert set(multiprocessing.active_children()) <= before
    assert orphans
    wait_for(lambda: not any(map(alive, orphans)))


def test_two_commands_with_one_store(in_peace, tmp_path) -> None:
    """One in another process, and one here that begins once the other has kept something."""
    study, text = in_peace
    path, there = tmp_path / "a.study", tmp_path / "b.csv"
    with start(STUDY_COMMAND, study, path, there, "--workers", "0") as process:
        wait_for(lambda: stored(path) or process.poll() is not None)
        assert command(study, tmp_path / "a", "--workers", "0") == 0
        _, err = process.communicate()
    assert process.returncode == 0, err
    for table in (tmp_path / "a.csv", there):
        assert table.read_text(encoding="utf-8") == text
    assert stored(path) == 24


def test_ctrl_c_stores_and_leaves_no_worker(tmp_path) -> None:
    """A terminal sends it to the workers too: neither they nor their parent write a traceback."""
    path = tmp_path / "a.study"
    with start(INTERRUPTED, path, 1) as process:
        wait_until_kept(process)
        children = workers_of(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate()
    assert (process.returncode, out, err) == (130, "kept\n" * out.count("kept"), "")
    assert children
    wait_for(lambda: not any(map(alive, children)))
    assert 0 < stored(path) < 24


def test_a_full_disk_ends_a_study_and_loses_nothing(undisturbed, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("feasibility.studies.run.KEEP_S", 0.0)
    path = tmp_path / "a.study"
    with Store(path) as store:
        store._base.execute("PRAGMA max_page_count = 4")  # SQLite's own full disk
        with pytest.raises(StoreError, match="disk is full"), open_workers(0) as workers:
            run_tasks(study_works.plates(), workers, store)
        held = len(store)
    assert 0 < held < 24
    rows = study_works.run_plates(path, 0)
    assert facts(rows) == undisturbed
    assert stored(path) == 24


# -- workers that cannot be had ---------------------------------------------------------------


def test_workers_that_cannot_be_had() -> None:
    with pytest.raises(WorkersError, match="not both"), open_workers(2, "tcp://127.0.0.1:1"):
        pass
    with pytest.raises(ValueError, match=r"0 \.\. 1,000"), open_workers(-1):
        pass


def test_work_that_no_worker_can_be_told(pool) -> None:
    with pytest.raises(WorkersError, match="cannot run the tasks"):
        run_tasks([StudyTask({}, {}, lambda tables: {})], pool)


def test_one_process_compiles_and_a_line_says_so(monkeypatch, capsys) -> None:
    monkeypatch.setattr("feasibility.studies.workers._begin", study_works.begin_slowly)
    before = threading.active_count()
    with open_workers(2) as workers:
        rows = run_tasks(numbers(9), workers)
    assert [row.result["double"] for row in rows] == list(range(0, 18, 2))
    assert capsys.readouterr().err == NOTICE + "\n"
    assert threading.active_count() == before


class Gate:
    """A lock that counts those who wait for it."""

    def __init__(self):
        self.lock, self.waiting = threading.Lock(), threading.Semaphore(0)

    def acquire(self, block=True):
        if block:
            self.waiting.release()
        return self.lock.acquire(block)

    def release(self):
        self.lock.release()


@pytest.mark.parametrize("fails", [False, True])
def test_the_others_wait_for_the_first_to_compile(monkeypatch, fails) -> None:
    """Threads in the place of processes: nobody else loads while the first one is at it."""
    gate, entered, may_end = Gate(), [], threading.Event()

    def compile_or_load(rarely_used: bool) -> None:
        assert rarely_used
        entered.append(threading.current_thread())
        if len(entered) == 1:
            may_end.wait()
            if fails:
                raise ValueError("no memory")

    def begin() -> None:
        with suppress(ValueError):
            warm_up_in_turn(gate, int)

    monkeypatch.setattr("feasibility.roadmap.warmup.warm_up", compile_or_load)
    threads = [threading.Thread(target=begin) for _ in range(4)]
    for thread in threads:
        thread.start()
    for _ in threads[1:]:
        gate.waiting.acquire()
    wait_for(lambda: entered)
    assert len(entered) == 1
    may_end.set()
    for thread in threads:
        thread.join()
    assert sorted(map(id, entered)) == sorted(map(id, threads))
    assert gate.acquire(False)


def test_this_process_loads_the_kernels_first(monkeypatch) -> None:
    loaded = []
    monkeypatch.setattr("feasibility.studies.workers.warm_up", lambda: loaded.append(1))
    with open_workers(0) as workers:
        assert loaded == []  # nothing is asked yet, and perhaps never
        assert [workers.submit(len, loaded).result() for _ in range(2)] == [1, 1]
    with open_workers(0, warm=False) as workers:
        assert workers.submit(len, loaded).result() == 1


def test_workers_that_die_while_starting(monkeypatch) -> None:
    """A study does not go on starting them for ever."""
    monkeypatch.setattr("feasibility.studies.workers._begin", study_works.die_at_once)
    with pytest.raises(WorkersError, match="died while starting"), open_workers(1) as workers:
        run_tasks(numbers(3), workers)
