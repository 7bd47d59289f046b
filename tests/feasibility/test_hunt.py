"""Verdicts and certificates that a hunt over random cases found to be wrong."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from feasibility import Search, Task, check
from feasibility.certificate import replay
from robots import Robot, load_robot
from robots.kinematics import Kinematics
from surfaces import plane, sphere
from surfaces.grid import GridCells

CENTRE = np.array([0.5, 0.1, 0.4])
RADIUS, STANDOFF, TOLERANCE = 0.02, 0.002, 5e-3


def ball_cell() -> GridCells:
    """One cell about the -x side of a small ball: a cell that has no neighbours."""
    ball = sphere(RADIUS, (60, 120), (150, 210), side="outside", position=tuple(CENTRE))
    return ball.cells(1, 1)


def tilt_at_foot(robot: Robot, q: NDArray[np.float64]) -> float:
    """Angle (rad) between the tool axis and the inward normal of the ball at the tool's foot."""
    point, axis = Kinematics(robot).tool(q)
    normal = (point - CENTRE) / np.linalg.norm(point - CENTRE)
    return float(2.0 * np.arcsin(0.5 * np.linalg.norm(axis + normal)))


@pytest.mark.parametrize("seed", range(3))
def test_certificate_of_a_single_cell_bounds_the_tilt_at_the_tool_points_own_foot(
    seed: int,
) -> None:
    """Beside the centre of the only cell the normal turns like anywhere else."""
    robot = load_robot("ur5")
    # Beside the centre by 4 mm, but along the normal of the centre.
    beside = plane(
        (-0.01, 0.01),
        (-0.01, 0.01),
        side="outside",
        position=(CENTRE[0] - RADIUS, CENTRE[1] + 0.004, CENTRE[2]),
        rpy_deg=(0, -90, 0),
    )
    found = check(robot, beside.cells(1, 1), Task(STANDOFF, 1.0), Search(seed=seed))
    assert found.witness is not None
    task = Task(STANDOFF, 5.0, TOLERANCE)
    replayed = replay(robot, ball_cell(), task, found.witness, np.ones(1, dtype=bool))

    assert tilt_at_foot(robot, found.witness.q[0]) > np.radians(9.0)
    assert not replayed.accepted
    assert "tilts" in replayed.refusal


@pytest.mark.parametrize("seed", range(3))
def test_a_single_cell_is_covered_inside_the_cone_at_the_tool_points_own_foot(seed: int) -> None:
    """What the replay asks for, the search keeps to."""
    robot = load_robot("ur5")
    task = Task(STANDOFF, 0.5, TOLERANCE)
    verdict = check(robot, ball_cell(), task, Search(seed=seed))

    assert verdict.feasible
    assert verdict.witness is not None
    assert verdict.certificate is not None
    tilt = tilt_at_foot(robot, verdict.witness.q[0])
    assert tilt <= verdict.certificate.max_angle + 1e-12
    assert verdict.certificate.max_angle <= task.cone
