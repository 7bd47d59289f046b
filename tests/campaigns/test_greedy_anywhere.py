"""The paper's search beside the complete one, over random surfaces of every kind before a UR5.

What the greedy search calls feasible its replay has accepted. To touch a cell is not to reach its
centre, but where it does reach one, no proof may say that nothing does; and a tree over all cells
that its replay refuses would be a margin that is too small.
"""

from __future__ import annotations

from typing import Any

import mesh_patches
import numpy as np
import pytest
from numpy.typing import NDArray

from feasibility import Answer, Evidence, Search, Task, check, greedy_check
from feasibility.paper.exact_rolls import rolls_at
from feasibility.paper.literal import LiteralSearch
from robots import Kinematics, load_robot
from surfaces import (
    Cells,
    bspline,
    cone,
    ellipsoid,
    mesh,
    piecewise,
    plane,
    revolution,
    sphere,
    torus,
)
from surfaces.meshes import TriangleMesh

ARM = load_robot("ur5")
ROLL = 120.0  # [deg], the whole range where there is one
KINDS = ("torus", "cone", "ellipsoid", "revolution", "bspline", "piecewise", "mesh", "creased mesh")


def cells_of(kind: str, rng: np.random.Generator) -> Cells:
    """Cells of a random surface of a kind, somewhere in front of the arm."""
    position = rng.uniform((0.35, -0.3, -0.2), (0.55, 0.3, 0.2)).tolist()
    pose = {"side": "outside", "position": position}
    axes, height = rng.uniform(0.15, 0.4, 3).tolist(), 0.08 * rng.normal(size=(3, 3))
    if kind == "torus":
        return torus(0.25, rng.uniform(0.08, 0.15), (-50, 50), (50, 130), **pose).cells(4, 5)
    if kind == "cone":
        return cone(0.3, rng.uniform(-0.5, 0.5), (140, 220), (0.0, 0.3), **pose).cells(4, 5)
    if kind == "ellipsoid":
        return ellipsoid(axes, (0, 60), (0, 360), **pose).cells(4, 5)
    if kind == "revolution":
        profile = [(0.0, 0.2), (0.1, rng.uniform(0.15, 0.19)), (0.2, 0.1), (0.25, 0.0)]
        return revolution(profile, (0, 360), **pose).cells(4, 5)
    if kind == "bspline":
        places = np.stack(np.meshgrid([0.0, 0.2, 0.4], [-0.2, 0.0, 0.2], indexing="ij"), axis=-1)
        net = np.concatenate([places, height[..., None]], axis=-1).tolist()
        return bspline(net, degree=(2, 2), **pose).cells(4, 5)
    if kind == "piecewise":
        bands = [sphere(0.4, polar, (-60, 60)) for polar in ((10, 30), (30, 50))]
        halves = [
            plane((-0.2, 0.0), (-0.2, 0.2)),
            plane((0.0, 0.2), (-0.2, 0.2), rpy_deg=(0, rng.uniform(-15, 15), 0)),
        ]
        return piecewise(bands if rng.random() < 0.5 else halves, **pose).cells((2, 3))
    u, v, faces = mesh_patches.grid(15, 15)
    u, v = 0.3 * u, 0.3 * v - 0.15
    z = 0.04 * rng.normal() * np.sin(9 * u) * np.cos(8 * v)
    if kind == "creased mesh":
        z = np.tan(np.radians(rng.uniform(-30, 30))) * np.minimum(u, 0.3 - u)
    return mesh(TriangleMesh(np.stack([u, v, z], axis=1), faces), **pose).cells(count=16)


def motions_of(tree: Any) -> NDArray[np.float64]:
    """(k, n) every configuration on the edges of a tree."""
    return np.concatenate([motion for _, _, motion in tree.edges(data="motion")])


def reached(task: Task, cells: Cells, q: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) whether some of these configurations cover the centre of each cell."""
    kinematics, targets = Kinematics(ARM), task.targets(cells)
    points, axes = kinematics.tools(q)[:2]
    off = np.linalg.norm(points[:, None] - targets.points, axis=2)
    tilt = np.arccos(np.clip(axes @ targets.approaches.T, -1.0, 1.0))
    covers = (off <= (task.tolerance or 1e-3)) & (tilt <= task.cone)
    if task.roll is not None:
        roll = rolls_at(kinematics, cells, task, q)
        covers &= np.abs(task.roll.off(roll))[:, None] <= np.radians(ROLL / 2.0)
    return np.asarray(covers.any(axis=0))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", KINDS)
def test_greedy_beside_complete(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, *map(ord, kind)])
    cells = cells_of(kind, rng)
    limited = (
        {}
        if rng.random() < 0.5
        else {"roll_deg": (-ROLL / 2, ROLL / 2), "roll_reference": (0.2, 1, 0.1)}
    )
    tolerance = [None, 1e-3, 3e-3][seed % 3]
    task = Task(rng.uniform(0.003, 0.03), rng.uniform(15, 45), tolerance, **limited)
    search = Search(
        method="greedy",
        step_deg=float(rng.choice([0.1, 0.3])),
        moves=str(rng.choice(["single", "all"])),  # type: ignore[arg-type]
        cap=2000,
        starts=3,
    )
    greedy = greedy_check(ARM, cells, task, search)
    assert greedy.answer is not Answer.UNDECIDED, greedy.message
    complete = check(ARM, cells, task, Search(time_limit=60.0))
    print(kind, seed, greedy.n_covered, complete.n_covered, len(cells), complete.answer)
    if complete.evidence is Evidence.PROOF and greedy.tree is not None and greedy.tree.edges:
        at_centres = reached(task, cells, motions_of(greedy.tree))
        assert not at_centres[[cause.cell for cause in complete.causes if cause.proved]].any()


@pytest.mark.parametrize("kind", KINDS)
def test_both_readings_agree_on_the_tree(kind: str) -> None:
    """At a coarse step: the same cells as printed."""
    rng = np.random.default_rng([99, *map(ord, kind)])
    cells = cells_of(kind, rng)
    task, search = Task(0.01, 45), Search(method="greedy", step_deg=2.0, starts=1)
    literal = LiteralSearch.of(ARM, cells, task, search)
    compiled = greedy_check(ARM, cells, task, search, start=literal.start)
    found = literal.algorithm_2()
    assert compiled.statistics["capped"] == 0
    assert {(a, b) for b, a in found.T.items() if a is not None} == set(compiled.tree.edges)
