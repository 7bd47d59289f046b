"""Bodies and an arm as the tables of the compiled clearance."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.box_tree import BoxTree, box_tree, moved
from feasibility.collisions.kernels.tables import Array, Tables, flat, views
from feasibility.collisions.problem_bodies import Bodies, Soup
from feasibility.collisions.words import SURFACE
from robots.chain import joint_alignments
from robots.robot import Robot
from robots.shapes.bodies import Polytope

KEPT = 16  # problems, and trees, that are remembered: a search is often run again
INFLUENCE = 0.05  # m beyond its clearance: nearer pairs push
TOOL_INFLUENCE = 0.002  # m, the same for the tool and the surface, which are always near
OUTWARD = 1e-12  # m for each metre: balls and capsules hold their vertices in spite of rounding


@lru_cache(maxsize=KEPT)
def packed(bodies: Bodies, robot: Robot) -> Array:
    """All tables in one array, without the function's address; remembered: copy it, then write.

    Args:
        bodies: what can collide, and the pairs that are checked.
        robot: the arm whose joints carry them.
    """
    n = robot.n
    turned = [np.eye(3), *joint_alignments(robot.model)]
    owners: dict[tuple[str, int], list[Polytope]] = {}
    for body in bodies.polytopes:
        owners.setdefault((body.owner, body.joint), []).append(body)
    vertices = [np.empty((0, 3))]
    polytopes: list[list[float]] = []
    groups: list[list[float]] = []
    for (_, joint), parts in owners.items():
        rounded = _rounded(tuple(parts), turned[joint].tobytes())
        start = len(polytopes)
        for part, cloud, around in zip(parts, rounded.clouds, rounded.around, strict=True):
            first = sum(map(len, vertices))
            polytopes.append([0, first, first + len(cloud), part.radius, *around])
            vertices.append(cloud)
        shape = *rounded.capsule, rounded.lever
        groups.append([joint, start, len(polytopes), *shape, len(groups)])
    roots, nodes, corners = _trees(bodies, sum(map(len, vertices)))
    items, directions = _items(bodies, list(owners), groups, roots, n)
    count = len(groups)
    tables = Tables(
        state=np.zeros((1, T.STATE_COLUMNS)),
        relative=np.zeros((2, 12)),
        simplex=np.zeros((7, 10)),
        found=np.zeros((1, 10)),
        placed=np.zeros((2, 12)),
        stack=np.zeros((1, 128)),
        joints=_joints(robot),
        groups=_table(groups, T.GROUP_COLUMNS),
        polytopes=_table(polytopes, T.POLYTOPE_COLUMNS),
        vertices=np.vstack([*vertices, corners]),
        nodes=nodes,
        items=_table(items, T.ITEM_COLUMNS),
        directions=np.zeros((directions, T.DIRECTION_COLUMNS)),
        asked=np.zeros((3, n)),
        configurations=np.zeros((T.SLOTS, n)),
        poses=np.zeros((T.SLOTS * (n + 1), 12)),
        levers=np.zeros((T.SLOTS * count, n)),
        largest=np.zeros((count, n)),
        reach=np.zeros((count, n + 1)),
    )
    memory = flat(tables)
    _rows_into_places(memory)
    return memory


class _Rounded(NamedTuple):
    """The bodies of one owner on one joint, and round ones around them."""

    clouds: tuple[Array, ...]
    """(v, 3) vertices of each, in the joint's frame."""
    around: tuple[list[float], ...]
    """Of each: see `_around`."""
    capsule: list[float]
    """Around all: see `_capsule`."""
    lever: float
    """m, how far they get from the joint's axis."""


@lru_cache(maxsize=16 * KEPT)
def _rounded(parts: tuple[Polytope, ...], turned: bytes) -> _Rounded:
    """What does not change while a surface or a clearance does; remembered by the bodies.

    Args:
        parts: bodies of one owner.
        turned: (3, 3) floats, the joint's frame in which its axis is z.
    """
    turn = np.frombuffer(turned).reshape(3, 3)
    clouds = [part.vertices @ turn for part in parts]
    pairs = list(zip(clouds, parts, strict=True))
    return _Rounded(
        tuple(clouds),
        tuple(_around(cloud, part.radius) for cloud, part in pairs),
        _capsule(np.vstack(clouds), max(part.radius for part in parts)),
        max(np.hypot(c[:, 0], c[:, 1]).max() + part.radius for c, part in pairs),
    )


def _rows_into_places(memory: Array) -> None:
    """Turn rows that tables refer to into places in the memory; -1 stays."""
    t = views(memory)

    def places(column: Array, name: str) -> None:
        start, _, width = memory[1 + 3 * T.NAMES.index(name) :][:3]
        column[column >= 0] = start + width * column[column >= 0]

    for column in (T.FIRST, T.LAST):
        places(t.groups[:, column], "polytopes")
        places(t.polytopes[:, column], "vertices")
        places(t.nodes[:, column], "vertices")
    for column in (T.LEFT, T.RIGHT):
        places(t.nodes[:, column], "nodes")
    for column in (T.ITEM_A, T.ITEM_B):
        places(t.items[:, column], "groups")
    places(t.items[:, T.TREE], "nodes")
    places(t.items[:, T.DIRECTION], "directions")


