"""A study: many cases decided, each kept under a key of its content."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

from coverable.files import FileFault, open_regular, stamps
from feasibility.search_settings import Progress
from feasibility.studies.built_cases import files_of
from feasibility.studies.pool import Reply, Tables, Work, Workers
from feasibility.studies.store import Record, Status, Store
from feasibility.studies.stored import outcome_fault
from feasibility.studies.study_outcome import evaluate
from feasibility.version import version

LARGEST = 1 << 30  # bytes; no reader takes a file beyond it
KEEP_S = 0.5  # [s] for which finished tasks may wait to be written together


@dataclass(frozen=True, eq=False, slots=True)
class StudyTask:
    """One task of a study.

    Example:
        >>> from coverable import load_case
        >>> tables = load_case("paper/4a").to_tables()
        >>> StudyTask(tables, {}).key == StudyTask(dict(tables), {"note": "same"}).key
        True
    """

    tables: Tables
    """The argument of the work: JSON values; for verdicts a case, as `Case.to_tables` gives it."""
    parameters: Mapping[str, Any]
    """What varies in the study, for its table: JSON values."""
    work: Work = evaluate
    """What is done with the tables, in a worker: a function of a module, returning JSON values."""
    fault: Callable[[Mapping[str, Any]], str] | None = None
    """What is wrong with a result that a store holds, in words; empty where nothing is. Verdicts
    are always checked, what other works return only where this is given."""
    key: str = field(init=False)
    """The same for the same work on the same tables, files and version of the program."""

    def __post_init__(self) -> None:
        """Work out the key: no module's name is in it, so that modules may move."""
        if self.fault is None and self.work is evaluate:
            object.__setattr__(self, "fault", outcome_fault)
        package = self.work.__module__.partition(".")[0]
        files = files_of(self.tables)
        identity = {
            "work": f"{package}.{self.work.__qualname__}",
            "version": version(),
            "tables": self.tables,
            "files": list(map(_digest, files, stamps(files))),
        }
        text = json.dumps(identity, sort_keys=True, allow_nan=False, separators=(",", ":"))
        object.__setattr__(self, "key", hashlib.sha256(text.encode()).hexdigest())


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """What came of one task."""

    parameters: Mapping[str, Any]
    status: Status
    result: Mapping[str, Any]
    """What the work returned; where it failed, an undecided verdict whose message says why."""
    seconds: float
    """Time that the work took."""


def run_tasks(
    tasks: Sequence[StudyTask],
    workers: Workers,
    store: Store | None = None,
    progress: Progress | None = None,
) -> tuple[Row, ...]:
    """Do all tasks that the store does not hold yet.

    Whatever ends the run, what was finished half a second before is in the store; run again to
    continue. Tasks with the same key are done once, those that failed are tried again.

    Args:
        tasks: in the order of the table.
        workers: where to, see `open_workers`.
        store: where finished tasks are kept.
        progress: called as progress(done, total, text) several times a second; what it raises
            ends the run.

    Returns:
        One row for each task, in the same order.

    Raises:
        StoreError: the store cannot be read or written.
        WorkersError: the workers were lost for good.

    Example:
        >>> from coverable import load_case
        >>> from coverable import open_workers
        >>> tables = load_case("paper/4a").to_tables()
        >>> with open_workers(0) as workers:
        ...     (row,) = run_tasks([StudyTask(tables, {})], workers)
        >>> row.result["verdict"], row.result["covered"]
        ('feasible', 90)
    """
    found = {} if store is None else _finished(store, tasks)
    missing = list({task.key: task for task in tasks if task.key not in found}.values())
    keeper = _Keeper(store, found, progress, total=len(found) + len(missing))
    try:
        for work in dict.fromkeys(task.work for task in missing):
            part = [task for task in missing if task.work is work]
            receive = partial(keeper.receive, part)
            workers.run(work, [task.tables for task in part], receive)
    finally:
        keeper.flush()
    rows = [(task, found[task.key]) for task in tasks]
    return tuple(Row(task.parameters, r.status, r.result, r.seconds) for task, r in rows)


def _finished(store: Store, tasks: Sequence[StudyTask]) -> dict[str, Record]:
    """The records of the tasks that were done before, each checked."""
    kept = store.find(task.key for task in tasks)
    found = {key: record for key, record in kept.items() if record.status == "done"}
    for task in {task.key: task for task in tasks if task.key in found}.values():
        fault = task.fault(found[task.key].result) if task.fault else ""
        if fault:
            raise store.damaged(task.key, fault)
    return found


@dataclass(slots=True)
class _Keeper:
    """Collects replies in `found`, and writes them to the store some times a second."""

    store: Store | None
    found: dict[str, Record]
    progress: Progress | None
    total: int
    waiting: list[Record] = field(default_factory=list)
    written: float = 0.0

    def receive(self, tasks: Sequence[StudyTask], replies: list[Reply]) -> None:
        """Take in replies to some of `tasks`."""
        for reply in replies:
            record = _record(tasks[reply.index], reply)
            self.waiting.append(record)
            self.found[record.key] = record
        now = time.monotonic()
        if self.waiting and now - self.written > KEEP_S:
            self.flush()
        if self.progress is not None:
            self.progress(len(self.found), self.total, "")

    def flush(self) -> None:
        """Write what has not been written."""
        waiting, self.waiting = self.waiting, []
        self.written = time.monotonic()
        if self.store is not None and waiting:
            self.store.keep(waiting)


def _record(task: StudyTask, reply: Reply) -> Record:
    """A reply as the store keeps it."""
    if reply.result is not None:
        return Record(task.key, task.parameters, "done", reply.result, reply.seconds)
    result = {"verdict": "undecided", "evidence": "budget", "message": reply.failure}
    return Record(task.key, task.parameters, "failed", result, reply.seconds)


@lru_cache(maxsize=4096)
def _digest(path: str, stamp: tuple[int, int] | None) -> str:
    """What a file holds, in short; read again when its time or size has changed."""
    if stamp is None:
        return ""
    try:
        with open_regular(path, LARGEST, "a file of a case") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except (OSError, FileFault):
        return ""  # the task will say so
