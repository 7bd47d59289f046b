"""The arms that go by name: what is known of each before its URDF is read.

`library.toml` gives for each name the URDF, the tool's link, the axis along which the tool points
and the joints on the chain that are held. example-robot-data is only read as files: its arms are
found through the metadata of the installed distribution. `catalogue.toml` gives the same of arms
whose files `robots.catalogue` fetches when they are first loaded; what it holds comes last.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from types import MappingProxyType
from typing import Any

from robots.errors import RobotError

HERE = Path(__file__).parent
DATA = "example-robot-data"


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
    known = (*library().values(), *(fetched().values() if catalogue else ()))
    return tuple(sorted(known, key=lambda info: order.index(info.group)))


def named(name: str) -> RobotInfo | None:
    """What is known of a name, in the catalogue with or without its ending; None of another."""
    here, away = library(), fetched()
    return here.get(name) or away.get(name) or away.get(name.removesuffix(SUFFIX))


@cache
def library() -> Mapping[str, RobotInfo]:
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
def fetched() -> Mapping[str, RobotInfo]:
    """The entries of catalogue.toml; nothing is fetched for it."""
    table = tomllib.loads((HERE / "catalogue.toml").read_text(encoding="utf-8"))
    entries = {}
    for name, entry in table.items():
        module = entry.pop("module", name.removesuffix(SUFFIX)) + SUFFIX
        given: dict[str, Any] = {"source": "robot_descriptions", "urdf": "", "group": "catalogue"}
        axis = tuple(entry.get("approach_axis", (0.0, 0.0, 1.0)))
        entries[name] = RobotInfo(name, **given | entry | {"approach_axis": axis}, module=module)
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
