"""Whether a PUMA covers a patch, from its closed-form inverse kinematics.

Its tool point is the wrist centre: theta1 to theta3 place it, in four branches (shoulder s, elbow
e; eq. (8) of the paper). In link frame 3 the tool axis is (-s5 c4, c5, s5 s4), so with m the
approach there, rho = hypot(m_x, m_z) and phi = atan2(m_z, -m_x), the cone asks for
s5 rho cos(theta4 - phi) + c5 m_y >= cos(alpha): intervals of theta4 at each sampled theta5 (0 and
+-pi among them, where theta4 is free). Nodes are (sample, branch with turns, theta5, interval),
joined where intervals overlap. Where a line leaves the reach two branches meet at its last point.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from oracle_cases import Answer, Domain, Floats, Ints, Problem, answer, patch

A2, A3, D3, D4 = 0.7, 0.1, 0.1, 0.7  # [m]
TAU = 2.0 * np.pi
MOST_JUMP = 1.0  # [rad] between neighbouring samples of one branch
MEETING = 1e-3  # [rad] two branches this close are one configuration
BRANCHES = np.array([(s, e) for s in (1.0, -1.0) for e in (1.0, -1.0)])
ROWS = 7.0  # of theta5 in one cone angle; the step stays within 0.4 .. 2.5 degrees
SAMPLES = 6000  # in all, where that leaves three across a cell


def slack(points: Floats) -> Floats:
    """(..., 2) what is left under the roots for shoulder and elbow; negative: out of reach."""
    across = np.sum(points[..., :2] ** 2, axis=-1) - D3**2
    stretch = (np.sum(points**2, axis=-1) - A2**2 - A3**2 - D3**2 - D4**2) / (2.0 * A2)
    return np.stack([across, A3**2 + D4**2 - stretch**2], axis=-1)


def arms(points: Floats) -> Floats:
    """(S, 4, 3) theta1 to theta3 of each branch, mod 2 pi; negative slack counts as none."""
    root = np.sqrt(np.maximum(slack(points), 0.0))
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    stretch = (np.sum(points**2, axis=-1) - A2**2 - A3**2 - D3**2 - D4**2) / (2.0 * A2)
    found = np.empty((len(points), 4, 3))
    for branch, (s, e) in enumerate(BRANCHES):
        theta1 = np.arctan2(y, x) - np.arctan2(D3, s * root[:, 0])
        theta3 = np.arctan2(A3, D4) - np.arctan2(stretch, e * root[:, 1])
        forward = np.cos(theta1) * x + np.sin(theta1) * y
        # a2 c2 + a3 c23 - d4 s23 = forward and a2 s2 + a3 s23 + d4 c23 = -z, linear in (c2, s2).
        along = A2 + A3 * np.cos(theta3) - D4 * np.sin(theta3)
        aside = A3 * np.sin(theta3) + D4 * np.cos(theta3)
        theta2 = np.arctan2(-z * along - forward * aside, forward * along - z * aside)
        found[:, branch] = np.stack([theta1, theta2, theta3], axis=-1)
    return found


def in_link3(theta: Floats, directions: Floats) -> Floats:
    """(..., 3) directions of the root frame, seen from link frame 3."""
    c1, s1 = np.cos(theta[..., 0]), np.sin(theta[..., 0])
    c23, s23 = np.cos(theta[..., 1] + theta[..., 2]), np.sin(theta[..., 1] + theta[..., 2])
    x, y, z = directions[..., 0], directions[..., 1], directions[..., 2]
    flat, side = c1 * x + s1 * y, c1 * y - s1 * x
    return np.stack([c23 * flat - s23 * z, -s23 * flat - c23 * z, side], axis=-1)


def tilts(points: Floats, approaches: Floats) -> Floats:
    """(S, 4) rad, tool along the forearm (theta5 = 0) from approach, on each branch."""
    return np.arccos(np.clip(in_link3(arms(points), approaches[:, None])[..., 1], -1.0, 1.0))


@njit(cache=True)
def _intervals(
    seen: Floats, rows: Floats, cos_cone: float, low: float, high: float, slots: int
) -> Floats:
    """(P, R, slots, 2) allowed theta4, ascending; empty ones have low > high."""
    found = np.empty((len(seen), len(rows), slots, 2))
    for p, r, slot, end in np.ndindex(found.shape):
        found[p, r, slot, end] = 1.0 - 2.0 * end
    for p in range(len(seen)):
        rho = np.hypot(seen[p, 0], seen[p, 2])
        phi = np.arctan2(seen[p, 2], -seen[p, 0])
        for r in range(len(rows)):
            lift, across = cos_cone - np.cos(rows[r]) * seen[p, 1], np.sin(rows[r]) * rho
            if abs(across) <= lift - 1e-12:
                continue
            if -abs(across) >= lift - 1e-12:
                found[p, r, 0, 0], found[p, r, 0, 1] = low, high
                continue
            half = np.arccos(lift / abs(across))
            middle = phi if across > 0.0 else phi + np.pi
            middle += TAU * np.ceil((low - half - middle) / TAU)
            slot = 0
            while middle - half <= high and slot < slots:
                found[p, r, slot, 0] = max(low, middle - half)
                found[p, r, slot, 1] = min(high, middle + half)
                middle += TAU
                slot += 1
    return found


@njit(cache=True)
def _root(parent: NDArray[np.int32], node: int) -> int:
    """The representative of a node, halving the path on the way."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@njit(cache=True)
