"""Motions are run with joints near the middle of their limits, or near home, not turns away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from feasibility import Task, check
from feasibility.certification import replay
from feasibility.paths import coverage_path, unwound
from feasibility.verdict import Walk
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")  # the first joints turn by a turn either way
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2)).cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=20)
EVERY = np.ones(len(CELLS), dtype=bool)


@pytest.fixture(scope="module")
def verdict():
    return check(UR5, CELLS, TASK)


@pytest.mark.parametrize("turns", [[0, 1, 0, 0, 0, 0], [1, 0, 0, -1, 0, 1]])
def test_full_turns_are_undone_and_the_replay_accepts_it(verdict, turns) -> None:
    walk = verdict.witness
    middle = 0.5 * (walk.q.min(axis=0) + walk.q.max(axis=0))
    way = -np.sign(middle) * np.array(turns) * np.sign(np.abs(turns))
    far = walk.q + 2.0 * np.pi * np.abs(turns) * np.where(way == 0, 0, -np.sign(middle))
    assert (far >= UR5.lower).all()
    assert (far <= UR5.upper).all()
    found = unwound(UR5, TASK, Walk(far, walk.cell))
    assert np.abs(0.5 * (found.q.min(axis=0) + found.q.max(axis=0))).max() <= np.pi + 1e-9
    assert replay(UR5, CELLS, TASK, found, EVERY).accepted
    path = coverage_path(replace(verdict, witness=Walk(far, walk.cell)))
    assert np.abs(path.walk.q).max() <= 1.5 * np.pi


def test_home_says_which_turn_and_a_start_is_kept(verdict) -> None:
    walk = verdict.witness
    home = np.degrees(walk.q[0])
    home[1] += 360.0 if home[1] < 0 else -360.0
    found = unwound(UR5, replace(TASK, home_deg=tuple(home.tolist())), walk)
    assert np.allclose(np.degrees(found.q[0]), home)
    assert replay(UR5, CELLS, TASK, found, EVERY).accepted
    begun = load_robot("ur5", start=walk.q[0].tolist())
    assert unwound(begun, replace(TASK, home_deg=tuple(home.tolist())), walk) is walk


def test_joints_without_limits_are_turned_towards_zero(verdict) -> None:
    free = replace(UR5, lower=np.full(6, -np.inf), upper=np.full(6, np.inf))
    far = Walk(verdict.witness.q + 2.0 * np.pi, verdict.witness.cell)
    found = unwound(free, TASK, far)  # a warning of numpy is an error here
    assert np.abs(0.5 * (found.q.min(axis=0) + found.q.max(axis=0))).max() <= np.pi + 1e-9
