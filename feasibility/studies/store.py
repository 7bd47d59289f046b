"""Where the outcomes of a study are kept: one SQLite file, written as they come.

The file has a write-ahead log, and every batch of outcomes is one transaction. So whatever kills
the process, what was kept before stays, and the file is never half written.
"""

from __future__ import annotations

import json
import os
import sqlite3
import stat
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, Self

from coverable_files import reason
from feasibility.safe_files import FileError, check_writable, shown_path

APPLICATION = 0x434F5642  # "COVB", in the header of every store
SCHEMA = 1
MAGIC = b"SQLite format 3\0"
FOREIGN = "is not a study file; give another name, or remove the file"
PATIENCE = 5.0  # [s] that another process may hold the file

TABLE = """
CREATE TABLE tasks (
    key TEXT PRIMARY KEY,
    parameters TEXT NOT NULL,
    status TEXT NOT NULL CHECK (status IN ('done', 'failed')),
    result TEXT NOT NULL,
    seconds REAL NOT NULL
) WITHOUT ROWID
"""

Status = Literal["done", "failed"]


class StoreError(FileError):
    """A store that cannot be read or written: which file, why, and what would do."""


@dataclass(frozen=True, slots=True)
class Record:
    """One task that was worked on."""

    key: str
    """Says what the task is; see `feasibility.study.StudyTask`."""
    parameters: Mapping[str, Any]
    """What varies in the study, for people who read the file."""
    status: Status
    """'failed' where no worker came to an end with it; it is tried again next time."""
    result: Mapping[str, Any]
    """JSON values."""
    seconds: float
    """Time that the task took."""


