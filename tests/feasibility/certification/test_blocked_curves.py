"""Curves between cells that no arm can follow, and the message about them."""

from __future__ import annotations

import re

import networkx as nx
import numpy as np
import pytest

from feasibility import Task
from feasibility.targets import blocked_curves, target_curves
from surfaces import plane, sphere
from surfaces.meshes import TriangleMesh, mesh


def zigzag(*turns_deg: float) -> TriangleMesh:
    """Plates of 0.2 m side by side; the normal turns by an angle from each to the next."""
    slopes = np.radians(np.cumsum([0.0, *turns_deg]))
    x = np.concatenate([[0.0], np.cumsum(0.2 * np.cos(slopes))])
    z = np.concatenate([[0.0], np.cumsum(-0.2 * np.sin(slopes))])
    vertices = [[a, y, b] for a, b in zip(x, z, strict=True) for y in (0.0, 0.3)]
    faces = [
        f for k in range(0, 2 * len(slopes), 2) for f in ([k, k + 2, k + 3], [k, k + 3, k + 1])
    ]
    return TriangleMesh(np.array(vertices), faces)


def reported_parts(text: str) -> int:
    """The number of parts in the message."""
    found = re.search(r"leaves (\d+) parts", text)
    return 1 if found is None else int(found[1])


@pytest.mark.parametrize("turns", [(-70,), (60, -70), (-70, -60), (-60, 50, -60), (50, 50)])
def test_the_parts_that_blocked_curves_leave_are_counted(turns: tuple[int, ...]) -> None:
    """A motion goes round convex edges, not into concave ones."""
    cells, task = mesh(zigzag(*turns)).cells(60), Task(standoff=0.02, cone_deg=60)
    text = blocked_curves(cells, task)
    curves = target_curves(cells, task)
    usable = ~curves.folded & (curves.deviations[:, 0] < 1e-3) & (curves.deviations[:, 1] < 1.0)
    graph = nx.Graph(cells.pairs[usable].tolist())
    graph.add_nodes_from(range(len(cells)))
    assert reported_parts(text) == nx.number_connected_components(graph)
    assert reported_parts(text) >= 1 + sum(turn < 0 for turn in turns)
    assert (reported_parts(text) == 1) == (min(turns) > 0)
    assert ("no arm's motion joins" in text) == (reported_parts(text) > 1)


def test_no_message_where_no_curve_is_blocked() -> None:
    for cells in (plane((0, 1), (0, 1)).cells(3, 4), sphere(0.5, (20, 80), (0, 90)).cells(4, 4)):
        assert blocked_curves(cells, Task(standoff=0.02, cone_deg=30)) == ""


def test_a_fixed_orientation_blocks_nothing_but_a_cone_of_zero_alone_does() -> None:
    cells = plane((0, 1), (0, 1)).cells(3, 4)
    assert blocked_curves(cells, Task(0.02, 30, roll_deg=(5, 5))) == ""
    assert blocked_curves(cells, Task(0.02, 0, roll_deg=(5, 5))) == ""
    assert "cone of 0" in blocked_curves(cells, Task(0.02, 0))
