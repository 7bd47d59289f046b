"""Robots by name: the built-in ones, the arms of example-robot-data, and any URDF file.

`library.toml` gives for each name the URDF, the tool's link, the axis along which the tool points
and the joints on the chain that are held. example-robot-data is only read as files: its arms are
found through the metadata of the installed distribution. `catalogue.toml` gives the same of arms
whose files `robots.catalogue` fetches when they are first loaded; what it holds comes last.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robots.arguments import Mounting, check_arguments
from robots.errors import RobotError
from robots.joint_selection import suggestion

if TYPE_CHECKING:
    from robots.robot import Robot
    from robots.urdf.axes import Axis

HERE = Path(__file__).parent
DATA = "example-robot-data"
BRING_YOUR_OWN = (
    'Any other arm comes as a URDF: urdf = "my_arm.urdf" in a case, load_robot("my_arm.urdf") in '
    "Python. The maker's ROS description package has one, often as my_arm.urdf.xacro, which is "
    "read too: pip install 'coverable[xacro]'"
)


@dataclass(frozen=True, slots=True)
class RobotInfo:
    """What the library knows about one arm before its URDF is read."""

    name: str
    source: str
    """'coverable' for a built-in robot, else the distribution that holds the URDF."""
    description: str
    urdf: str
    """Path of the URDF file."""
    tool_frame: str
    approach_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """In the tool frame: where a tool mounted on the flange points."""
    lock: Mapping[str, float] = field(default_factory=dict)
    """Joints on the chain to the tool that are held by default, rad or m."""
    limits: str | None = None
    """Path of a file of named limit sets."""
    package_dirs: tuple[str, ...] = ()
    group: str = "manipulator"
    """What carries it: one of `GROUPS`."""
    licence: str = ""
    """Of its files."""
    payload: float | None = None
    """kg, by its maker."""
    note: str = ""
    """What whoever uses it should know."""
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    module: str = ""
    """Of an arm that is fetched: its description in the catalogue; its `urdf` is empty then."""
    joints: int | None = None
    """Of an arm that is fetched: how many are free."""
    reach: float | None = None
    """m, of an arm that is fetched, by its maker."""


CAPSULES = "its bodies are capsules of estimated radius, not the maker's housing"
SUFFIX = "_description"  # which names in the catalogue may have
LICENCES = {"coverable": "BSD-2-Clause", DATA: "BSD-3-Clause"}
GROUPS = {
    "manipulator": "manipulators",
    "industrial": "industrial arms, with capsules of estimated radius for bodies",
    "humanoid": "arms of humanoids and of robots on wheels",
    "legged": "arms on legged robots",
    "catalogue": "arms of robot_descriptions (coverable[arms]), fetched when they are first loaded",
}
"""Kinds of robots whose arms the library has, manipulators first, and what they are called."""


def list_robots(catalogue: bool = False) -> tuple[RobotInfo, ...]:
    """Every robot that `load_robot` knows by name, manipulators first; reads no URDF.

    Args:
        catalogue: also those that are fetched when they are first loaded, last.

    Example:
        >>> [info.name for info in list_robots()][:3]
        ['puma560', 'ur3', 'ur3_limited']
        >>> [info.name for info in list_robots(catalogue=True) if info.module][:2]
        ['ur3e', 'ur5e']
    """
    order = tuple(GROUPS)
    known = (*_library().values(), *(_catalogue().values() if catalogue else ()))
    return tuple(sorted(known, key=lambda info: order.index(info.group)))


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
    info = _named(name or "")
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
    known = _named(name_or_path) if isinstance(name_or_path, str) else None
    if known is not None:
        return _fetched(known) if known.module else known
    path = os.fspath(name_or_path)
    is_path = os.sep in path or path.lower().endswith((".urdf", ".xml", ".xacro"))
    if is_path or not isinstance(name_or_path, str) or Path(path).is_file():
        return _unknown(path)
    raise RobotError(
        f"there is no robot {path!r} in the library; "
        f"{suggestion(path, [*_library(), *_catalogue()])} (`coverable robots` lists them all). "
        f"{BRING_YOUR_OWN}"
    )


def _named(name: str) -> RobotInfo | None:
    """What is known of a name, in the catalogue with or without its ending; None of another."""
    library, catalogue = _library(), _catalogue()
    return library.get(name) or catalogue.get(name) or catalogue.get(name.removesuffix(SUFFIX))


def _fetched(info: RobotInfo) -> RobotInfo:
    """An arm of the catalogue with its files, which are fetched where they are not here."""
    from robots.catalogue import description

    found = description(info.module)
    args = found.xacro_args
    return replace(info, urdf=found.path, package_dirs=found.folders, xacro_args=args)


def joint_kinds(
    name_or_path: str | os.PathLike[str],
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    xacro_args: Mapping[str, Any] = {},
) -> dict[str, str]:
    """The kind of every moving joint of a URDF, by name, whatever else the arm is loaded with.

    Args:
        name_or_path, package_dirs, xacro_args: see `load_robot`.

    Raises:
        RobotError: the name is unknown, or the URDF has faults.

    Example:
        >>> joint_kinds("puma560")["joint6"]
        'revolute'
    """
    from robots.urdf.checked_urdf import check_urdf

    info = find_robot(name_or_path)
    folders = (*package_dirs, *info.package_dirs)
    args = {**info.xacro_args, **xacro_args}
    checked = check_urdf(info.urdf, package_dirs=folders, xacro_args=args)
    return {joint.name: joint.kind for joint in checked.joints if joint.moves}


@cache
def _library() -> Mapping[str, RobotInfo]:
    """The entries of library.toml with their paths filled in."""
    share, entries = _data_folder(), {}
    table = tomllib.loads((HERE / "library.toml").read_text(encoding="utf-8"))
    for name, entry in table.items():
        built_in = entry["source"] == "coverable"
        root = HERE if built_in else share / DATA / "robots"
        entries[name] = RobotInfo(
            name=name,
            source=entry["source"],
            description=entry["description"],
            urdf=str(root / entry["urdf"]),
            tool_frame=entry["tool_frame"],
            approach_axis=tuple(entry.get("approach_axis", (0.0, 0.0, 1.0))),
            lock=MappingProxyType(entry.get("lock", {})),
            limits=str(HERE / entry["limits"]) if "limits" in entry else None,
            package_dirs=() if built_in else (str(share),),
            group=entry.get("group", "manipulator"),
            licence=LICENCES[entry["source"]],
            payload=entry.get("payload"),
            note=CAPSULES if entry.get("group") == "industrial" else "",
        )
    return MappingProxyType(entries)


@cache
def _catalogue() -> Mapping[str, RobotInfo]:
    """The entries of catalogue.toml; nothing is fetched for it."""
    table = tomllib.loads((HERE / "catalogue.toml").read_text(encoding="utf-8"))
    entries = {}
    for name, entry in table.items():
        module = entry.pop("module", name.removesuffix(SUFFIX)) + SUFFIX
        given = {"source": "robot_descriptions", "urdf": "", "group": "catalogue", **entry}
        axis = tuple(entry.get("approach_axis", (0.0, 0.0, 1.0)))
        entries[name] = RobotInfo(name, **given | {"approach_axis": axis}, module=module)
    return MappingProxyType(entries)


def _data_folder() -> Path:
    """The folder that `package://example-robot-data/...` is relative to."""
    try:
        files = distribution(DATA).files or ()
    except PackageNotFoundError as error:
        raise RobotError(f"the package {DATA} is not installed; pip install {DATA}") from error
    for file in files:
        if file.parts[-1] == "package.xml" and file.parts[-2] == DATA:
            return Path(str(file.locate())).resolve().parent.parent
    raise RobotError(f"the installed package {DATA} holds no robots; it should be 6.0 or later")


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