class Store:
    """Records by key in one file. Use it as a context, so that it is closed.

    Example:
        >>> with Store(":memory:") as store:
        ...     store.keep([Record("k1", {"cone": 10}, "done", {"verdict": "feasible"}, 0.1)])
        ...     store.find(["k1", "k2"])["k1"].result
        {'verdict': 'feasible'}
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a store, or make a new one.

        Args:
            path: the file; ":memory:" for a store that is gone when it is closed.

        Raises:
            StoreError: the file is something else, damaged, of a later version, or cannot be
                written.
        """
        self.path = os.fspath(path)
        self._name = shown_path(path)
        in_memory = self.path == ":memory:"
        fresh = in_memory or self._look()
        try:
            self._base = sqlite3.connect(
                self.path if in_memory else os.path.abspath(self.path),
                timeout=PATIENCE,
                isolation_level=None,
            )
        except sqlite3.Error as error:
            raise self._error(error) from error
        try:
            self._prepare(fresh)
        except sqlite3.Error as error:
            self._base.close()
            raise self._error(error) from error
        except StoreError:
            self._base.close()
            raise

    def _look(self) -> bool:
        """Is there no file yet, or an empty one? Anything but a regular file is refused."""
        try:
            status = os.stat(self.path)
        except FileNotFoundError:
            try:
                check_writable(self.path)
            except FileError as error:
                raise StoreError(str(error)) from error
            return True
        except (OSError, ValueError) as error:
            raise StoreError(f"{self._name}: cannot be opened: {reason(error)}") from error
        if not stat.S_ISREG(status.st_mode):
            what = "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
            raise StoreError(f"{self._name}: is {what}; give the name of a file for the study")
        try:
            with open(self.path, "rb") as stream:
                head = stream.read(len(MAGIC))
        except OSError as error:
            raise StoreError(f"{self._name}: cannot be opened: {reason(error)}") from error
        if head not in (b"", MAGIC):  # SQLite would take a shorter file for an empty one
            raise StoreError(f"{self._name}: {FOREIGN}")
        return not head

    def _prepare(self, fresh: bool) -> None:
        """Make the table, or see that it is there and whole."""
        if not fresh:
            # Before anything is written: another program's file stays as it is.
            (application,) = self._base.execute("PRAGMA application_id").fetchone()
            (schema,) = self._base.execute("PRAGMA user_version").fetchone()
            empty = application == 0 and schema == 0 and not self._tables()
            if application != APPLICATION and not empty:
                raise StoreError(
                    f"{self._name}: is an SQLite file of another program; give another name for "
                    "the study, or remove the file"
                )
            if application == APPLICATION and schema != SCHEMA:
                raise StoreError(
                    f"{self._name}: is a study of version {schema}, this program writes version "
                    f"{SCHEMA}; give another name, or use the program that wrote it"
                )
            (state,) = self._base.execute("PRAGMA quick_check(1)").fetchone()
            if state != "ok":
                raise StoreError(
                    f"{self._name}: is damaged ({' '.join(str(state).split())}); remove it to "
                    "start anew"
                )
        self._base.execute("PRAGMA journal_mode = WAL").fetchone()
        self._base.execute("PRAGMA synchronous = NORMAL")
        # Two runs may open a new file at the same time: one of them makes the table.
        with self._transaction():
            if not self._tables():
                self._base.execute(TABLE)
                self._base.execute(f"PRAGMA application_id = {APPLICATION}")
                self._base.execute(f"PRAGMA user_version = {SCHEMA}")

    def _tables(self) -> list[str]:
        """Names of the tables in the file."""
        rows = self._base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        return [str(name) for (name,) in rows]

    def _transaction(self) -> _Transaction:
        """All or nothing of what is written inside."""
        return _Transaction(self._base)

    def keep(self, records: Iterable[Record]) -> None:
        """Write records in one transaction; one with a known key replaces the old one.

        Raises:
            StoreError: the file cannot be written, such as on a full disk; what was kept before
                stays.
        """
        rows = [
            (
                record.key,
                json.dumps(dict(record.parameters), allow_nan=False),
                record.status,
                json.dumps(dict(record.result), allow_nan=False),
                float(record.seconds),
            )
            for record in records
        ]
        try:
            with self._transaction():
                self._base.executemany("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", rows)
        except sqlite3.Error as error:
            raise self._error(error) from error

    def find(self, keys: Iterable[str]) -> dict[str, Record]:
        """The records of some keys, as far as there are any.

        Raises:
            StoreError: the file cannot be read, or holds rows that no study has written.
        """
        wanted = set(keys)
        try:
            rows = self._base.execute("SELECT key, parameters, status, result, seconds FROM tasks")
            return {row[0]: self._record(row) for row in rows if row[0] in wanted}
        except sqlite3.Error as error:
            raise self._error(error) from error

    def _record(self, row: tuple[Any, ...]) -> Record:
        """A row read back."""
        key, parameters, status, result, seconds = row
        try:
            tables = json.loads(parameters), json.loads(result)
        except (TypeError, ValueError, RecursionError) as error:
            tables = None, None
            cause: Exception | None = error
        else:
            cause = None
        if not all(isinstance(table, dict) for table in tables) or not isinstance(seconds, float):
            raise StoreError(
                f"{self._name}: the record {str(key)[:20]!r} is damaged; remove the file to start "
                "anew"
            ) from cause
        return Record(key, tables[0], status, tables[1], seconds)

    def __len__(self) -> int:
        """Number of records.

        Raises:
            StoreError: the file cannot be read.
        """
        try:
            (count,) = self._base.execute("SELECT count(*) FROM tasks").fetchone()
        except sqlite3.Error as error:
            raise self._error(error) from error
        return int(count)

    def _error(self, error: sqlite3.Error) -> StoreError:
        """What SQLite says, in words that help."""
        code = getattr(error, "sqlite_errorcode", None)
        primary = None if code is None else code & 0xFF
        if primary == sqlite3.SQLITE_FULL:
            text = "the disk is full; what was kept before stays: make room and run again"
        elif primary == sqlite3.SQLITE_NOTADB:
            text = FOREIGN
        elif primary == sqlite3.SQLITE_CORRUPT:
            text = f"is damaged ({error}); remove it to start anew"
        elif primary in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            text = "is held by another process; wait until that ends, or give another name"
        elif primary in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM, sqlite3.SQLITE_CANTOPEN):
            text = f"cannot be written: {error}; choose another place"
        elif primary == sqlite3.SQLITE_IOERR:
            text = (
                f"cannot be written: {error}; what was kept before stays: see that the disk has "
                "room, and run again"
            )
        else:
            text = f"cannot be used as a study file: {error}"
        return StoreError(f"{self._name}: {text}")

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def __enter__(self) -> Self:
        """The store itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()


class _Transaction:
    """BEGIN IMMEDIATE ... COMMIT, or ROLLBACK where something is raised."""

    def __init__(self, base: sqlite3.Connection) -> None:
        """A transaction of this connection."""
        self.base = base

    def __enter__(self) -> None:
        """Begin."""
        self.base.execute("BEGIN IMMEDIATE")

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Keep everything, or nothing."""
        if error is None:
            try:
                self.base.execute("COMMIT")
                return
            except sqlite3.Error:
                if self.base.in_transaction:
                    self.base.execute("ROLLBACK")
                raise
        if self.base.in_transaction:  # a full disk may have ended it already
            self.base.execute("ROLLBACK")
