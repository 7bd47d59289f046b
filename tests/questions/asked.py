"""The table of questions: each is asked by its name, and answered once in a process.

`questions.toml` has them as cases; a question that is `like` another, or a built-in case, takes its
keys and replaces some. Stored problems of the oracles are questions too, by file and number:
"puma560 17".
"""

import json
import tempfile
import tomllib
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import plain
import tomli_w
from mesh_writers import stl_of

from coverable import Case, Cells, Robot, Search, Task, Verdict, check, load_case

HERE = Path(__file__).parent
TABLES = ("robot", "surface", "task", "collision", "search")
TABLE: dict[str, Any] = tomllib.loads((HERE / "questions.toml").read_text("utf-8"))
QUESTIONS: dict[str, dict[str, Any]] = {}
for tag, rows in TABLE.items():
    for name, row in rows.items():
        one = row | row.get("is", {})
        QUESTIONS[name] = one | {"tags": [tag, *one.get("tags", ())]}
PLAIN = {"robot": {"name": "ur5"}, "task": {"standoff": 0.02, "cone_deg": 40}}
"""Of a question that is like none, where it does not say another."""
FILES = tempfile.TemporaryDirectory(prefix="questions-")

STORED = {
    "puma560": 8, "ur5": 2, "puma560_apart": 1, "ur5_apart": 1, "panda_apart": 0,
    "between_curves": 1, "tolerance_needed": 2, "narrow_cones": 1, "by_a_hair": 4,
    "planted_rolls": 2,
}  # fmt: skip
"""Problems whose answers others know, and how many of each are asked in a plain run."""


class Question(NamedTuple):
    """One question; its last four are what `feasibility.check` is called with."""

    name: str
    case: Case
    robot: Robot
    cells: Cells
    task: Task
    search: Search


def names(*tags: str) -> list[str]:
    """The questions of the table that have all these tags; all without any."""
    return [name for name, one in QUESTIONS.items() if set(tags) <= set(one.get("tags", ()))]


def stored(file: str) -> list[str]:
    return [f"{file} {number}" for number in range(len(_stored(file)))]


def known(name: str) -> str | None:
    """What others know of the answer: "feasible", "infeasible", or what it is not: "not ..."."""
    file, _, number = name.rpartition(" ")
    if file not in STORED:
        return QUESTIONS[name].get("known")
    one = _stored(file)[int(number)]
    if "feasible" in one:
        return "feasible" if one["feasible"] else "infeasible"
    if file in ("between_curves", "planted_rolls"):
        return "feasible"
    if file.endswith("_apart"):
        return "not infeasible" if one["tight_feasible"] else None
    if file == "by_a_hair":
        return "not infeasible" if one["share"] < 1.0 else "not feasible"
    return "not infeasible"


def counted(name: str) -> tuple[int, int] | None:
    """How many cells one motion covers at most, and how many can be reached, where others know."""
    file, _, number = name.rpartition(" ")
    one = _stored(file)[int(number)] if file in STORED else {}
    return (one["covered"], one["reachable"]) if "reachable" in one else None


@cache
def tables_of(name: str) -> dict[str, Any]:
    file, _, number = name.rpartition(" ")
    if file in STORED:
        one = _stored(file)[int(number)]
        return one["tables"] if "tables" in one else of_problem(file.split("_")[0], one)
    if name not in QUESTIONS:
        return {k: v for k, v in load_case(name).to_tables().items() if k != "search"}
    made, own = _merged(name), QUESTIONS[name]
    return _as_file(made, own["as"]) if "as" in own else made


def _merged(name: str) -> dict[str, Any]:
    """A question's own keys, and those of what it is like."""
    own = deepcopy(QUESTIONS[name])
    made = deepcopy(tables_of(own["like"])) if "like" in own else {}
    own = own if "like" in own else PLAIN | own
    for key in own.get("drop", ()):
        made["surface"].pop(key, None)
    for title in TABLES:
        if title in own:
            made[title] = {**made.get(title, {}), **own[title]}
    made["robot"] = {k: v for k, v in (made["robot"] | own.get("limit", {})).items() if v != ""}
    return made


def built(tables: dict[str, Any]) -> Any:
    return Case.from_toml(tomli_w.dumps(tables)).build()


@cache
def case_of(name: str) -> Case:
    return Case.from_toml(tomli_w.dumps(tables_of(name)), FILES.name, name=name)


@cache
def question(name: str) -> Question:
    return Question(name, case_of(name), *case_of(name).build())


@cache
def verdict_of(name: str, seed: int | None = None) -> Verdict:
    """Its verdict, by the question's own method; asked once."""
    asked = question(name)
    search = asked.search if seed is None else Search(method=asked.search.method, seed=seed)
    return check(asked.robot, asked.cells, asked.task, search)


