"""A study of REACH (ROS-Industrial) as a case: its targets as poses, and its part as a body."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import number_in
from feasibility.cases.toml_text import toml_document
from feasibility.read_files import FileError, read_text, shown_path

CAP = 1 << 20  # bytes
PACKAGE = "package://"
SPACINGS = 2.0  # between neighbouring targets: as far apart as the motion may go at once
NOTE = """\
# Made of {file}. Which arm it is stands in no study of REACH: name it below, or give
# urdf = "arm.urdf". The tool is held within 1 degree of the normals, rolled freely; neighbours are
# {spacings:g} times as far apart as targets are (the median), whatever REACH's radius is.
"""
LONGEST_LINE = 500  # characters
_LINE = re.compile(r"\s*(?:-\s+)?(\w+)\s*:\s*(\S.*?)\s*(?:\s#.*)?")


def reach_case(path: str | os.PathLike[str]) -> str:
    """The text of a case file that asks for one motion over all targets of a study of REACH.

    Of the YAML are read `pcd_file`, `collision_mesh_filename`, `distance_threshold` and
    `touch_links`. Files of ROS packages are looked for in packages around the study, and beside it,
    where the case belongs.

    Raises:
        FileError: it cannot be read, or names no cloud of targets that is there.
        SurfaceError: the cloud cannot be read.
    """
    from surfaces.toolpaths.pose_file import read_poses

    found = _words(read_text(path, CAP, "a study of REACH (.yaml)"))
    if "pcd_file" not in found:
        raise FileError("names no pcd_file, so it is no study of REACH", shown_path(path))
    cloud = _file_of(path, found["pcd_file"], ".pcd")
    tables: dict[str, dict[str, Any]] = {
        "robot": {"name": "ur5"},
        "surface": {
            "kind": "poses", "file": os.path.relpath(cloud, Path(path).parent), "units": "m",
            "side": "outside", "neighbours": _radius(read_poses(cloud).points),
        },
        "task": {"standoff": 0.0, "cone_deg": 1.0},
    }  # fmt: skip
    mesh = found.get("collision_mesh_filename", "")
    if mesh:
        body = os.path.relpath(_file_of(path, mesh, ".ply"), Path(path).parent)
        least = number_in(found.get("distance_threshold", ""))
        touching = re.findall(r"[\w.-]+", found.get("touch_links", ""))
        tables["collision"] = {
            "clearance": least if math.isfinite(least) and least >= 0.0 else 0.0,
            "allow": [[link, "part"] for link in touching],
            "scene": [{"name": "part", "kind": "mesh", "file": body}],
        }
    shown = NOTE.format(file=shown_path(Path(path).name), spacings=SPACINGS)
    return shown + toml_document(tables)


def _words(text: str) -> dict[str, str]:
    """What follows each key of the YAML, where that is a word on its line; the first of a name."""
    found = dict[str, str]()
    for line in text.splitlines():
        match = _LINE.fullmatch(line) if len(line) <= LONGEST_LINE else None
        if match:
            found.setdefault(match[1], match[2].strip("'\""))
    return found


def _file_of(study: str | os.PathLike[str], name: str, ending: str) -> str:
    """The path of a file that a study names, perhaps as `package://NAME/...`.

    Raises:
        FileError: there is no such file, or its name ends otherwise.
    """
    from robots.urdf.mesh_folders import packages_seen, seen_words

    folder = Path(study).resolve().parent
    inner = name.removeprefix(PACKAGE).removeprefix("file://")
    places = [folder / inner, folder / Path(inner).name]
    seen = packages_seen(folder, []) if name.startswith(PACKAGE) else {}
    package, _, rest = inner.partition("/")
    if package in seen:
        places.insert(0, seen[package] / rest)
    for place in places:
        if name.endswith(ending) and "\0" not in name and place.is_file():
            return str(place)
    hint = f"; {seen_words(list(seen))}" if name.startswith(PACKAGE) else ""
    what = f"names {shown_path(name)}; expected a file in {ending} there, or beside the study"
    raise FileError(f"{what}{hint}", shown_path(study))


def _radius(points: Array) -> float:
    """m, within which targets are neighbours."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return 1.0
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    return float(f"{max(SPACINGS * float(np.median(nearest)), 1e-6):.3g}")
