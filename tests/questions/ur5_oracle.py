"""Whether a UR5 covers a patch, from closed-form inverse kinematics on a grid of wrist angles.

theta6 moves neither tool point nor axis. In the frame that turns with theta1 (x1 out along the arm,
y1 along the axes of joints 2 to 4), with psi = theta2 + theta3 + theta4, the tool axis is
(s5 cos psi, c5, -s5 sin psi) and the tool point d4 + d6 c5 along y1,
l2 c2 + l3 c23 - d5 sin psi + d6 s5 cos psi along x1 and d1 - l2 s2 - l3 s23 - d5 cos psi
- d6 s5 sin psi up: theta5 and psi fix all but two signs. Neighbours in that grid and over
neighbouring samples are joined where joints stay continuous; elbows meet where links are stretched.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from oracle_cases import Answer, Floats, Ints, Problem, answer, net
from puma_oracle import TAU, _root, _rows

D1, L2, L3 = 0.089159, 0.425, 0.39225  # [m]
D4, D5, D6 = 0.13585 - 0.1197 + 0.093, 0.09465, 0.0823  # [m]
CLEARANCE = 0.25  # [m] from the first axis; the shoulders meet at D4 + D6 = 0.19145
MOST_JUMP = 1.0  # [rad] of a joint between neighbours
MOST_FLIP = 1.2  # [rad] of a joint between two elbows that meet nearby
STEPS = 8.0  # of theta5 and of psi in one cone angle; they stay within 2 .. 5 degrees
PIECES = 6  # of a line between centres
INVALID, STRETCHED = -1, -2


@njit(cache=True)
def arm(
    x: float, y: float, z: float, s: float, e: float, theta5: float, psi: float, out: Floats
) -> float:
    """Fill theta1 to theta4 (mod 2 pi) for a point beyond d4 + d6; returns cos(theta3)."""
    c5, s5, cp, sp = np.cos(theta5), np.sin(theta5), np.cos(psi), np.sin(psi)
    aside = D4 + D6 * c5
    along = s * np.sqrt(x * x + y * y - aside * aside)
    out[0] = np.arctan2(y, x) - np.arctan2(aside, along)
    reach = along + D5 * sp - D6 * s5 * cp
    drop = -(z - D1 + D5 * cp + D6 * s5 * sp)
    cosine = (reach * reach + drop * drop - L2 * L2 - L3 * L3) / (2.0 * L2 * L3)
    if abs(cosine) <= 1.0:
        out[2] = e * np.arccos(cosine)
        out[1] = np.arctan2(drop, reach) - np.arctan2(L3 * np.sin(out[2]), L2 + L3 * np.cos(out[2]))
        out[3] = psi - out[1] - out[2]
    return cosine


@njit(cache=True)
def _fill(
    points: Floats,
    approaches: Floats,
    rows: Floats,
    columns: Floats,
    cos_cone: float,
    limits: Floats,
    place: NDArray[np.int32],
    theta: Floats,
) -> int:
    """Number the valid places of the grid and keep their joints; returns how many there are."""
    count, trial = 0, np.zeros(4)
    cosines, sines = np.cos(columns), np.sin(columns)
    for i in range(len(points)):
        x, y, z = points[i]
        nx, ny, nz = approaches[i]
        for shoulder in range(2):
            s = 1.0 - 2.0 * shoulder
            for r in range(len(rows)):
                c5, s5 = np.cos(rows[r]), np.sin(rows[r])
                aside = D4 + D6 * c5
                along = s * np.sqrt(x * x + y * y - aside * aside)
                theta1 = np.arctan2(y, x) - np.arctan2(aside, along)
                out = np.cos(theta1) * nx + np.sin(theta1) * ny
                across = np.cos(theta1) * ny - np.sin(theta1) * nx
                for c in range(len(columns)):
                    if c5 * across + s5 * (cosines[c] * out - sines[c] * nz) < cos_cone:
                        continue
                    if len(theta) == 0:
                        count += 2
                        continue
                    for elbow in range(2):
                        e = 1.0 - 2.0 * elbow
                        cosine = arm(x, y, z, s, e, rows[r], columns[c], trial)
                        if abs(cosine) > 1.0:
                            beyond = STRETCHED if cosine > 1.0 else INVALID
                            place[i, shoulder, r, c, elbow] = beyond
                            continue
                        held = True
                        for k in range(4):
                            trial[k] -= TAU * np.floor((trial[k] - limits[k, 0]) / TAU)
                            held = held and trial[k] <= limits[k, 1]
                        if held:
                            theta[count] = trial
                            place[i, shoulder, r, c, elbow] = count
                            count += 1
    return count


@njit(cache=True)
def _join(
    parent: NDArray[np.int32],
    theta: Floats,
    upper: Floats,
    turns: Ints,
    one: int,
    other: int,
    most: float,
) -> None:
    """Join two places in every pair of turns that keeps each joint continuous."""
    if one < 0 or other < 0:
        return
    for w in range(len(turns)):
        for x in range(len(turns)):
            near = True
            for k in range(4):
                a = theta[one, k] + TAU * turns[w, k]
                b = theta[other, k] + TAU * turns[x, k]
                near = near and abs(a - b) < most and a <= upper[k] and b <= upper[k]
            if near:
                p, q = _root(parent, one * len(turns) + w), _root(parent, other * len(turns) + x)
                if p != q:
                    parent[max(p, q)] = min(p, q)


@njit(cache=True)
def _components(
    place: NDArray[np.int32], theta: Floats, upper: Floats, turns: Ints, links: Ints
) -> NDArray[np.int32]:
    """The representative of every (place, turns)."""
    samples, _, rows, columns, _ = place.shape
    parent = np.arange(len(theta) * len(turns)).astype(np.int32)
    for i in range(samples):
        for s in range(2):
            for r in range(rows):
                for c in range(columns):
                    if place[i, s, r, c, 0] < 0 and place[i, s, r, c, 1] < 0:
                        continue
                    here, right = place[i, s, r, c], place[i, s, r, (c + 1) % columns]
                    down = place[i, s, min(r + 1, rows - 1), c]
                    up, left = place[i, s, max(r - 1, 0), c], place[i, s, r, c - 1]
                    for e in range(2):
                        _join(parent, theta, upper, turns, here[e], right[e], MOST_JUMP)
                        _join(parent, theta, upper, turns, here[e], down[e], MOST_JUMP)
                    if STRETCHED in (right[0], down[0], up[0], left[0]):
                        _join(parent, theta, upper, turns, here[0], here[1], MOST_FLIP)
    for k in range(len(links)):
        i, j = links[k]
        for s in range(2):
            for r in range(rows):
                for c in range(columns):
                    ours = max(place[i, s, r, c, 0], place[i, s, r, c, 1])
                    theirs = max(place[j, s, r, c, 0], place[j, s, r, c, 1])
                    if ours < 0 and theirs < 0:
                        continue
                    one, other = place[i, s, r, c], place[j, s, r, c]
                    for e in range(2):
                        _join(parent, theta, upper, turns, one[e], other[e], MOST_JUMP)
    for node in range(len(parent)):
        parent[node] = _root(parent, node)
    return parent


def solve(problem: Problem) -> Answer:
    """The oracle's answer, along the lines between centres."""
    n_cells = problem.cells[0] * problem.cells[1]
    limits = problem.limits
    domain = net(problem, PIECES)
    points, approaches = problem.targets(*domain.uv.T)
    if np.hypot(points[:, 0], points[:, 1]).min() < CLEARANCE:
        raise ValueError(f"the patch comes within {CLEARANCE} m of the first axis")
    step = float(np.radians(np.clip(problem.cone_deg / STEPS, 2.0, 5.0)))
    rows = _rows(limits[4], step)
    columns = np.arange(np.ceil(TAU / step)) * TAU / np.ceil(TAU / step)
    counts = np.maximum(np.ceil((limits[:4, 1] - limits[:4, 0]) / TAU - 1e-12), 1).astype(int)
    turns = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, 4)
    place = np.full((len(points), 2, len(rows), len(columns), 2), INVALID, dtype=np.int32)
    asked = (points, approaches, rows, columns, np.cos(np.radians(problem.cone_deg)), limits, place)
    theta = np.empty((_fill(*asked, np.empty((0, 4))), 4))
    theta = theta[: _fill(*asked, theta)] if len(theta) else theta
    parent = _components(place, theta, limits[:4, 1], turns, domain.links)

    cell, found = [], []
    for number, centre in enumerate(domain.centres):
        there = place[centre][place[centre] >= 0].astype(np.int64)
        held = (theta[there][:, None] + TAU * turns <= limits[:4, 1]).all(axis=-1)
        roots = np.unique(parent.reshape(-1, len(turns))[there][held])
        found.append(roots)
        cell.append(np.full(len(roots), number))
    return answer(n_cells, np.concatenate(cell), np.concatenate(found).astype(np.int64))
