"""Verdicts over meshes: 4a's dome as triangles, against the patch; and a path over a bent sheet."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "surfaces" / "meshes"))

from mesh_patches import folded_sheet, grid
from paper_cases import PAPER_CASES

from feasibility import Task, check
from feasibility.paths import coverage_path
from feasibility.timing import trajectory
from robots import load_robot
from surfaces import Cells, mesh
from surfaces.meshes import TriangleMesh
from surfaces.meshes.cells import MeshCells

EVEN, UNEVEN = 1.0, 2.5  # powers of the shares along u and v: faces differ by up to 10^4 in area
SIZES = ((70, 72), (312, 320))
REPEATS = 7


def dome(nu: int, nv: int, power: float) -> MeshCells:
    """4a's patch as 2 nu nv triangles in 90 cells."""
    patch = PAPER_CASES["4a"].cells().surface
    u, v, faces = grid(nu, nv)
    ends = np.array([patch.u_range, patch.v_range])
    at = ends[:, 0] + np.column_stack([u, v]) ** power * np.ptp(ends, axis=1)
    made = TriangleMesh(patch.point(at[:, 0], at[:, 1]), faces)
    outwards = (made.face_normals * patch.normal(at[faces[:, 0], 0], at[faces[:, 0], 1])).sum()
    made = made if outwards > 0.0 else TriangleMesh(made.vertices, faces[:, ::-1])
    return mesh(made, side=patch.side).cells(90)


def least_s(ask: Callable[[], Any], repeats: int = REPEATS) -> float:
    """Least processor time of a call."""
    least = math.inf
    for _ in range(repeats):
        began = time.process_time()
        ask()
        least = min(least, time.process_time() - began)
    return least


def rows() -> tuple[str, list[dict[str, object]]]:
    """One row for each mesh; first times are those of a verdict over cells nobody has seen."""
    case = PAPER_CASES["4a"]
    robot, task = case.robot(), case.task()
    table: list[dict[str, object]] = []
    surfaces: list[tuple[str, Callable[[], Cells]]] = [("patch", case.cells)]
    for name, power in (("even", EVEN), ("uneven", UNEVEN)):
        for nu, nv in SIZES:
            surfaces.append((f"{name}, {2 * nu * nv:,} faces", partial(dome, nu, nv, power)))
    check(robot, case.cells(), task)
    check(robot, dome(20, 20, EVEN), task)
    patch_s = math.nan
    for name, make in surfaces:
        cells = make()
        first = least_s(lambda cells=cells: check(robot, cells, task), 1)
        again = least_s(lambda cells=cells: check(robot, cells, task))
        patch_s = again if name == "patch" else patch_s
        verdict = check(robot, cells, task)
        table.append(
            {
                "what": name,
                "verdict": str(verdict.answer),
                "edges": verdict.n_edges,
                "FK": verdict.statistics["fk"],
                "first ms": 1e3 * first,
                "again ms": 1e3 * again,
                "times the patch (target 3)": again / patch_s,
            }
        )
    table.append(_bent_sheet())
    title = (
        "4a's dome as a mesh of 90 cells, and the timed path over a bent sheet of 60, processor "
        f"time, least of {REPEATS}. Target of the path: 5 s."
    )
    return title, table


def _bent_sheet() -> dict[str, object]:
    """A sheet bent over a radius of 6 mm, with a standoff of 150 mm; its path at 0.1 m/s."""
    part = mesh(TriangleMesh(*folded_sheet(0.006, 20)), position=(0.45, -0.15, -0.2))
    task = Task(standoff=0.15, cone_deg=20, tolerance=5e-3)
    verdict = check(load_robot("ur10"), part.cells(60), task)
    began = time.process_time()
    trajectory(coverage_path(verdict), 0.1)
    return {
        "what": "path over the bent sheet",
        "verdict": str(verdict.answer),
        "edges": verdict.n_edges,
        "FK": verdict.statistics["fk"],
        "first ms": 1e3 * (time.process_time() - began),
        "again ms": "",
        "times the patch (target 3)": "",
    }
