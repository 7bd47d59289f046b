"""The files that a case depends on: those that it names, and those that these name in turn."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from feasibility.cases.robot_table import RobotPart, read_robot
from feasibility.cases.toml import as_read


class CaseFiles(NamedTuple):
    """Paths of files, which need not exist."""

    named: tuple[str, ...]
    """By the case itself."""
    further: tuple[str, ...]
    """What a xacro file includes, and with collisions the meshes of the arm's URDF."""


def files_of(tables: Mapping[str, Any]) -> CaseFiles:
    """The files of a case, given by its tables; nothing of what cannot be read.

    An arm of the library has none: its files come with the program.
    """
    parts = [tables.get(title) for title in ("robot", "surface", "collision")]
    for part, key in zip((*parts[1:], parts[2]), ("pieces", "scene", "tool"), strict=True):
        if isinstance(part, Mapping) and isinstance(part.get(key), Sequence):
            parts += part[key]
    named = []
    for part in parts:
        written = part if isinstance(part, Mapping) else {}
        name = written.get("urdf", written.get("file", written.get("srdf")))
        if isinstance(name, str):
            named.append(name)
    robot, _, collision = parts[:3]
    further: tuple[str, ...] = ()
    if isinstance(robot, Mapping) and isinstance(robot.get("urdf"), str):
        arm = read_robot(as_read(robot), [])
        further += () if arm is None else files_of_arm(arm, meshes=collision is not None)
    if isinstance(collision, Mapping) and isinstance(collision.get("srdf"), str):
        further += _further(collision["srdf"])
    return CaseFiles(tuple(named), further)


def files_of_arm(arm: RobotPart, *, meshes: bool) -> tuple[str, ...]:
    """The files that the URDF of an arm names; none for an arm of the library."""
    if arm.urdf is None:
        return ()
    return _further(arm.urdf, arm.package_dirs, arm.xacro_args, meshes=meshes)


def _further(path: str, *more: Any, meshes: bool = False) -> tuple[str, ...]:
    """The files that a URDF or an SRDF names."""
    from robots.errors import RobotError
    from robots.urdf.named_files import files_named_by

    try:
        return files_named_by(path, *more, meshes=meshes)
    except RobotError:
        return ()  # the task will say so