def _join_rows(parent: NDArray[np.int32], one: Floats, base: int, two: Floats, other: int) -> None:
    """Join overlapping intervals of two rows whose nodes start at `base` and `other`."""
    for i in range(len(one)):
        for j in range(len(two)):
            if min(one[i, 1], two[j, 1]) >= max(one[i, 0], two[j, 0]):
                a, b = _root(parent, base + i), _root(parent, other + j)
                if a != b:
                    parent[max(a, b)] = min(a, b)


@njit(cache=True)
def _components(spans: Floats, arm: Ints, links: Ints) -> tuple[NDArray[np.int32], int]:
    """Union-find over every (arm node, row, interval); see `components`."""
    _, rows, slots, _ = spans.shape
    size = rows * slots
    parent = np.arange(len(arm) * size).astype(np.int32)
    for node in range(len(arm)):
        span = spans[arm[node]]
        for r in range(rows - 1):
            at = node * size + r * slots
            _join_rows(parent, span[r], at, span[r + 1], at + slots)
    for k in range(len(links)):
        a, b = links[k]
        for r in range(rows):
            at = r * slots
            _join_rows(parent, spans[arm[a], r], a * size + at, spans[arm[b], r], b * size + at)
    for node in range(len(parent)):
        parent[node] = _root(parent, node)
    return parent, size


def _turns(limits: Floats) -> Ints:
    """(W, n) whole turns that an angle of [lower, lower + 2 pi) may have on top, per joint."""
    counts = np.maximum(np.ceil((limits[:, 1] - limits[:, 0]) / TAU - 1e-12), 1).astype(int)
    return np.array(list(np.ndindex(*counts)))


def _fold_samples(problem: Problem, domain: Domain) -> tuple[Domain, Ints]:
    """The domain with the last reachable point of every line that leaves the reach."""
    reached = (slack(problem.targets(*domain.uv.T)[0]) >= 0.0).all(axis=-1)
    a, b = domain.links.T
    cut = reached[a] != reached[b]
    inside, outside = np.where(reached[a], a, b)[cut], np.where(reached[a], b, a)[cut]
    near, far = domain.uv[inside], domain.uv[outside]
    for _ in range(45):
        middle = (near + far) / 2.0
        holds = (slack(problem.targets(*middle.T)[0]) >= 0.0).all(axis=-1)[:, None]
        near, far = np.where(holds, middle, near), np.where(holds, far, middle)
    added = np.arange(len(domain.uv), len(domain.uv) + len(near))
    links = np.concatenate([domain.links, np.stack([inside, added], 1)])
    return Domain(np.concatenate([domain.uv, near]), links, domain.centres), added


