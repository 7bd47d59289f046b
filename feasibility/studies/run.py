"""A study: many cases decided, each kept under a key of its content."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any

from coverable.files import FileFault, open_regular, stamps
from feasibility.search_settings import Progress
from feasibility.studies.built_cases import files_of
from feasibility.studies.pool import Reply, Tables, Work, Workers
from feasibility.studies.store import Row, Store
from feasibility.studies.stored import outcome_fault
from feasibility.studies.study_outcome import evaluate
from feasibility.version import version

LARGEST = 1 << 30  # bytes; no reader takes a file beyond it


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
    key: str = field(init=False)
    """The same for the same work on the same tables, files and version of the program."""

    def __post_init__(self) -> None:
        """Work out the key: no module's name is in it, so that modules may move."""
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


def run_tasks(
    tasks: Sequence[StudyTask],
    workers: Workers,
    store: Store | None = None,
    progress: Progress | None = None,
) -> tuple[Row, ...]:
    """Do all tasks that the store does not hold yet.

    Each has its row, in the same order. Whatever ends the run, what was finished is in the store;
    run again to continue. Tasks with the same key are done once, those that failed are tried again.

    Args:
        tasks, workers, store: what is done, where (see `open_workers`), and where it is kept.
        progress: called as progress(done, total, text) several times a second; what it raises
            ends the run.

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
    total = len(found) + len(missing)

    def receive(part: Sequence[StudyTask], replies: Mapping[int, Reply]) -> None:
        rows = [_row(part[index], reply) for index, reply in replies.items()]
        if store is not None and rows:
            store.keep(rows)
        found.update((row.key, row) for row in rows)
        if progress is not None:
            progress(len(found), total, "")

    for work in dict.fromkeys(task.work for task in missing):
        part = [task for task in missing if task.work is work]
        workers.run(work, [task.tables for task in part], partial(receive, part))
    return tuple(replace(found[task.key], parameters=task.parameters) for task in tasks)


def _finished(store: Store, tasks: Sequence[StudyTask]) -> dict[str, Row]:
    """The rows of the tasks that were done before, each checked."""
    kept = store.find(task.key for task in tasks)
    found = {key: row for key, row in kept.items() if row.status == "done"}
    for key in {task.key: None for task in tasks if task.key in found and task.work is evaluate}:
        if fault := outcome_fault(found[key].result):
            raise store.damaged(key, fault)
    return found


def _row(task: StudyTask, reply: Reply) -> Row:
    """A reply as the store keeps it."""
    if reply.result is not None:
        return Row(task.parameters, "done", reply.result, reply.seconds, task.key)
    result = {"verdict": "undecided", "evidence": "budget", "message": reply.failure}
    return Row(task.parameters, "failed", result, reply.seconds, task.key)


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
