"""Cases as tables, checked and built: what many of them share is made once in each worker.

And the files that a case depends on: those that it names, and those that these name in turn.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from coverable.files import stamps
from feasibility.cases.case import TABLES, Case, case_of_tables
from feasibility.cases.robot_table import RobotPart, read_robot
from feasibility.cases.surface_reading import SurfacePart, read_surface
from feasibility.cases.toml import as_read
from feasibility.cases.toml_edits import change_paths
from robots.library import flange_axis
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import rotation_from_rpy

if TYPE_CHECKING:
    from surfaces.meshes.cells.mesh_cells import MeshCells


def files_of(tables: Mapping[str, Any]) -> tuple[str, ...]:
    """Paths of the files that a case, given by its tables, depends on; they need not exist.

    Those that it names, what a xacro file includes, and with collisions the meshes of the arm's
    URDF. An arm of the library has none: its files come with the program.
    """
    plain, found = as_read(tables), list[str]()

    def seen(path: str) -> str:
        found.append(path)
        return path

    change_paths(plain, seen)
    robot, collision = plain.get("robot"), plain.get("collision")
    if isinstance(robot, dict) and (arm := read_robot(robot, [])) is not None:
        found += files_of_arm(arm, meshes=collision is not None)
    if isinstance(collision, dict) and isinstance(collision.get("srdf"), str):
        found += _further(collision["srdf"])
    return tuple(found)


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


HOME = {"position": (0.0, 0.0, 0.0), "rpy_deg": (0.0, 0.0, 0.0)}
ROBOTS_KEPT = 32  # that one worker keeps
MESHES_KEPT = 4
TOOL = ("tcp", "approach_axis", "reference_axis")


def case_of(tables: Mapping[str, Any]) -> Case:
    """The case of some tables, checked; tables that belong to no case are left out.

    Raises:
        CaseError: with everything that is wrong.
    """
    return case_of_tables({title: as_read(tables[title]) for title in TABLES if title in tables})


def arm_of(case: Case) -> Robot:
    """The arm of a case, loaded once, and again where a file of it has changed.

    Raises:
        RobotError: it cannot be loaded so.
    """
    arm = case.robot
    files = () if arm.urdf is None else (arm.urdf, *files_of_arm(arm, meshes=True))
    return _load(json.dumps(arm.table()), case.surface.frame, stamps(files))


@lru_cache(maxsize=ROBOTS_KEPT)
def _load(table: str, surface_link: str | None, changed: tuple[object, ...]) -> Robot:
    """The arm of a [robot] table, as JSON; a link of it may carry the surface."""
    return cast("RobotPart", read_robot(json.loads(table), [])).build(surface_link)


def mounted_as(robot: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The [robot] table of an arm that stands where another one does, unless it says otherwise.

    The base, and the axes that carry it or the surface, belong to the cell, and so does a tool
    whose centre point is given (see `mounting_fault`); limits and locked joints belong to the arm.

    Example:
        >>> mounted_as({"name": "ur5"}, {"name": "panda", "base": {"position": [0, 0, 1]}})
        {'base': {'position': [0, 0, 1]}, 'name': 'ur5'}
    """
    tool = TOOL if given.get("tcp") is not None and "tcp" not in robot else ()
    kept = {key: given[key] for key in ("base", "axis", *tool) if given.get(key) is not None}
    return {**kept, **robot}


def mounting_fault(robot: Mapping[str, Any], given: Mapping[str, Any]) -> str | None:
    """Why the other arm's tool cannot be mounted on this one; None where it can.

    A tool centre point is given from the tool frame. Where the flanges of the two arms point along
    different axes of that frame, the same numbers would be a tool that points elsewhere.
    """
    if given.get("tcp") is None or "tcp" in robot:
        return None
    ours, theirs = (
        flange_axis(name=table.get("name"), tool_frame=table.get("tool_frame"))
        for table in (robot, given)
    )
    if ours == theirs:
        return None
    return (
        f"has a tool frame whose flange points along {list(ours)}, that of the case along "
        f"{list(theirs)}, so robot.tcp does not fit it; expected a [robot] table with a tcp of its "
        "own (in a study)"
    )


def cut_of(case: Case) -> Cells:
    """The cells of a case; a mesh or STEP faces are read and cut once, and then placed.

    Raises:
        CaseError: there is no such surface, or it cannot be cut so.
    """
    from surfaces.meshes.cells.mesh_cells import MeshCells

    if case.surface.kind not in ("mesh", "step"):
        return case.surface.cut(case.task.disc)
    stamp = stamps([case.surface.table()["file"]])
    home = _cut(surface_at_home(case), case.task.disc, case.task.smoothing, stamp)
    placed = replace(
        home.surface,
        rotation=rotation_from_rpy(*np.radians(case.surface.rpy_deg)),
        position=np.array(case.surface.position),
    )
    return MeshCells.of(placed, home.labels)


def surface_at_home(case: Case) -> str:
    """The [surface] table of a case as JSON, with the surface at the world's origin."""
    table = {key: value for key, value in case.surface.table().items() if value is not None}
    return json.dumps(table | HOME)


def part_at_home(table: str) -> SurfacePart:
    """That table, which was read before, as a part of a case."""
    return cast("SurfacePart", read_surface(json.loads(table), []))


@lru_cache(maxsize=MESHES_KEPT)
def _cut(
    table: str,
    footprint: tuple[float, float] | None,
    smoothing: tuple[float, float] | None,
    changed: tuple[object, ...],
) -> "MeshCells":
    """The cells of the mesh of a [surface] table, see `surface_at_home`."""
    return cast("MeshCells", part_at_home(table).cut(footprint, smoothing))
