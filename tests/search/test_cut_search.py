"""The prover on stored problems with a known answer, whatever their surface is made of."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from cut_attempts import nothing, prove, proved_wrongly
from mesh_patches import of_patch
from random_cases import built, read, surface_of
from samples import sampled, seeds, spread
from scipy.interpolate import make_interp_spline

import coverable
from coverable import bspline, cylinder, hyperboloid, mesh, piecewise, plane, revolution, sphere
from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.branch_and_bound.branching import branch_and_bound
from feasibility.roadmap.branch_and_bound.ruling import Ruling
from feasibility.roadmap.cuts.gaps import components_of
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.arrays import arrays_of
from surfaces.meshes.triangle_mesh import TriangleMesh


def stored(arm, feasible):
    """The stored problems of an arm that are feasible, or fall apart with every cell in reach."""
    found = [(p, truth) for p, truth in read(arm) if truth.feasible == feasible]
    return [p for p, t in found if feasible or t.reachable == p.cells[0] * p.cells[1]]


def case(arm, problem):
    return built(problem, coverable.load_robot(arm))


@pytest.fixture(scope="module", params=[("puma560", 9), ("ur5", 2)], ids=lambda p: p[0])
def proved(request):
    """Some stored disconnected cases, proved."""
    arm, every = request.param
    return [prove(*case(arm, problem)) for problem in stored(arm, feasible=False)[::every]]


def test_cases_that_fall_apart_are_proved_and_proved_again(proved):
    assert all(proving.tree is not None for proving in proved)
    assert {proving.tree.kind for proving in proved} == {"cut"}
    for proving in proved:
        for region, node in proving.statements():
            assert proving.ruling(region, node) is Ruling.PROVED
    assert len(branch_and_bound.signatures) == 1  # compiled once


def test_a_cut_through_the_motion_set_and_a_leaf_of_a_covered_cell_are_refuted(proved):
    """Cuts moved to where points are known, in their region; leaves of what components cover."""
    refuted = 0
    for proving in proved:
        samples = proving.prover.findings.samples
        for region, node in proving.statements():
            if isinstance(node, Cut):
                for q in samples[region.inside(samples)][:5]:
                    moved = replace(node, value=float(q[node.joint]))
                    assert proving.ruling(region, moved, 3000) is not Ruling.PROVED
                    refuted += 1
                continue
            for component in proving.components:
                if region.inside(component.q).all() and component.cover.any():
                    leaf = Leaf(int(np.flatnonzero(component.cover)[0]))
                    assert proving.ruling(region, leaf, 20_000) is not Ruling.PROVED
                    refuted += 1
    assert refuted >= 10


@sampled("seed", seeds(1, all=4))
@pytest.mark.parametrize("newton", [True, False], ids=["newton", "boxes alone"])
@pytest.mark.parametrize(("arm", "few"), [("puma560", 7), ("ur5", 6)])
def test_a_feasible_case_is_never_proved(arm, few, newton, seed):
    """However its roadmap is broken: branch and bound has to refuse, with Newton and without."""
    rng, problems = np.random.default_rng(2 + seed), stored(arm, feasible=True)
    some = spread(problems, few)
    wrong = [proved_wrongly(*case(arm, problem), rng, newton) for problem in some]
    assert wrong.count(False) >= 3
    assert True not in wrong


def test_the_same_seed_proves_alike():
    problem = case("puma560", stored("puma560", feasible=False)[4])
    one, other = (prove(*problem, seed=3) for _ in range(2))
    assert one.tree == other.tree
    assert one.attempt.boxes == other.attempt.boxes


def test_a_budget_is_kept_and_ticks_may_end_an_attempt():
    problem = case("ur5", stored("ur5", feasible=False)[2])
    proving = prove(*problem, budget=200, attempts=2)
    assert proving.tree is None
    assert proving.attempt.boxes <= 200
    ticks = count()

    def tick():
        if next(ticks) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        proving.prover.attempt(proving.components, 100_000, tick)
    assert 0 < proving.prover.attempt(proving.components, 500, nothing).boxes <= 500


def test_a_roadmap_without_nodes_has_no_components():
    robot, cells, task = case("puma560", stored("puma560", feasible=False)[12])
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    assert components_of(exploration.roadmap) == []


# the same surfaces as splines, meshes, pieces and revolutions: cells are the same to 1e-5 m


def remade(problem):
    """Cells of the same surface by kind; only those of the mesh are its own."""
    nu, nv = problem.cells
    pose = {"side": problem.side, "position": problem.position, "rpy_deg": problem.rpy_deg}
    kinds = {"plane": plane, "sphere": sphere, "cylinder": cylinder, "hyperboloid": hyperboloid}
    surface, make, (low, high) = surface_of(problem), kinds[problem.kind], problem.v
    middle = low + (nv // 2 / nv if nv > 1 else 0.5) * (high - low)
    halves = [make(*problem.size, problem.u, ends) for ends in ((low, middle), (middle, high))]
    counts = [(nu, max(nv // 2, 1)), (nu, max(nv - nv // 2, 1))]
    made = {
        "piecewise": piecewise(halves, **pose).cells(counts),
        "bspline": _spline(surface, pose).cells(nu, nv),
    }
    corners = of_patch(make(*problem.size, problem.u, problem.v, side=problem.side), 30, 30)
    sides = np.diff(corners.vertices[corners.faces], axis=1)
    if np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).min() > 1e-9:  # else a pole
        made["mesh"] = mesh(TriangleMesh(*corners), **pose).cells(count=nu * nv)
    if problem.kind == "sphere":
        polar = np.radians(np.linspace(problem.u[1], problem.u[0], 41))
        profile = problem.size[0] * np.column_stack([np.sin(polar), np.cos(polar)])
        profile[np.abs(profile[:, 0]) < 1e-9, 0] = 0.0
        made["revolution"] = revolution(profile, problem.v, **pose).cells(nu, nv)
    return made


def _spline(surface, pose):
    """Through points of the surface; its parameters are even where those are."""
    t = np.linspace(0.0, 1.0, 13)
    u, v = (np.linspace(*ends, 13) for ends in (surface.u_range, surface.v_range))
    along = make_interp_spline(t, surface.local_point(*np.meshgrid(u, v, indexing="ij")), 3)
    points = np.moveaxis(make_interp_spline(t, np.moveaxis(along.c, 1, 0), 3).c, 1, 0)
    made = bspline(points, (3, 3), (along.t, along.t), **pose)
    middle = (np.array(sum(ends) / 2.0) for ends in (surface.u_range, surface.v_range))
    if made.local_normal(np.array(0.5), np.array(0.5)) @ surface.local_normal(*middle) < 0.0:
        made = bspline(points[::-1], (3, 3), (along.t, along.t), **pose)
    return made


APART = [4, *range(5, 30), 30]


@sampled("number", spread(APART, 2))
def test_a_case_that_falls_apart_does_so_whatever_its_surface_is_made_of(number):
    problem = stored("puma560", feasible=False)[number]
    robot, _, task = case("puma560", problem)
    for kind, cells in remade(problem).items():
        proof = prove(robot, cells, task).tree
        # A mesh has cells of its own, and a truth of its own.
        assert proof is not None or (kind == "mesh" and number not in (4, 30)), problem.kind


def test_a_feasible_case_is_never_proved_whatever_its_surface_is_made_of():
    rng, refused = np.random.default_rng(5), 0
    for problem in stored("puma560", feasible=True)[::28]:
        robot, _, task = case("puma560", problem)
        for kind, cells in remade(problem).items():
            outcome = proved_wrongly(robot, cells, task, rng)
            assert outcome is not True, (problem.kind, kind)
            refused += outcome is False
    assert refused >= 2
