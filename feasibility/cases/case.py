"""A case: one question written down as TOML, and read back with every fault named."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from coverable.errors import MISSING, ArgumentError, Fault, close, printable
from feasibility.cases.robot_table import RobotPart, faults_of_loading, in_robot_table, read_robot
from feasibility.cases.surface_reading import (
    AUTO,
    MESHES,
    SurfacePart,
    faults_of_building,
    named_file,
    read_surface,
)
from feasibility.cases.table_reader import CaseError, Section, table_words
from feasibility.cases.toml import TomlError, as_read, parse_toml
from feasibility.read_files import FileError, read_text, shown_path
from feasibility.search_settings import Search
from feasibility.task import PlacementError, Task, check_footprint

if TYPE_CHECKING:
    from feasibility.cases.collision_table import CollisionPart
    from robots.robot import Robot
    from surfaces.cells import Cells

BUILT_IN = Path(__file__).with_name("built_in.toml")
LARGEST_FILE = 256 * 1024  # bytes
TABLES = ("robot", "surface", "task", "collision", "search")
TASK = tuple(name for name in Task.__dataclass_fields__ if name != "collision")

Tables = dict[str, Any]


class Setup(NamedTuple):
    """What `feasibility.check` is called with; the task has what the arm must stay clear of."""

    robot: Robot
    cells: Cells
    task: Task
    search: Search


@dataclass(frozen=True, slots=True)
class Case:
    """A robot, a surface, a task, collisions and a search, as plain checked numbers.

    Example:
        >>> case = load_case("paper/4a").with_overrides(["task.cone_deg=10"])
        >>> case.task.cone_deg
        10.0
        >>> Case.from_toml(case.to_toml()) == case
        True
    """

    robot: RobotPart
    surface: SurfacePart
    task: Task
    """Without what the arm must stay clear of: see `built_task`."""
    search: Search = field(default_factory=Search)
    name: str = field(default="case", compare=False)
    """What it is called in reports: the built-in name, or the file's."""
    description: str = field(default="", compare=False)
    """A sentence, and the settings that have replaced what it was about."""
    collision: CollisionPart | None = None
    """None where collisions are not checked."""
    source: tuple[str, str] | None = field(default=None, compare=False, repr=False)
    """The text that it was read from, and the folder that its paths are relative to."""

    def built_task(self) -> Task:
        """The task with what the arm must stay clear of; meshes of the scene are read.

        Raises:
            CaseError: a mesh cannot be used.
        """
        if self.collision is None:
            return self.task
        try:
            return replace(self.task, collision=self.collision.build())
        except CaseError as error:
            raise CaseError(error.faults, self.name) from error

    def build(self) -> Setup:
        """Load the arm, cut the surface and read the meshes of the scene.

        Raises:
            CaseError: the robot cannot be loaded, the surface cannot be read or cut, a mesh of the
                scene cannot be read, a pair names what is not there, or the roll has no reference.
        """
        from robots.errors import RobotError

        faults, robot, cells, task = list[Fault](), None, None, None
        try:
            robot = self.robot.build(self.surface.frame)
        except RobotError as error:
            faults += in_robot_table(error)
        try:
            task = self.built_task()
        except CaseError as error:
            faults += error.faults
        if robot is not None and task is not None and task.collision is not None:
            unknown = task.collision.unknown_names(robot.link_names)
            faults += [fault.renamed({}, "collision") for fault in unknown]
        faults += [] if robot is None else self._faults_of_srdf(robot.link_names)
        try:
            if faults:  # nothing is compiled for a case that is not decided
                self.surface.build()
            else:
                cells = self.surface.cut(self.task.disc, self.task.smoothing)
        except CaseError as error:
            faults += error.faults
        if robot is None or cells is None or task is None or faults:
            raise CaseError(faults, self.name)
        try:
            if task.roll is not None:
                from feasibility.targets.references import check_references

                check_references(cells, task)
            check_footprint(cells, task)
        except ArgumentError as error:
            named = [fault.renamed({}, "task") for fault in error.faults]
            raise CaseError(named, self.name) from error
        return Setup(robot, cells, task, self.search)

    def _faults_of_srdf(self, links: Sequence[str]) -> list[Fault]:
        """What is wrong with the SRDF that the case may name, for an arm with these links."""
        if self.collision is None or self.collision.srdf is None:
            return []
        from robots.shapes.link_pairs import faults_of_srdf

        found = faults_of_srdf(self.collision.srdf, links)
        return [fault.renamed({}, "collision.srdf") for fault in found]

    def to_tables(self) -> Tables:
        """The case as the tables of its TOML; what is None is left out."""
        task = {name: as_read(getattr(self.task, name)) for name in TASK}
        error = self.task.placement_error
        task["placement_error"] = None if error is None else PlacementError(*error)._asdict()
        search = {name: getattr(self.search, name) for name in Search.__dataclass_fields__}
        tables = {
            "robot": self.robot.table(),
            "surface": self.surface.table(),
            "task": task,
            "collision": {} if self.collision is None else self.collision.table(),
            "search": search,
        }
        return {
            title: {key: value for key, value in table.items() if value is not None}
            for title, table in tables.items()
            if title != "collision" or self.collision is not None
        }

    def to_toml(self) -> str:
        """The case as text that `from_toml` reads back as an equal case; paths are absolute."""
        from feasibility.cases.toml_text import toml_document

        return toml_document(self.to_tables())

    def as_written(self) -> str:
        """The case in the words of its file, for the folder that this is in; see `to_toml`.

        What has changed since is changed there, so that comments and paths stay as they were; where
        that is not possible, it is written anew, with paths relative to that folder.
        """
        if self.source is None:
            return self.to_toml()
        from feasibility.cases.toml_edits import differences, edited, make_relative
        from feasibility.cases.toml_text import toml_document

        text, folder = self.source
        with suppress(CaseError):  # the file alone may be no case
            tables = [as_read(case.to_tables()) for case in (Case.from_toml(text, folder), self)]
            for each in tables:
                make_relative(each, folder)
            made = edited(text, differences(*tables), tables[1])
            if Case.from_toml(made, folder) == self:
                return made
        written = as_read(self.to_tables())
        make_relative(written, folder)
        return toml_document(written)

    @staticmethod
    def from_toml(
        text: str,
        base_dir: str | os.PathLike[str] | None = None,
        name: str = "case",
        overrides: Iterable[str] = (),
    ) -> Case:
        """Read a case.

        Args:
            text: TOML.
            base_dir: folder that its paths are relative to; default the working directory.
            name: what the case is called.
            overrides: settings like "task.cone_deg=10" that replace what the text says; an empty
                value removes a key. Their paths are relative to the working directory.

        Raises:
            CaseError: with everything that is wrong.
        """
        from feasibility.cases.toml_edits import make_absolute

        try:
            tables = parse_toml(text)
        except TomlError as error:
            raise CaseError(str(error), name) from error
        make_absolute(tables, base_dir)
        made = case_of_tables(tables, name, tuple(overrides))
        return replace(made, source=(text, os.path.abspath(base_dir or "")))

    def with_overrides(self, overrides: Iterable[str]) -> Case:
        """The case with some keys replaced, as `--set` does; see `from_toml`.

        Raises:
            CaseError: a setting, or the case with the settings, is wrong.
        """
        tables = {
            title: {key: as_read(value) for key, value in table.items()}
            for title, table in self.to_tables().items()
        }
        made = case_of_tables(tables, self.name, tuple(overrides), self.description)
        return replace(made, source=self.source)


