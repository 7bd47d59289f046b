"""Trees of boxes around triangles, built a level at a time.

Each box is turned into the main directions of its triangles' corners, so that one around a smooth
piece of surface is thin. The triangles are halved at the median along the longest direction.
"""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.collisions.kernels import tables as T

CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
OUTWARD = 1e-12  # relative: boxes hold their corners in spite of rounding


class BoxTree(NamedTuple):
    """Nodes, the root first; a leaf is one triangle."""

    nodes: Array
    """(2 k - 1, NODE_COLUMNS); LEFT and RIGHT are rows of it, -1 in leaves; FIRST and LAST rows of
    `corners`: eight of a box, three of a triangle."""
    corners: Array
    """(c, 3) m"""


def box_tree(triangles: Array) -> BoxTree:
    """The tree of k >= 1 triangles, (k, 3, 3) m."""
    order = np.arange(len(triangles))
    starts = np.array([0])  # of the nodes of this level, in `order`
    sizes = np.array([len(triangles)])
    levels, children, below = [], [], 1
    while len(starts):
        held = _runs(starts, sizes)
        points = triangles[order[held]].reshape(-1, 3)
        boxes = _boxes(points, sizes)
        inner = sizes > 1
        first = np.full((len(sizes), 2), -1)
        first[inner] = below + np.arange(2 * inner.sum()).reshape(-1, 2)
        below += 2 * int(inner.sum())
        corners = np.empty((len(sizes), 8, 3))
        corners[inner] = _corners(boxes[inner])
        corners[~inner, :3] = triangles[order[starts[~inner]]]
        levels.append((boxes, corners, np.where(inner, 8, 3)))
        children.append(first)
        order[held] = _sorted_along(triangles, order[held], sizes, boxes)
        half = sizes[inner] // 2
        starts = np.column_stack([starts[inner], starts[inner] + half]).ravel()
        sizes = np.column_stack([half, sizes[inner] - half]).ravel()
    boxes = np.vstack([level[0] for level in levels])
    counts = np.concatenate([level[2] for level in levels])
    cloud = np.vstack([level[1] for level in levels])
    nodes = np.zeros((len(boxes), T.NODE_COLUMNS))
    nodes[:, T.MIDDLE :] = boxes
    nodes[:, [T.LEFT, T.RIGHT]] = np.vstack(children)
    nodes[:, T.LAST] = np.cumsum(counts)
    nodes[:, T.FIRST] = nodes[:, T.LAST] - counts
    return BoxTree(nodes, cloud[np.arange(8) < counts[:, None]])


def moved(tree: BoxTree, rotation: Array, position: Array) -> BoxTree:
    """The tree of the same triangles after x -> rotation x + position, which costs no sorting.

    Args:
        tree: of the triangles where they were.
        rotation: (3, 3)
        position: (3,) m
    """
    if np.array_equal(rotation, np.eye(3)) and not position.any():
        return tree
    nodes, corners = tree.nodes.copy(), np.empty_like(tree.corners)
    boxes = nodes[:, T.MIDDLE :]
    boxes[:, :3] = np.einsum("mk,ik->mi", boxes[:, :3], rotation) + position
    boxes[:, 3:12] = (boxes[:, 3:12].reshape(-1, 3, 3) @ rotation.T).reshape(-1, 9)
    boxes[:, 12:] += OUTWARD * (np.abs(boxes[0, :3]).max() + np.linalg.norm(boxes[0, 12:]))
    first, inner = nodes[:, T.FIRST].astype(np.int64)[:, None], nodes[:, T.LEFT] >= 0
    own = first[~inner] + np.arange(3)  # of triangles
    corners[own] = tree.corners[own] @ rotation.T + position
    corners[first[inner] + np.arange(8)] = _corners(boxes[inner])
    return BoxTree(nodes, corners)


def _runs(starts: Ints, sizes: Ints) -> Ints:
    """All places of consecutive runs, one after the other."""
    ends = np.cumsum(sizes)
    return np.asarray(np.arange(ends[-1]) + np.repeat(starts - (ends - sizes), sizes))


def _boxes(points: Array, sizes: Ints) -> Array:
    """(m, 15) middle, axes as rows (the longest first) and half sides; three points a triangle."""
    at = np.concatenate([[0], np.cumsum(3 * sizes)[:-1]])
    owner = np.repeat(np.arange(len(sizes)), 3 * sizes)
    mean = np.add.reduceat(points, at) / (3 * sizes)[:, None]
    off = points - mean[owner]
    products = np.add.reduceat(off[:, :, None] * off[:, None, :], at)
    axes = np.linalg.eigh(products)[1].transpose(0, 2, 1)[:, ::-1]  # rows, the longest first
    along = np.einsum("pk,pak->pa", off, axes[owner])
    low, high = np.minimum.reduceat(along, at), np.maximum.reduceat(along, at)
    middle = mean + np.einsum("ma,mak->mk", 0.5 * (low + high), axes)
    scale = np.maximum.reduceat(np.abs(points).max(axis=1), at)
    half = 0.5 * (high - low) + OUTWARD * scale[:, None]
    return np.hstack([middle, axes.reshape(-1, 9), half])


def _corners(boxes: Array) -> Array:
    """(m, 8, 3) corners of boxes."""
    middle, axes = boxes[:, None, :3], boxes[:, 3:12].reshape(-1, 3, 3)
    sides = CORNERS[None] * boxes[:, None, 12:]
    return np.asarray(middle + sides @ axes)


def _sorted_along(triangles: Array, held: Ints, sizes: Ints, boxes: Array) -> Ints:
    """The triangles of each node, sorted along its longest direction."""
    node = np.repeat(np.arange(len(sizes)), sizes)
    centres = triangles[held].mean(axis=1)
    along = np.einsum("pk,pk->p", centres, boxes[node, 3:6])
    return np.asarray(held[np.lexsort((along, node))])
