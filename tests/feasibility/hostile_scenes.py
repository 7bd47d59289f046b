"""What hostile scenes are made of: objects that no library should see, and odd ones that it may."""

from __future__ import annotations

import math
import os
import random
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mesh_writers import stl_of

from coverable_errors import worded
from feasibility.cases import CaseError
from feasibility.certification.collisions import collision_replay
from feasibility.collisions import (
    Bodies,
    Collision,
    Pair,
    polytopes_of,
    soup_of,
    tool_polytopes,
    tool_solids,
)
from robots import Robot
from robots.shapes import Solid
from robots.urdf import Sphere

TAKEN = ""
"""No fault: the object is odd, and can be used."""
Entry = dict[str, Any]
Maker = Callable[[random.Random, Path], tuple[Entry, str]]
"""Gives an entry of a scene, perhaps with a file, and the words of its fault (a pattern)."""

NUMBERS = (math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1e-300, 5e-324, 1e300, 1e12, 1e-9,
           True, "0.1", [], {}, [0.1], 2**70)  # fmt: skip
VECTORS = ([], [1.0], [1.0, 2.0, 3.0, 4.0], [0.1, math.nan, 0.1], [0.1, math.inf, 0.1], "xyz", 1.0,
           [[0.1], [0.1], [0.1]], [1e300, 0.1, 0.1], {"x": 1.0}, [True, 0.1, 0.1])  # fmt: skip
NOWHERE = (*VECTORS[:8], [1e300, 0.0, 0.0])
NAMES = ("", " ", "surface", "tool", "a\nb", "a\0b", "\x1b[2J", 5, [], math.nan)


