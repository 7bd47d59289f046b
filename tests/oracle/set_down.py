"""Random patches of six kinds, set down so that a given place of them is where a tool is."""

from __future__ import annotations

from typing import Any

import numpy as np
from dense_replay import Floats, placed
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.cases import Case
from feasibility.cases.case import Setup
from surfaces import Surface

KINDS = ("plane", "sphere", "cylinder", "hyperboloid", "cone", "torus")


def random_shape(rng: np.random.Generator, kind: str, spans: Floats) -> dict[str, Any]:
    """The keys of a patch about `spans` (2,) m long; angles stay clear of poles."""
    radius = float(rng.uniform(0.3, 1.0))
    side = str(rng.choice(["inside", "outside"]))
    wide, start = float(np.degrees(spans[0] / radius)), float(rng.uniform(-150, 120))
    turn, low = [start, start + wide], float(rng.uniform(-0.3, 0.2))
    made: dict[str, Any] = {"kind": kind, "side": side}
    if kind == "plane":
        return made | {"u": [0.0, float(spans[0])], "v": [0.0, float(spans[1])]}
    if kind == "sphere":
        polar = float(rng.uniform(40, 100))
        other = start + float(np.degrees(spans[1] / radius))
        return made | {"radius": radius, "u_deg": [polar, polar + wide], "v_deg": [start, other]}
    if kind == "torus":
        tube = float(rng.uniform(0.15, 0.7)) * radius
        ring = radius + float(rng.uniform(0.0, 0.3))
        around = float(np.degrees(spans[1] / tube))
        tilt = float(rng.uniform(-100, 100)) - around / 2.0
        return made | {"ring": ring, "tube": tube, "u_deg": turn, "v_deg": [tilt, tilt + around]}
    made |= {"radius": radius, "u_deg": turn, "v": [low, low + float(spans[1])]}
    if kind == "hyperboloid":
        made["flare"] = float(rng.uniform(0.4, 1.2))
    if kind == "cone":
        made["slope"] = float(rng.uniform(-0.4, 0.8))
    return made


def rounded(values: Any, digits: int = 6) -> Any:
    """Numbers of a table, so that a case can be read."""
    if isinstance(values, dict):
        return {key: rounded(value, digits) for key, value in values.items()}
    if isinstance(values, list):
        return [rounded(value, digits) for value in values]
    return round(values, digits) if isinstance(values, float) else values


def built(tables: dict[str, Any]) -> Setup:
    """What `feasibility.check` is called with."""
    import tomli_w

    return Case.from_toml(tomli_w.dumps(tables)).build()


def _directions(surface: Surface, task: Task, place: Floats) -> tuple[Floats, Floats, Floats]:
    """Target point, approach direction and unit direction of growing u + v at a place (2,)."""
    h = 1e-5
    lengths = []
    for axis in np.eye(2) * h:
        ends = placed(surface, task, *np.array([place - axis, place + axis]).T)[0]
        lengths.append((ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0]))
    point, approach = placed(surface, task, *place[None].T)
    along = lengths[0] + lengths[1]
    return point[0], approach[0], along / np.linalg.norm(along)


def _frame(z: Floats, x: Floats) -> Floats:
    """(3, 3) with columns x (made orthogonal to z), z cross x, z."""
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def set_down(
    tables: dict[str, Any], share: Floats, point: Floats, approach: Floats, outward: Floats
) -> dict[str, Any]:
    """The tables with the surface's pose: a place of it at a target point, facing `approach`.

    Args:
        tables: of a case; its surface has no pose yet.
        share: (2,) the place, as shares of the ranges of u and v.
        point: (3,) m, where the target of that place is to be.
        approach: (3,) its approach direction.
        outward: (3,) where growing u + v is to lead, as far as it is orthogonal to `approach`.
    """
    setup = built(tables)
    surface, task = setup.cells.surface, setup.task
    ranges = np.array([surface.u_range, surface.v_range])
    place = ranges[:, 0] + share * (ranges[:, 1] - ranges[:, 0])
    here, facing, along = _directions(surface, task, place)
    turn = _frame(approach, outward) @ _frame(facing, along).T
    rpy = Rotation.from_matrix(turn).as_euler("xyz", degrees=True)
    rpy = np.round(rpy, 6)
    turn = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix()
    pose = {
        "position": np.round(point - turn @ here, 7).tolist(),
        "rpy_deg": rpy.tolist(),
    }
    return {**tables, "surface": {**tables["surface"], **pose}}
