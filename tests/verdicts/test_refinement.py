"""Motions beside the curves between cell centres are found in finer cells."""

from __future__ import annotations

from functools import partial

import numpy as np
from asked import question

from feasibility.problem import Problem
from feasibility.roadmap import Exploration, arrays_of, explore
from feasibility.roadmap.complete import between_rounds
from feasibility.roadmap.outcome import unfinished_words
from feasibility.roadmap.proving import Proving
from feasibility.roadmap.refinement import COARSE, refine


def searched(seed, between=False):
    """The search along the curves alone, or with what is tried between rounds."""
    _, _, robot, cells, task, _ = question("between the curves")
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), seed)
    proving = Proving(exploration, task)
    explore(exploration, partial(between_rounds, exploration, proving, task) if between else None)
    return exploration, proving, task


def test_what_is_taken_over_is_one_roadmap():
    """Every edge begins and ends at its nodes, and joins nodes of one component."""
    exploration, _, task = searched(0)
    assert not exploration.complete
    before = len(exploration.roadmap.edges)
    assert refine(exploration, task, COARSE)
    assert exploration.complete
    roadmap = exploration.roadmap
    assert len(roadmap.edges) > before
    for x, y, motion in roadmap.edges[before:]:
        assert (motion[-1] == roadmap.q[y]).all()
        assert roadmap.root_of(x) == roadmap.root_of(y)
    mine = np.flatnonzero(roadmap.roots_of_nodes() == exploration.best)
    assert {roadmap.cell[node] for node in mine} == set(range(len(exploration.cells)))


def test_points_of_the_motion_set_on_every_cut_leave_it_undecided():
    """Without finer cells the proof fails, and says where the arm can be."""
    exploration, proving, task = searched(0)
    proving.attempt(200_000)
    assert exploration.cut_tree is None
    problem = Problem.of(exploration.robot, exploration.cells, task)
    words = unfinished_words(problem, proving, True)
    assert "has configurations on the surface between the parts" in words
    assert " deg" in words
