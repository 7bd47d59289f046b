"""Robots by name, and from any URDF file: `load_robot`."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robots.arguments import Mounting, check_arguments
from robots.errors import RobotError
from robots.joint_selection import suggestion
from robots.known_arms import RobotInfo, fetched, library, named

if TYPE_CHECKING:
    from robots.robot import Robot
    from robots.urdf.axes import Axis

BRING_YOUR_OWN = (
    'Any other arm comes as a URDF: urdf = "my_arm.urdf" in a case, load_robot("my_arm.urdf") in '
    "Python. The maker's ROS description package has one, often as my_arm.urdf.xacro, which is "
    "read too: pip install 'coverable[xacro]'"
)


def load_robot(
    name_or_path: str | os.PathLike[str],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None = None,
    tool_frame: str | None = None,
    approach_axis: ArrayLike | None = None,
    lock: Mapping[str, float] | None = None,
    package_dirs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    *,
    tcp: Any = None,
    base: Any = None,
    reference_axis: ArrayLike | None = None,
    axes: Sequence[Axis] = (),
    surface_link: str | None = None,
    start: ArrayLike | None = None,
    xacro_args: Mapping[str, Any] | None = None,
) -> Robot:
    """Load an arm by its name in the library, or from a URDF or xacro file.

    Free are the joints between the URDF's root link and the tool frame; every other joint is held
    at zero, brought into its limits. A continuous joint is one real coordinate without limits
    (whatever the URDF writes there) until `limits` gives it some. An arm of the catalogue is
    fetched when it is first loaded, after a line on stderr.

    A pose is a pair (position in m, fixed-axis roll, pitch and yaw in degrees) as in a case file,
    such as ((0, 0, 0.12), (0, 0, 0)) or a `Pose`; or a (4, 4) matrix, such as a `pin.SE3`.

    Args:
        name_or_path: a name of `list_robots()`, or the path of a URDF or .xacro file.
        limits: in place of the URDF's: a named set, (n, 2) rad or m, or {joint: (lower, upper)}.
        tool_frame: the link that carries the tool; default from the library, and for a file its
            only leaf link. Where there are several, the first link called tcp, tool0, flange or
            ee_link that a joint moves, else the only leaf that one moves; a note says which.
        approach_axis: (3,) in the TCP's frame; default from the library, else +z.
        lock: joints to hold, name -> rad or m, in addition to those the library holds.
        package_dirs: one or more folders with the packages of `package://` and xacro's $(find ...).
        tcp: pose of the tool centre point in the frame of `tool_frame`; default: they are the same.
        base: pose of the URDF's root link in the world; default: they are the same.
        reference_axis: (3,) in the TCP's frame, by which roll is measured: its part across the
            approach axis. Default +x, or +z where the approach axis is +-x.
        axes: that arm or surface are mounted on and that the URDF lacks, from the world outwards;
            `base` is then the root link's pose on the last axis that carries it.
        surface_link: the link that carries the surface: the free joints are those between it and
            the tool. Default the last axis that carries the surface, else the world.
        start: (n,) rad or m, where the motion has to begin; default: anywhere.
        xacro_args: arguments of a .xacro file, name -> text, number or truth value.

    Raises:
        RobotError: the name is unknown, its arm cannot be fetched, or something has faults.

    Example:
        >>> load_robot("puma560", limits="set-1")
        Robot('puma560', 6 joints, tool 'link6')
        >>> load_robot("ur5", tcp=((0, 0, 0.12), (0, 0, 0)))
        Robot('ur5', 6 joints, tool 'tool0' + (0, 0, 0.12) m)
    """
    info = find_robot(name_or_path)
    approach_axis = _approach_axis(info, tool_frame) if approach_axis is None else approach_axis
    source = f"robot {os.fspath(name_or_path)!r}"
    given = {"tcp": tcp, "base": base, "axes": axes, "xacro_args": xacro_args}
    directions = {"approach_axis": approach_axis, "reference_axis": reference_axis}
    mounting = check_arguments(lock=lock, source=source, **given, **directions)
    robot = _read(
        replace(info, lock={**info.lock, **(lock or {})}, tool_frame=tool_frame or info.tool_frame),
        _folders(package_dirs),
        mounting._replace(surface_link=surface_link),
        xacro_args or {},
        limits=limits,
        **directions,
    )
    return robot if start is None else replace(robot, start=np.asarray(start))


def flange_axis(name: str | None, tool_frame: str | None = None) -> tuple[float, float, float]:
    """Where a tool mounted on the flange of an arm points, in its tool frame; reads no URDF.

    Args:
        name: a name that `load_robot` knows; any other is +z.
        tool_frame: a link other than the arm's own tool frame is +z, too.

    Example:
        >>> flange_axis("ur5"), flange_axis("kinova")
        ((0.0, 0.0, 1.0), (1, 0, 0))
    """
    info = named(name or "")
    return (0.0, 0.0, 1.0) if info is None else _approach_axis(info, tool_frame)


def _approach_axis(info: RobotInfo, tool_frame: str | None) -> tuple[float, float, float]:
    """The axis of the library belongs to the tool frame of the library."""
    return info.approach_axis if tool_frame in (None, info.tool_frame) else (0.0, 0.0, 1.0)


def _read(
    info: RobotInfo,
    folders: tuple[str, ...],
    mounting: Mounting,
    xacro_args: Mapping[str, Any],
    **options: Any,
) -> Robot:
    """Read the URDF of an arm.

    Args:
        info: the arm, with the tool frame and the held joints.
        folders: where meshes are looked up, besides those of `info`.
        mounting: of tool, arm and surface; the axes may carry the surface.
        xacro_args: of a .xacro file.
        options: limits and axes of the tool, as in `load_robot`.
    """
    from robots.from_urdf import robot_from_urdf
    from robots.urdf.checked_urdf import check_urdf

    link = mounting.surface_link
    if mounting.axes and not link:
        from robots.urdf.axes import carrier_of_surface

        link = carrier_of_surface(mounting.axes)
    folders = (*folders, *info.package_dirs)
    xacro_args = {**info.xacro_args, **xacro_args}
    robot = robot_from_urdf(
        check_urdf(info.urdf, folders, mounting.axes, mounting.base, xacro_args),
        name=info.name,
        tool_frame=info.tool_frame or None,
        mounting=mounting._replace(surface_link=link),
        lock=info.lock,
        limit_sets=_limit_sets(Path(info.limits)) if info.limits is not None else None,
        **options,
    )
    notes = (*robot.notes, *filter(None, [info.note]))
    return replace(robot, xacro_args=tuple(xacro_args.items()), notes=notes)


def _unknown(urdf: str | os.PathLike[str]) -> RobotInfo:
    """What is known about the URDF of an arm that is not in the library."""
    path = Path(urdf).expanduser()
    name = path.stem.removesuffix(".urdf") if path.suffix.lower() == ".xacro" else path.stem
    return RobotInfo(name, "file", "", str(path), "")


def _folders(package_dirs: str | os.PathLike[str] | Sequence[Any]) -> tuple[str, ...]:
    """One folder, or several, by their names."""
    if isinstance(package_dirs, (str, os.PathLike)):
        return (str(package_dirs),)
    return tuple(map(str, package_dirs))


def find_robot(name_or_path: str | os.PathLike[str]) -> RobotInfo:
    """What is known of an arm before its URDF is read; its files are here then.

    Raises:
        RobotError: the name is unknown, or the arm cannot be fetched.
    """
    known = named(name_or_path) if isinstance(name_or_path, str) else None
    if known is not None:
        return _fetched(known) if known.module else known
    path = os.fspath(name_or_path)
    is_path = os.sep in path or path.lower().endswith((".urdf", ".xml", ".xacro"))
    if is_path or not isinstance(name_or_path, str) or Path(path).is_file():
        return _unknown(path)
    raise RobotError(
        f"there is no robot {path!r} in the library; "
        f"{suggestion(path, [*library(), *fetched()])} (`coverable robots` lists them all). "
        f"{BRING_YOUR_OWN}"
    )


def _fetched(info: RobotInfo) -> RobotInfo:
    """An arm of the catalogue with its files, which are fetched where they are not here."""
    from robots.catalogue import description

    found = description(info.module)
    args = found.xacro_args
    return replace(info, urdf=found.path, package_dirs=found.folders, xacro_args=args)


def _limit_sets(path: Path) -> dict[str, dict[str, tuple[float, float]]]:
    """Named limits of a file: set name -> joint name -> (lower, upper), rad."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    joints = table.pop("joints")
    return {
        name: {
            joint: (math.radians(low), math.radians(high))
            for joint, (low, high) in zip(joints, entry["limits_deg"], strict=True)
        }
        for name, entry in table.items()
    }
