"""Trees of boxes around triangles that are moved, against all corners that they have to hold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from feasibility.collisions.kernels.box_tree import BoxTree, box_tree, moved
from feasibility.collisions.kernels.tables import AXES, FIRST, HALF, LAST, LEFT, MIDDLE, RIGHT


def held(tree: BoxTree, node: int) -> np.ndarray:
    """The corners of all triangles under a node, which has to hold them."""
    row = tree.nodes[node]
    if row[LEFT] < 0:
        corners = tree.corners[int(row[FIRST]) : int(row[LAST])]
        assert len(corners) == 3
    else:
        corners = np.concatenate([held(tree, int(row[side])) for side in (LEFT, RIGHT)])
        own = tree.corners[int(row[FIRST]) : int(row[LAST])]
        assert np.allclose(inside(row, own), 0.0, atol=1e-9 * np.abs(own).max())
        assert len(own) == 8
    assert (inside(row, corners) >= 0.0).all()
    return corners


def inside(row: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far points are inside the nearest side of a box."""
    along = (points - row[MIDDLE : MIDDLE + 3]) @ row[AXES:HALF].reshape(3, 3).T
    return (row[HALF:] - np.abs(along)).min(axis=1)


@pytest.mark.parametrize("size", [1e-3, 1.0])
@pytest.mark.parametrize("count", [1, 2, 37])
def test_boxes_of_a_moved_tree_hold_the_moved_triangles(count, size):
    rng = np.random.default_rng(count)
    triangles = size * (rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3)))
    turn, shift = Rotation.random(random_state=rng).as_matrix(), np.array([3.0, -2.0, 0.5])
    tree = moved(box_tree(triangles), turn, shift)
    found, carried = held(tree, 0), triangles @ turn.T + shift
    apart = np.abs(found[:, None] - carried.reshape(-1, 3)[None]).max(axis=2)
    assert apart.min(axis=0).max() < 1e-14
    assert len(found) == 3 * count


def test_a_tree_that_stays_is_not_touched():
    tree = box_tree(np.random.default_rng(1).normal(size=(9, 3, 3)))
    held(tree, 0)
    assert moved(tree, np.eye(3), np.zeros(3)) is tree
