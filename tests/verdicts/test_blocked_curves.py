"""Curves between cells that no arm can follow, and what is said of them and of values."""

import re

import networkx as nx
import numpy as np
import pytest

from coverable import Task, mesh, plane, sphere
from feasibility.roadmap.causes.diagnosis import decimals
from feasibility.targets.blocked import blocked_curves
from feasibility.targets.curves import target_curves
from surfaces.meshes.triangle_mesh import TriangleMesh


def zigzag(*turns_deg):
    """Plates of 0.2 m side by side; the normal turns by an angle from each to the next."""
    slopes = np.radians(np.cumsum([0.0, *turns_deg]))
    x = np.concatenate([[0.0], np.cumsum(0.2 * np.cos(slopes))])
    z = np.concatenate([[0.0], np.cumsum(-0.2 * np.sin(slopes))])
    vertices = [[a, y, b] for a, b in zip(x, z, strict=True) for y in (0.0, 0.3)]
    corners = range(0, 2 * len(slopes), 2)
    faces = [f for k in corners for f in ([k, k + 2, k + 3], [k, k + 3, k + 1])]
    return TriangleMesh(np.array(vertices), faces)


@pytest.mark.parametrize("turns", [(-70,), (60, -70), (-60, 50, -60), (50, 50)])
def test_the_parts_that_blocked_curves_leave_are_counted(turns):
    """A motion goes round convex edges, not into concave ones."""
    cells, task = mesh(zigzag(*turns)).cells(40), Task(standoff=0.02, cone_deg=60)
    text = blocked_curves(cells, task)
    found = re.search(r"leaves (\d+) parts", text)
    parts = 1 if found is None else int(found[1])
    curves = target_curves(cells, task)
    usable = ~curves.folded & (curves.deviations[:, 0] < 1e-3) & (curves.deviations[:, 1] < 1.0)
    graph = nx.Graph(cells.pairs[usable].tolist())
    graph.add_nodes_from(range(len(cells)))
    assert parts == nx.number_connected_components(graph)
    assert parts >= 1 + sum(turn < 0 for turn in turns)
    assert (parts == 1) == (min(turns) > 0)
    assert ("no arm's motion joins" in text) == (parts > 1)


FLAT, BALL = plane((0, 1), (0, 1)).cells(3, 4), sphere(0.5, (20, 80), (0, 90)).cells(4, 4)


@pytest.mark.parametrize(("cells", "task", "word"), [
    (FLAT, Task(0.02, 30), ""), (BALL, Task(0.02, 30), ""), (FLAT, Task(0.02, 0), "cone of 0"),
    (FLAT, Task(0.02, 30, roll_deg=(5, 5)), ""), (FLAT, Task(0.02, 0, roll_deg=(5, 5)), ""),
])  # fmt: skip
def test_a_cone_of_zero_alone_blocks_what_a_fixed_orientation_does_not(cells, task, word):
    said = blocked_curves(cells, task)
    assert word in said
    assert bool(said) == bool(word)


@pytest.mark.parametrize("least", [0, 1, 3])
def test_a_value_is_never_printed_like_the_bound_that_it_passes(least):
    rng = np.random.default_rng(least)
    for bound in rng.uniform(0.0, 200.0, 200):
        value = bound + 10.0 ** rng.uniform(-5.9, 1.0)
        count = decimals(value, bound, least)
        assert count >= least
        assert f"{value:.{count}f}" != f"{bound:.{count}f}"
        if count > least:
            assert f"{value:.{count - 1}f}" == f"{bound:.{count - 1}f}"
