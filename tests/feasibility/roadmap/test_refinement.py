"""Motions beside the curves between cell centres are found in finer cells."""

from __future__ import annotations

from functools import partial

import numpy as np

from feasibility import Search, Task, check
from feasibility.certification import replay_over_surface
from feasibility.problem import Problem
from feasibility.roadmap import Exploration, arrays_of, edge_motion, explore
from feasibility.roadmap.complete import between_rounds
from feasibility.roadmap.graph import EDGES, NODES, root_of
from feasibility.roadmap.outcome import unfinished_words
from feasibility.roadmap.proving import Proving
from feasibility.roadmap.refinement import COARSE, refine
from robots import load_robot
from surfaces import sphere


def between_curves():
    """The inside of a ball: the PUMA's wrist flips between the curves only."""
    limits = [
        (-200.0, 200.0),
        (-200.0, 200.0),
        (-155.2582, 153.8292),
        (-106.1206, 125.1826),
        (-97.7319, 58.855),
        (-54.7743, 94.7147),
    ]
    robot = load_robot("puma560", limits=np.radians(limits))
    ball = sphere(
        0.3868,
        polar_deg=(47.0011, 150.9195),
        azimuth_deg=(0.0, 60.5778),
        side="inside",
        position=(-0.0211, 0.8578, -0.4034),
        rpy_deg=(-96.9017, -176.4046, -164.0651),
    )
    return robot, ball.cells(3, 8), Task(0.0, 11.49)


def searched(seed, between=False):
    """The search along the curves alone, or with what is tried between rounds."""
    robot, cells, task = between_curves()
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), seed)
    proving = Proving(exploration, task)
    explore(exploration, partial(between_rounds, exploration, proving, task) if between else None)
    return exploration, proving, task


def test_a_motion_beside_the_curves_is_found():
    robot, cells, task = between_curves()
    verdict = check(robot, cells, task, Search(seed=1))
    assert verdict.evidence == "witness"
    assert replay_over_surface(robot, cells, task, verdict.witness.q).accepted


def test_what_is_taken_over_is_one_roadmap():
    """Every edge begins and ends at its nodes, and joins nodes of one component."""
    exploration, _, task = searched(0)
    assert not exploration.complete
    before = int(exploration.roadmap.counters[EDGES])
    assert refine(exploration, task, COARSE)
    assert exploration.complete
    roadmap = exploration.roadmap
    assert roadmap.counters[EDGES] > before
    for edge in range(before, int(roadmap.counters[EDGES])):
        x, y = roadmap.ends[edge]
        motion = edge_motion(roadmap, edge)
        assert (motion[0] == roadmap.q[x]).all()
        assert (motion[-1] == roadmap.q[y]).all()
        assert root_of(roadmap, roadmap.component[x]) == root_of(roadmap, roadmap.component[y])
    cover = np.zeros(len(exploration.cells), dtype=bool)
    for node in range(int(roadmap.counters[NODES])):
        if root_of(roadmap, roadmap.component[node]) == exploration.best:
            cover[roadmap.cell[node]] = True
    assert cover.all()


def test_points_of_the_motion_set_on_every_cut_leave_it_undecided():
    """Without finer cells the proof fails, and says where the arm can be."""
    exploration, proving, task = searched(0)
    proving.attempt(200_000)
    assert exploration.cut_tree is None
    problem = Problem.of(exploration.robot, exploration.cells, task)
    words = unfinished_words(problem, proving, True)
    assert "has configurations on the surface between the parts" in words
    assert " deg" in words


def test_finer_cells_keep_the_centres():
    _, cells, _ = between_curves()
    for ways in (3, 9):
        finer = cells.finer(ways)
        assert len(finer.cells) == ways * ways * len(cells)
        assert np.abs(finer.cells.centres[finer.same] - cells.centres).max() < 1e-12
        assert np.abs(finer.cells.normals[finer.same] - cells.normals).max() < 1e-12