class Fibres(NamedTuple):
    """Every arm branch over every sample, with what its wrist may do."""

    sample: Ints  # (A,) sample of each arm node
    branch: Ints  # (A,) row of `BRANCHES`
    theta: Floats  # (A, 3) theta1 to theta3, unwrapped, inside the limits
    arm: Ints  # (A,) row of `spans`; nodes that differ in whole turns share one
    links: Ints  # (L, 2) pairs of arm nodes that a continuous motion of theta1 to theta3 joins
    rows: Floats  # (R,) theta5
    spans: Floats  # (P, R, slots, 2) allowed theta4


def fibres(problem: Problem, domain: Domain, folds: Ints, row_step: float) -> Fibres:
    """Set up the graph; `folds` are samples where two branches meet."""
    limits = problem.limits
    points, approaches = problem.targets(*domain.uv.T)
    theta = limits[:3, 0] + (arms(points) - limits[:3, 0]) % TAU
    reached = (slack(points) >= -1e-9).all(axis=-1)
    turns = _turns(limits[:3])
    real = theta[:, :, None, :] + TAU * turns
    usable = reached[:, None, None] & (real <= limits[:3, 1]).all(axis=-1)

    node_at = np.full(usable.shape, -1)
    sample, branch, turn = np.nonzero(usable)
    node_at[sample, branch, turn] = np.arange(len(sample))
    arm_at = np.full(usable.shape[:2], -1)
    arm_sample, arm_branch = np.nonzero(usable.any(axis=2))
    arm_at[arm_sample, arm_branch] = np.arange(len(arm_sample))
    seen = in_link3(theta[arm_sample, arm_branch], approaches[arm_sample])

    # Neighbouring samples: the same branch, and the turn that keeps every joint continuous.
    links = []
    sets = [(domain.links[:, 0], domain.links[:, 1], k, k, MOST_JUMP) for k in range(4)]
    sets += [(folds, folds, k, j, MEETING) for k in range(4) for j in range(k)]
    for a, b, k, j, most in sets:
        for w in range(len(turns)):
            for x in range(len(turns)):
                close = np.abs(real[a, k, w] - real[b, j, x]).max(axis=-1, initial=0.0) < most
                pair = np.stack([node_at[a, k, w], node_at[b, j, x]], 1)
                links.append(pair[close & (pair >= 0).all(axis=1)])
    rows = _rows(limits[4], row_step)
    slots = int(np.ceil((limits[3, 1] - limits[3, 0]) / TAU - 1e-12)) + 1
    spans = _intervals(seen, rows, np.cos(np.radians(problem.cone_deg)), *limits[3], slots)
    return Fibres(
        sample, branch, real[sample, branch, turn], arm_at[sample, branch], np.concatenate(links),
        rows, spans,
    )  # fmt: skip


def components(found: Fibres, domain: Domain) -> tuple[Ints, Ints]:
    """Every (cell, component) that occurs, as two arrays, with repetitions."""
    parent, size = _components(found.spans, found.arm, found.links)
    cell_of = np.full(len(domain.uv), -1)
    cell_of[domain.centres] = np.arange(len(domain.centres))
    over = np.flatnonzero(cell_of[found.sample] >= 0)
    live = found.spans[..., 0] <= found.spans[..., 1]
    live = live.reshape(len(live), size)[found.arm[over]]
    which, at = np.nonzero(live)
    return cell_of[found.sample[over]][which], parent[over[which] * size + at].astype(np.int64)


def _rows(limits: Floats, step: float) -> Floats:
    """theta5 from limit to limit, among them every multiple of pi in between."""
    step = np.pi / np.ceil(np.pi / step)
    inner = np.arange(np.ceil(limits[0] / step), np.floor(limits[1] / step) + 1) * step
    return np.unique(np.concatenate([limits, inner[(inner > limits[0]) & (inner < limits[1])]]))


def solve(problem: Problem) -> Answer:
    n_cells = problem.cells[0] * problem.cells[1]
    if (problem.limits[:, 0] > problem.limits[:, 1]).any():
        return Answer(n_cells == 0, 0, 0)
    across = int(np.sqrt(SAMPLES / n_cells))
    domain, folds = _fold_samples(problem, patch(problem, max((across - 1) // 2 * 2 + 1, 3)))
    row_step = float(np.radians(np.clip(problem.cone_deg / ROWS, 0.4, 2.5)))
    return answer(n_cells, *components(fibres(problem, domain, folds, row_step), domain))