def load_case(name_or_path: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Case:
    """Load a built-in case by its name, or a case file.

    Args:
        name_or_path: a name of `builtin_cases()`, or the path of a TOML file.
        overrides: see `Case.from_toml`.

    Raises:
        CaseError: with everything that is wrong.
    """
    name = os.fspath(name_or_path)
    known = _builtin_tables()
    if isinstance(name_or_path, str) and name in known:
        return _builtin_case(name).with_overrides(overrides)
    if not os.path.lexists(name) and not name.endswith(".toml"):
        guess = close(name, tuple(known))
        hint = f"did you mean {guess}? " if guess else ""
        raise CaseError(
            f"is neither a built-in case nor a file; {hint}`coverable cases` lists the built-in "
            "ones",
            shown_path(name),
        )
    text = read_document(name, "a case file (TOML)")
    return Case.from_toml(text, os.path.dirname(os.path.abspath(name)), shown_path(name), overrides)


def read_document(path: str | os.PathLike[str], what: str) -> str:
    """The text of a TOML file, or a `CaseError` that says what is wrong with it."""
    try:
        return read_text(path, LARGEST_FILE, what)
    except FileError as error:
        raise CaseError(error.faults, error.source) from error


@cache
def builtin_cases() -> Mapping[str, Case]:
    """The built-in cases by name, in the order of their file."""
    return {name: _builtin_case(name) for name in _builtin_tables()}


@cache
def _builtin_case(name: str) -> Case:
    """One of them; the others are not looked at."""
    tables, description = _builtin_tables()[name]
    return case_of_tables(tables, name, (), description)


@cache
def _builtin_tables() -> Mapping[str, tuple[Tables, str]]:
    """The tables of each, and its description."""
    found: dict[str, tuple[Tables, str]] = {}
    for name, entry in parse_toml(BUILT_IN.read_text(encoding="utf-8")).items():
        base = found[entry["like"]][0] if "like" in entry else {}
        tables = {
            title: {**base.get(title, {}), **entry.get(title, {})}
            for title in TABLES
            if title in base or title in entry
        }
        found[name] = tables, entry["description"]
    return found


def case_of_tables(
    tables: Tables, name: str = "case", overrides: Sequence[str] = (), description: str = ""
) -> Case:
    """Apply overrides, which the description then names, and check everything.

    Raises:
        CaseError: with everything that is wrong.
    """
    faults: list[Fault] = []
    if overrides:
        from feasibility.cases.toml_edits import override

        for setting in overrides:
            override(tables, setting, faults)
    for title in tables:
        if title not in TABLES:
            guess = close(title, TABLES)
            hint = f"did you mean {guess}?" if guess else f"known are {', '.join(TABLES)}"
            faults.append(Fault(printable(title), f"is not known here; {hint}"))
    for title in TABLES[:3]:
        if title not in tables:
            faults.append(Fault(title, f"is missing; expected {table_words(title)}"))
    robot = read_robot(tables["robot"], faults) if "robot" in tables else None
    surface = read_surface(tables["surface"], faults) if "surface" in tables else None
    task = _read_task(tables["task"], faults) if "task" in tables else None
    collision = _read_collision(tables["collision"], faults) if "collision" in tables else None
    if surface is not None and task is not None and surface.automatic and task.disc is None:
        wanted = "give task.footprint, in metres, from which their size follows"
        faults.append(Fault("surface.cells", f"is {AUTO!r}, without a footprint", expected=wanted))
    if surface is not None and task is not None and task.smooth and surface.kind not in MESHES:
        what = f"is for meshes and STEP faces, and the surface is of kind {surface.kind!r}"
        faults.append(Fault("task.smooth", what, expected="leave it out"))
    search = _read_search(tables.get("search", {}), faults)
    if faults and "robot" in tables:
        faults += faults_of_loading(tables["robot"])
    if faults and "surface" in tables:
        part = surface or named_file(tables["surface"])
        faults += faults_of_building(part) if part is not None else []
    if faults:
        faults += _faults_of_meshes(tables.get("collision"))
    if faults or robot is None or surface is None or task is None or search is None:
        raise CaseError(faults, name)
    changed = f"changed: {', '.join(overrides)}" if overrides else ""
    description = "; ".join(filter(None, (description, changed)))
    return Case(robot, surface, task, search, name, description, collision)


def _read_collision(table: Any, faults: list[Fault]) -> CollisionPart | None:
    """Read the [collision] table; None where it has faults."""
    from feasibility.cases.collision_table import read_collision

    return read_collision(table, faults)


def _faults_of_meshes(table: Any) -> list[Fault]:
    """What is wrong with the mesh files of a [collision] table, if there is one."""
    if table is None:
        return []
    from feasibility.cases.collision_table import faults_of_meshes

    return faults_of_meshes(table)


def _read_task(table: Any, faults: list[Fault]) -> Task | None:
    """Read the [task] table; None where it has faults."""
    section = Section("task", table, faults)
    required = {"standoff": MISSING, "cone_deg": MISSING}
    values = required | section.take(*TASK)
    section.refuse_others()
    return section.make(Task, values)


def _read_search(table: Any, faults: list[Fault]) -> Search | None:
    """Read the [search] table; None where it has faults."""
    section = Section("search", table, faults)
    values = section.take(*Search.__dataclass_fields__)
    section.refuse_others()
    return section.make(Search, values)
