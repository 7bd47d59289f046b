"""Motions between neighbouring centres, and every motion that a search stores, replayed."""

from __future__ import annotations

import numpy as np
import pytest
from dense_replay import tools
from random_arms import QUESTIONS, finite_limits, question

from feasibility.certification import replay
from feasibility.roadmap import (
    Exploration,
    arrays_of,
    close,
    edge_motion,
    explore,
    margin_shares,
    track,
    work_for,
)
from feasibility.roadmap.graph import EDGES
from feasibility.roadmap.motions.arrays import STOPPED
from feasibility.verdict import Walk


def refusal(robot, cells, task, q, first, last):
    """Why the replay refuses a motion from one cell's centre to another's; empty if it does not."""
    marks = np.full(len(q), -1)
    marks[0], marks[-1] = first, last
    return replay(robot, cells, task, Walk(q, marks), np.zeros(len(cells), dtype=bool)).refusal


@pytest.mark.parametrize("name", QUESTIONS)
def test_motions_end_over_the_next_centre(name):
    """From several configurations over every cell into every neighbour."""
    robot, cells, task = question(name)
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    targets = task.targets(cells)
    rng = np.random.default_rng(5)
    waypoints = np.empty((500, robot.n))
    arrived = 0
    for cell in range(0, len(cells), 2):
        guesses = rng.uniform(*finite_limits(robot), (6, robot.n))
        starts = guesses[margin_shares(arrays, work, cell, guesses) >= 0.0]
        entries = slice(*cells.neighbours.indptr[cell : cell + 2])
        links = cells.neighbours.links[entries]
        for other, curve in zip(cells.neighbours.of(cell), links, strict=True):
            begin, end = (0.0, 1.0) if cell < other else (1.0, 0.0)
            for start in starts[:2]:
                q = start.copy()
                rows = track(arrays, work, curve, begin, end, q, q, False, waypoints, 0)
                if rows < 0:
                    assert rows == STOPPED
                    assert work.stop_reason[0] > 0
                    continue
                arrived += 1
                motion = np.vstack([start[None], waypoints[:rows]])
                assert (q == motion[-1]).all()
                (point,), _ = tools(robot, q[None])
                assert np.linalg.norm(point - targets.points[other]) <= arrays.near + 1e-12
                assert refusal(robot, cells, task, motion, cell, other) == ""
    assert arrived > 20


def test_a_motion_does_not_start_off_its_target():
    """A start that is not over the given point of the curve is refused."""
    robot, cells, task = question("ur5, plate")
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    waypoints = np.empty((500, robot.n))
    q = np.zeros(robot.n)
    assert track(arrays, work, 0, 0.0, 1.0, q, q, False, waypoints, 0) == STOPPED


@pytest.mark.parametrize("name", QUESTIONS)
@pytest.mark.parametrize("seed", [0, 1])
def test_every_motion_that_a_search_stores_holds(name, seed):
    """Spread, explored and closed: each edge runs from node to node, and the replay accepts it."""
    robot, cells, task = question(name)
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), seed)
    explore(exploration)
    for cell in range(0, len(cells), 3):
        exploration.add_seeds(cell, exploration.guesses(3))
        exploration.explore_self_motions(cell)
    close(exploration)
    roadmap = exploration.roadmap
    count = int(roadmap.counters[EDGES])
    assert count >= len(cells) - 1
    for e in range(count):
        x, y = roadmap.ends[e]
        motion = edge_motion(roadmap, e)
        assert (motion[0] == roadmap.q[x]).all()
        assert (motion[-1] == roadmap.q[y]).all()
        assert refusal(robot, cells, task, motion, roadmap.cell[x], roadmap.cell[y]) == ""