def form_of(name: str) -> Any:
    """The surface of a question for the referee; of points and poses the patch they are of."""
    how = QUESTIONS.get(name, {}).get("as", {})
    if how.get("kind") in ("grid", "poses", "snake"):
        patch = built(_merged(name)).cells.surface
        return None if "tilt_deg" in how else plain.surface_of(patch)
    return plain.surface_of(question(name).cells.surface)


@cache
def _stored(file: str) -> list[dict[str, Any]]:
    return json.loads((HERE / f"{file}.json").read_text("utf-8"))


def of_problem(arm: str, one: dict[str, Any]) -> dict[str, Any]:
    """The tables of an oracle's problem: angles are in degrees there."""
    arm = "puma560" if arm == "between" else arm
    angles = {"plane": (), "sphere": ("u", "v")}.get(one["kind"], ("u",))
    surface = {"kind": one["kind"], **dict(zip(("radius", "flare"), one["size"], strict=False))}
    surface |= {f"{k}_deg" if k in angles else k: one[k] for k in ("u", "v")}
    surface |= {key: one[key] for key in ("position", "rpy_deg", "side", "cells")}
    task = {key: one[key] for key in ("standoff", "cone_deg")}
    robot = {"name": arm, "limits_deg": one["limits_deg"]}
    return {"robot": robot, "surface": surface, "task": task}


# Surfaces that come as files: made of the patch that a question has.


def _as_file(tables: dict[str, Any], how: dict[str, Any]) -> dict[str, Any]:
    """The patch of a question as triangles, points or poses in a file."""
    surface, kind = tables["surface"], how["kind"]
    path = Path(FILES.name) / f"{abs(hash((tomli_w.dumps(tables), str(how))))}.{kind}"
    if kind == "dent":
        corners = _grooved(how["radius"])
        kept = {key: surface[key] for key in ("position", "side", "cells")}
        path.with_suffix(".stl").write_bytes(stl_of(corners))
        return tables | {
            "surface": kept | {"kind": "mesh", "file": f"{path.stem}.stl", "scale": 1.0}
        }
    local = plain.at_home(plain.surface_of(built(tables).cells.surface))
    made = {key: surface[key] for key in ("side", "position", "rpy_deg") if key in surface}
    made["side"] = surface.get("side", "inside")
    if kind == "mesh":
        path.with_suffix(".stl").write_bytes(stl_of(plain.facets_of(local, *how["pieces"])))
        made |= {"kind": "mesh", "file": f"{path.stem}.stl", "cells": how["cells"], "scale": 1.0}
    elif kind == "grid":
        u, v = (
            np.linspace(*ends, count)
            for ends, count in zip((local.u, local.v), how["points"], strict=True)
        )
        points = local.at(*(part.ravel() for part in np.meshgrid(u, v, indexing="ij"))).points
        np.save(path.with_suffix(".npy"), points.reshape(len(u), len(v), 3))
        made |= {"kind": "grid", "file": f"{path.stem}.npy", "units": "m"}
        made["cells"] = surface["cells"]
    else:
        nu, nv = surface["cells"]
        places, order = local.centres(nu, nv), np.arange(nu * nv).reshape(nu, nv)
        if kind == "snake":
            order[1::2] = order[1::2, ::-1].copy()
        rows = np.hstack([places.points, places.normals])[order.ravel()]
        if "tilt_deg" in how:  # tool axes of their own
            tilt = np.radians(how["tilt_deg"])
            rows = np.hstack([rows, np.tile([np.sin(tilt), 0.0, -np.cos(tilt)], (len(rows), 1))])
        head = ",".join(["x", "y", "z", "nx", "ny", "nz", "ax", "ay", "az"][: rows.shape[1]])
        np.savetxt(path.with_suffix(".csv"), rows, "%.17g", ",", header=head, comments="")
        made |= {"kind": "poses", "file": f"{path.stem}.csv", "units": "m"}
        made |= {"neighbours": how["neighbours"]} if "neighbours" in how else {}
    return tables | {"surface": made}


def _grooved(radius: float) -> np.ndarray:
    """(F, 3, 3) a groove of half a tube along y; its hollow side looks up."""
    turn, y = np.linspace(-0.5, 0.5, 61) * np.pi, np.linspace(-0.15, 0.15, 21)
    turn, y = np.meshgrid(turn, y, indexing="ij")
    points = np.stack([radius * np.sin(turn), y, -radius * np.cos(turn)], -1)
    return plain.triangles_of_grid(points)
