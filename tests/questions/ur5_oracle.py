"""Whether a UR5 covers a patch, from closed-form inverse kinematics on a grid of wrist angles.

theta6 moves neither tool point nor axis. In the frame that turns with theta1 (x1 out along the arm,
y1 along the axes of joints 2 to 4), with psi = theta2 + theta3 + theta4, the tool axis is
(s5 cos psi, c5, -s5 sin psi) and the tool point d4 + d6 c5 along y1,
l2 c2 + l3 c23 - d5 sin psi + d6 s5 cos psi along x1 and d1 - l2 s2 - l3 s23 - d5 cos psi
- d6 s5 sin psi up: theta5 and psi fix all but two signs. Neighbours in that grid and over
neighbouring samples are joined where joints stay continuous; elbows meet where links are stretched.
"""

import numpy as np
from numpy.typing import NDArray
from oracle_cases import Answer, Floats, Ints, Problem, answer, net
from puma_oracle import TAU, _rows, _turns
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

D1, L2, L3 = 0.089159, 0.425, 0.39225  # [m]
D4, D5, D6 = 0.13585 - 0.1197 + 0.093, 0.09465, 0.0823  # [m]
CLEARANCE = 0.25  # [m] from the first axis; the shoulders meet at D4 + D6 = 0.19145
MOST_JUMP = 1.0  # [rad] of a joint between neighbours
MOST_FLIP = 1.2  # [rad] of a joint between two elbows that meet nearby
STEPS = 8.0  # of theta5 and of psi in one cone angle; they stay within 2 .. 5 degrees
PIECES = 6  # of a line between centres
INVALID, STRETCHED = -1, -2
SIGNS = np.array([1.0, -1.0])


def shoulders(points: Floats, s: Floats, theta5: Floats) -> tuple[Floats, Floats]:
    """What is left along x1, and theta1, for points beyond d4 + d6."""
    aside = D4 + D6 * np.cos(theta5)
    along = s * np.sqrt(points[..., 0] ** 2 + points[..., 1] ** 2 - aside * aside)
    return along, np.arctan2(points[..., 1], points[..., 0]) - np.arctan2(aside, along)


def arm(points: Floats, s: Floats, e: float, theta5: Floats, psi: Floats) -> tuple[Floats, Floats]:
    """(k, 4) theta1 to theta4 (mod 2 pi), and cos(theta3) (k,), beyond +-1 out of reach."""
    along, theta1 = shoulders(points, s, theta5)
    s5, cp, sp = np.sin(theta5), np.cos(psi), np.sin(psi)
    reach = along + D5 * sp - D6 * s5 * cp
    drop = -(points[..., 2] - D1 + D5 * cp + D6 * s5 * sp)
    cosine = (reach * reach + drop * drop - L2 * L2 - L3 * L3) / (2.0 * L2 * L3)
    theta3 = e * np.arccos(np.clip(cosine, -1.0, 1.0))
    theta2 = np.arctan2(drop, reach) - np.arctan2(L3 * np.sin(theta3), L2 + L3 * np.cos(theta3))
    return np.stack([theta1, theta2, theta3, psi - theta2 - theta3], axis=-1), cosine


def _places(
    problem: Problem, points: Floats, approaches: Floats, rows: Floats, columns: Floats
) -> tuple[Ints, Floats]:
    """(S, 2, R, C, 2) the number of each configuration in the grid, and their joints (k, 4)."""
    _, theta1 = shoulders(points[:, None, None], SIGNS[:, None], rows)
    nx, ny, nz = approaches.T[..., None, None]
    out = np.cos(theta1) * nx + np.sin(theta1) * ny
    across = np.cos(theta1) * ny - np.sin(theta1) * nx
    inward = np.cos(columns) * out[..., None] - np.sin(columns) * nz[..., None]
    cosine = np.cos(rows)[:, None] * across[..., None] + np.sin(rows)[:, None] * inward
    place = np.full((*cosine.shape, 2), INVALID)
    i, k, r, c = np.nonzero(cosine >= np.cos(np.radians(problem.cone_deg)))
    low, high = problem.limits[:4].T
    found, count = [], 0
    for elbow, e in enumerate(SIGNS):
        theta, stretch = arm(points[i], SIGNS[k], e, rows[r], columns[c])
        theta -= TAU * np.floor((theta - low) / TAU)
        held = (theta <= high).all(axis=1) & (np.abs(stretch) <= 1.0)
        number = np.where(held, count + np.cumsum(held) - 1, INVALID)
        place[i, k, r, c, elbow] = np.where(stretch > 1.0, STRETCHED, number)
        found.append(theta[held])
        count += int(held.sum())
    return place, np.concatenate(found)


def _components(
    place: Ints, theta: Floats, upper: Floats, turns: Ints, links: Ints
) -> NDArray[np.int32]:
    """The component of every (place, turns)."""
    stretched = np.pad(place[..., 0] == STRETCHED, [(0, 0), (0, 0), (1, 1), (0, 0)])
    inner = stretched[:, :, 1:-1]
    meeting = stretched[:, :, 2:] | stretched[:, :, :-2]
    meeting |= np.roll(inner, -1, axis=3) | np.roll(inner, 1, axis=3)
    pairs = (
        (place, np.roll(place, -1, axis=3), MOST_JUMP),
        (place[:, :, :-1], place[:, :, 1:], MOST_JUMP),
        (place[links[:, 0]], place[links[:, 1]], MOST_JUMP),
        (place[meeting][:, 0], place[meeting][:, 1], MOST_FLIP),
    )
    edges, size = [], len(theta) * len(turns)
    for one, other, most in pairs:
        both = (one >= 0) & (other >= 0)
        one, other = one[both], other[both]
        for w, x in np.ndindex(len(turns), len(turns)):
            a, b = theta[one] + TAU * turns[w], theta[other] + TAU * turns[x]
            near = ((np.abs(a - b) < most) & (a <= upper) & (b <= upper)).all(axis=1)
            edges.append(np.stack([one, other], 1)[near] * len(turns) + [w, x])
    a, b = np.concatenate(edges).T
    return connected_components(coo_array((np.ones(len(a)), (a, b)), (size, size)), False)[1]


def solve(problem: Problem) -> Answer:
    """The oracle's answer, along the lines between centres."""
    upper = problem.limits[:4, 1]
    domain = net(problem, PIECES)
    points, approaches = problem.targets(*domain.uv.T)
    if np.hypot(points[:, 0], points[:, 1]).min() < CLEARANCE:
        raise ValueError(f"the patch comes within {CLEARANCE} m of the first axis")
    step = float(np.radians(np.clip(problem.cone_deg / STEPS, 2.0, 5.0)))
    rows = _rows(problem.limits[4], step)
    columns = np.arange(np.ceil(TAU / step)) * TAU / np.ceil(TAU / step)
    turns = _turns(problem.limits[:4])
    place, theta = _places(problem, points, approaches, rows, columns)
    component = _components(place, theta, upper, turns, domain.links).reshape(-1, len(turns))
    cell, found = [], []
    for number, centre in enumerate(domain.centres):
        there = place[centre][place[centre] >= 0]
        held = (theta[there][:, None] + TAU * turns <= upper).all(axis=-1)
        found.append(np.unique(component[there][held]))
        cell.append(np.full(len(found[-1]), number))
    return answer(problem.cells[0] * problem.cells[1], *map(np.concatenate, (cell, found)))
