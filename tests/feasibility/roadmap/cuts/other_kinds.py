"""The surface of a stored problem as other kinds of surface, so that the same proof has to exist.

Cells are the same to about 1e-5 m, only those of the mesh are its own.
"""

from __future__ import annotations

import mesh_patches
import numpy as np
from oracle_build import built, surface_of
from oracle_cases import Problem
from scipy.interpolate import make_interp_spline

from feasibility.roadmap.cuts import Prover, components_of, places_on
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import arrays_of
from feasibility.roadmap.search import seed_middle
from surfaces import bspline, cylinder, hyperboloid, mesh, piecewise, plane, revolution, sphere
from surfaces.meshes.triangle_mesh import TriangleMesh

MAKERS = {"plane": plane, "sphere": sphere, "cylinder": cylinder, "hyperboloid": hyperboloid}


def remade(problem: Problem) -> dict[str, object]:
    """Cells of the same surface by kind."""
    nu, nv = problem.cells
    pose = {"side": problem.side, "position": problem.position, "rpy_deg": problem.rpy_deg}
    surface = surface_of(problem)
    make, (low, high) = MAKERS[problem.kind], problem.v
    share = nv // 2 / nv if nv > 1 else 0.5
    middle = low + share * (high - low)
    halves = [make(*problem.size, problem.u, ends) for ends in ((low, middle), (middle, high))]
    counts = [(nu, max(nv // 2, 1)), (nu, max(nv - nv // 2, 1))]
    made = {
        "piecewise": piecewise(halves, **pose).cells(counts),
        "bspline": _spline(surface, pose).cells(nu, nv),
    }
    if problem.kind == "sphere":
        made["revolution"] = _turned_sphere(problem, pose).cells(nu, nv)
    triangles = _mesh(surface, pose)
    if triangles is not None:
        made["mesh"] = triangles.cells(count=nu * nv)
    return made


def _grid(surface, count):
    """Points (count, count, 3) in the own frame at even parameters."""
    u, v = (np.linspace(*ends, count) for ends in (surface.u_range, surface.v_range))
    return surface.local_point(*np.meshgrid(u, v, indexing="ij"))


def _spline(surface, pose, count=13):
    """Through points of the surface; its parameters are even where those are."""
    t = np.linspace(0.0, 1.0, count)
    along = make_interp_spline(t, _grid(surface, count), 3)
    net = make_interp_spline(t, np.moveaxis(along.c, 1, 0), 3).c
    points, knots = np.moveaxis(net, 1, 0), along.t
    middle = (np.array(sum(ends) / 2.0) for ends in (surface.u_range, surface.v_range))
    made = bspline(points, (3, 3), (knots, knots), **pose)
    if made.local_normal(np.array(0.5), np.array(0.5)) @ surface.local_normal(*middle) < 0.0:
        made = bspline(points[::-1], (3, 3), (knots, knots), **pose)
    return made


def _turned_sphere(problem, pose):
    polar = np.radians(np.linspace(problem.u[1], problem.u[0], 41))
    profile = problem.size[0] * np.column_stack([np.sin(polar), np.cos(polar)])
    profile[np.abs(profile[:, 0]) < 1e-9, 0] = 0.0
    return revolution(profile, problem.v, **pose)


def _mesh(surface, pose, count=30):
    """Triangles over even parameters; None where some are none, at a pole."""
    _, _, faces = mesh_patches.grid(count, count)
    points = _grid(surface, count + 1).reshape(-1, 3)
    sides = points[faces[:, 1:]] - points[faces[:, :1]]
    across = np.cross(sides[:, 0], sides[:, 1])
    if np.linalg.norm(across, axis=1).min() < 1e-9:
        return None
    middle = points[faces].mean(axis=1) @ surface.rotation.T + surface.position
    outward = surface.closest(middle).normal @ surface.rotation
    if (across * outward).sum() < 0.0:
        faces = faces[:, ::-1]
    return mesh(TriangleMesh(points, faces), **pose)


def remade_problems(robot, problem):
    """(kind, what `prove` wants) of a problem on each other kind of surface."""
    limited, _, task = built(problem, robot)
    return [(kind, (limited, cells, task)) for kind, cells in remade(problem).items()]


def proved_though_covered(robot, cells, task, rng, halves, budget=4000):
    """Is something proved of a broken covering roadmap? None where no cover is found at once."""
    arrays = arrays_of(robot, cells, task)
    exploration = Exploration(robot, cells, arrays, 0)
    if not seed_middle(exploration):
        return None
    parts = halves(components_of(exploration.roadmap)[0], rng)
    prover = Prover(arrays, places_on(cells.surface, task), rng)
    return any(prover.attempt(parts, budget, lambda: None).tree is not None for _ in range(2))