def _table(rows: list[list[float]], columns: int) -> Array:
    """Rows as an array, also where there are none."""
    return np.array(rows, dtype=float).reshape(len(rows), columns)


def _joints(robot: Robot) -> Array:
    """(n, JOINT_COLUMNS) constants of the chain."""
    chain, n = robot.chain, robot.n
    table = np.empty((n, T.JOINT_COLUMNS))
    table[:, :9] = chain.rotations.reshape(n, 9)
    table[:, 9:12] = chain.translations[:n]
    table[:, 12] = chain.prismatic
    return table


def _around(cloud: Array, radius: float) -> list[float]:
    """Centre and radius of a ball around points with a radius; half sides of a box around points.

    The box is along the axes of the frame, or along the points' main directions: the smaller one.
    """
    off = cloud - cloud.mean(axis=0)
    main = np.linalg.eigh(off.T @ off)[1].T
    boxes = []
    for axes in (np.eye(3), main):
        along = cloud @ axes.T
        low, high = along.min(axis=0), along.max(axis=0)
        half = 0.5 * (high - low) + OUTWARD * (1.0 + np.abs(along).max())
        boxes.append((float((half + radius).prod()), 0.5 * (low + high) @ axes, half, axes))
    _, centre, half, axes = min(boxes, key=lambda box: box[0])
    far = np.linalg.norm(cloud - centre, axis=1).max() + radius
    return [*centre, float(far + OUTWARD * (1.0 + far)), *(half[:, None] * axes).ravel()]


def _capsule(cloud: Array, radius: float) -> list[float]:
    """Both ends and the radius of a capsule around points with a radius."""
    mean = cloud.mean(axis=0)
    axis = np.linalg.svd(cloud - mean, full_matrices=False)[2][0]
    along = (cloud - mean) @ axis
    lateral = np.linalg.norm(cloud - mean - along[:, None] * axis, axis=1)
    round_end = np.sqrt(np.maximum(lateral.max() ** 2 - lateral**2, 0.0))
    low, high = (along + round_end).min(), (along - round_end).max()
    if low > high:
        low = high = 0.5 * (low + high)
    ends = mean + np.outer([low, high], axis)
    nearest = mean + np.clip(along, low, high)[:, None] * axis
    far = np.linalg.norm(cloud - nearest, axis=1).max() + radius
    return [*ends.ravel(), float(far + OUTWARD * (1.0 + far))]


@lru_cache(maxsize=KEPT)
def _tree(triangles: bytes) -> BoxTree:
    """The tree of triangles, (k, 3, 3) floats, which many problems may share."""
    return box_tree(np.frombuffer(triangles).reshape(-1, 3, 3))


def _tree_of(soup: Soup) -> BoxTree:
    """The tree of triangles; where a surface is moved, that of its own frame moves with it."""
    if soup.sheet is None:
        return _tree(soup.triangles.tobytes())
    tree = _tree(soup.sheet.own.tobytes())
    return moved(tree, soup.sheet.rotation, soup.sheet.position)


def _trees(bodies: Bodies, above: int) -> tuple[list[int], Array, Array]:
    """The root of each soup's tree, all nodes, and all corners (their rows begin at `above`)."""
    roots, nodes, corners = [], [np.empty((0, T.NODE_COLUMNS))], [np.empty((0, 3))]
    for soup in bodies.soups:
        tree = _tree_of(soup)
        root = sum(map(len, nodes))
        shifted = tree.nodes.copy()
        shifted[:, [1, 2]] += above + sum(map(len, corners))
        shifted[:, [3, 4]] += np.where(shifted[:, [3, 4]] >= 0, root, 0)
        roots.append(root)
        nodes.append(shifted)
        corners.append(tree.corners)
    return roots, np.vstack(nodes), np.vstack(corners)


def _items(
    bodies: Bodies,
    owners: list[tuple[str, int]],
    groups: list[list[float]],
    roots: list[int],
    n: int,
) -> tuple[list[list[float]], int]:
    """What is checked, by pairs of groups and of a soup and a group; how many directions."""
    items: list[list[float]] = []
    directions, unknown = 0, (-np.inf, -np.inf)
    for index, pair in enumerate(bodies.pairs):
        first, second = (
            [k for k, (owner, _) in enumerate(owners) if owner == name]
            for name in (pair.first, pair.second)
        )
        for a, b in ((a, b) for a in first for b in second):
            if owners[a][1] > owners[b][1]:
                a, b = b, a
            joints = owners[a][1], owners[b][1]
            of_groups = directions, False, INFLUENCE
            items.append([a, b, -1, *joints, pair.clearance, index, *of_groups, *unknown])
            directions += int((groups[a][2] - groups[a][1]) * (groups[b][2] - groups[b][1]))
        for soup, root in zip(bodies.soups, roots, strict=True):
            if soup.owner in (pair.first, pair.second):
                clearance = pair.clearance + soup.deviation
                for b in first if soup.owner == pair.second else second:
                    joints = 0, owners[b][1]
                    works = joints[1] == n and soup.owner == SURFACE
                    of_soup = directions, soup.closed, TOOL_INFLUENCE if works else INFLUENCE
                    items.append([-1, b, root, *joints, clearance, index, *of_soup, *unknown])
                    directions += int(groups[b][2] - groups[b][1])
    return items, directions