def bad_number(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """A length that is none."""
    kind, keys = rng.choice(
        [("sphere", ["radius"]), ("capsule", ["radius", "length"]),
         ("cylinder", ["radius", "length"])]
    )  # fmt: skip
    entry = {"kind": kind, **dict.fromkeys(keys, 0.1)}
    entry[rng.choice(keys)] = rng.choice(NUMBERS)
    return entry, r"finite number > 0|must lie in 1e-06 \.\. 10000"


def bad_box(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """Edges that are none, or flat."""
    flat = [0.1, 0.1, 0.1]
    flat[rng.randrange(3)] = rng.choice((0.0, -0.1, 1e-12, 1e-7, 1e5, 1e200))
    size = rng.choice((flat, rng.choice(VECTORS)))
    return {"kind": "box", "size": size}, r"three edge lengths|> 0|must lie in"


def bad_pose(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """Nowhere, or turned by what is no angle."""
    entry = {"kind": rng.choice(("halfspace", "sphere"))}
    entry |= {"radius": 0.1} if entry["kind"] == "sphere" else {}
    entry[rng.choice(("position", "rpy_deg"))] = rng.choice(NOWHERE)
    return entry, "three finite numbers"


def bad_name(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """A name that answers cannot say, or that is taken."""
    return {"kind": "halfspace", "name": rng.choice(NAMES)}, "must be"


def bad_keys(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """No kind, an unknown one, or keys of another."""
    entry = rng.choice(
        [{}, {"kind": "cone"}, {"kind": 3}, {"kind": "box", "radius": 1.0}, {"kind": "mesh"},
         {"kind": "halfspace", "carrier": "cart"}, {"kind": "sphere", "radius": 1.0, "x" * 200: 1}]
    )  # fmt: skip
    return dict(entry), "is missing|must be|is no key|not supported|not known"


def no_mesh(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """A file that is no mesh, or none that may be opened."""
    name = f"{rng.getrandbits(40):x}.{rng.choice(('stl', 'obj', 'ply', 'off', 'glb', 'zip', ''))}"
    path = folder / name
    what = rng.choice(("missing", "empty", "pipe", "folder", "noise", "html", "sparse", "cut"))
    if what == "pipe":
        os.mkfifo(path)
    elif what == "folder":
        path.mkdir()
    elif what == "sparse":
        path.touch()
        os.truncate(path, 1 << 40)
    elif what != "missing":
        content = {"empty": b"", "html": b"<html>", "cut": stl_of(np.ones((9, 3, 3)))[:-7]}
        path.write_bytes(content.get(what, rng.randbytes(rng.randrange(1, 4000))))
    return {"kind": "mesh", "file": str(path), "scale": 1.0}, "."


def bad_triangles(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """Numbers that are none, indices out of range, no area, too many faces, too wide."""
    triangles = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    name = f"{rng.getrandbits(40):x}"
    what = rng.choice(("nan", "infinite", "line", "point", "many", "wide", "index", "nothing"))
    path = folder / f"{name}.{'off' if what in ('index', 'nothing') else 'stl'}"
    if what == "index":
        path.write_text(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {rng.choice((3, -1, 10**18))}\n")
    elif what == "nothing":
        path.write_text("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n")
    elif what == "many":
        with path.open("wb") as stream:
            stream.write(bytes(80) + struct.pack("<I", 5_000_000))
            stream.truncate(84 + 50 * 5_000_000)
    else:
        triangles[0, 1, 1] = {"nan": np.nan, "infinite": np.inf}.get(what, 0.0)
        triangles *= {"line": [1, 0, 0], "point": 0.0, "wide": 1e30}.get(what, 1.0)
        path.write_bytes(stl_of(triangles))
    return {"kind": "mesh", "file": str(path), "scale": 1.0}, "."


def odd_mesh(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """Triangles that are a sheet, a thin one, or tangled: they are taken."""
    cube = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7],
                      [1, 7, 3]])  # fmt: skip
    what = rng.choice(("open", "inverted", "turned", "twice", "thin", "flat", "noise", "needle"))
    if what == "open":
        faces = faces[: rng.randrange(1, 12)]
    elif what in ("inverted", "turned"):
        some = slice(None) if what == "inverted" else slice(0, rng.randrange(1, 12))
        faces[some] = faces[some, ::-1]
    elif what == "twice":
        faces = np.concatenate([faces, faces[:3]])
    elif what == "noise":
        cube = np.array([[rng.gauss(0, 1) for _ in range(3)] for _ in range(8)])
        faces = np.array([rng.sample(range(8), 3) for _ in range(30)])
    else:
        cube = cube * {"thin": [1, 1, 1e-5], "flat": [1, 1, 0], "needle": [1, 1e-4, 1e-4]}[what]
    path = folder / f"{rng.getrandbits(40):x}.stl"
    path.write_bytes(stl_of(cube[faces]))
    return {"kind": "mesh", "file": str(path), "scale": rng.choice((1.0, 0.001, 1000.0))}, TAKEN


def odd_shape(rng: random.Random, folder: Path) -> tuple[Entry, str]:
    """A shape at the edge of what is taken."""
    small, large = 1e-6, 1e4
    entry = rng.choice(
        [{"kind": "box", "size": [small, large, 0.1]}, {"kind": "sphere", "radius": large},
         {"kind": "cylinder", "radius": large, "length": small},
         {"kind": "cylinder", "radius": small, "length": large},
         {"kind": "capsule", "radius": small, "length": small},
         {"kind": "halfspace", "position": [large, -large, large], "rpy_deg": [1e6, 0, 180]}]
    )  # fmt: skip
    return dict(entry), TAKEN


MAKERS: dict[str, Maker] = {
    make.__name__: make
    for make in (bad_number, bad_box, bad_pose, bad_name, bad_keys, no_mesh, bad_triangles,
                 odd_mesh, odd_shape)
}  # fmt: skip

CASE = {
    "robot": {"name": "ur5"},
    "surface": {"kind": "plane", "u": [0, 0.1], "v": [0, 0.1], "cells": [1, 1]},
    "task": {"standoff": 0.01, "cone_deg": 10},
}


class Scene(NamedTuple):
    """A case with a hostile scene, and what must be said of each object."""

    tables: dict[str, Any]
    words: dict[str, str]
    """By the front part of the keys."""


def hostile_scene(rng: random.Random, folder: Path, first: str) -> Scene:
    """A few objects and shapes of the tool, one of the kind `first`, in any order."""
    names = [first, *rng.choices(list(MAKERS), k=rng.randrange(4))]
    rng.shuffle(names)
    scene: list[Entry] = []
    tool: list[Entry] = []
    words = {}
    for number, name in enumerate(names):
        entry, said = MAKERS[name](rng, folder)
        in_tool = entry.get("kind") != "halfspace" and name != "bad_name" and rng.random() < 0.3
        if in_tool:
            words[f"collision.tool[{len(tool)}]"] = said
            tool.append(entry)
        else:
            words[f"collision.scene[{len(scene)}]"] = said
            scene.append({"name": f"object {number}", **entry})
    return Scene({**CASE, "collision": {"scene": scene, "tool": tool}}, words)


def what_is_said(scene: Scene) -> dict[str, str] | Collision:
    """All faults of the case, those of one object as one text; or what was asked for."""
    from feasibility.cases.case import _from_tables

    try:
        setup = _from_tables(scene.tables, "case", ()).build()
    except CaseError as error:
        said = dict.fromkeys(scene.words, "")
        for fault in error.faults:
            place = fault.key.partition("].")[0].removesuffix("]") + "]"
            said[place] = f"{said.get(place, '')}{worded(fault)}\n"
        return said
    assert setup.task.collision is not None
    return setup.task.collision


def use(collision: Collision, robot: Robot) -> None:
    """Everything that libraries make of objects that were taken: all of it is finite."""
    for obstacle in collision.scene:
        bodies, soup = polytopes_of(obstacle, 2.0), soup_of(obstacle)
        assert (bodies is None) == (soup is not None)
        if soup is not None:
            assert np.isfinite(soup.triangles).all()
            assert len(soup.triangles)
        for body in bodies or ():
            assert np.isfinite(body.vertices).all()
    for body in tool_polytopes(collision.tool, robot):
        assert 1 <= len(body.vertices) <= 64
        assert np.isfinite(body.vertices).all()
    solids = tool_solids(collision.tool, robot)
    assert len(solids) == len(collision.tool)
    judge(collision, solids, robot)


def judge(collision: Collision, solids: tuple[Solid, ...], robot: Robot) -> None:
    """The judge, and coal beneath it, look at the tool and a ball among the objects."""
    ball = Solid("ball", robot.n, np.eye(4), Sphere(0.05))
    movers = {"ball", *(solid.owner for solid in solids)}
    pairs = tuple(Pair(one, thing.name, 0.01) for one in movers for thing in collision.scene)
    bodies = Bodies((*solids, ball), (), (), collision.scene, pairs)
    q = np.zeros((2, robot.n))
    q[1] = 0.2
    found = collision_replay(robot, bodies, q)
    assert bool(pairs) == (found.min_clearance is not None)
    assert found.min_clearance is None or math.isfinite(found.min_clearance)


def try_scene(seed: int, folder: Path, first: str, robot: Robot) -> None:
    """Read the scene of a seed: every object has its sentence, and what is taken can be used."""
    rng = random.Random(f"{first} {seed}")
    inner = folder / f"{first}-{seed}"
    inner.mkdir()
    scene = hostile_scene(rng, inner, first)
    said = what_is_said(scene)
    if isinstance(said, Collision):
        assert not any(scene.words.values()), scene
        use(said, robot)
        return
    assert any(scene.words.values()), said
    for place, words in scene.words.items():
        assert bool(said[place]) == bool(words), (seed, place, said, scene.tables)
        assert re.search(words, said[place]), (seed, place, said)
