"""Surfaces that links carry: the same answers as the same question asked in another way."""

import numpy as np
import pinocchio as pin
import pytest
from held_parts import held_case
from samples import sampled, seeds

from feasibility import Task, check, verify
from feasibility.collisions import Collision, Obstacle
from robots import Axis, load_robot
from surfaces import plane

TASK = Task(standoff=0.01, cone_deg=25)
TABLE = Axis(
    "table", "revolute", limits_deg=(-180, 180), carries="surface", position=(0.6, 0.1, 0.1)
)


@pytest.mark.parametrize("collision", [None, "scene"])
def test_moving_everything_by_one_rigid_motion_changes_nothing(collision):
    motion = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.7, 1.9), np.array([0.5, -1.0, 0.3]))
    part = plane((0.45, 0.75), (-0.2, 0.2), position=(0, 0, 0.2))
    plate, moved = (p.cells(4, 5) for p in (part, part.moved(motion.rotation, motion.translation)))
    post = Obstacle.box("post", (0.1, 0.1, 0.4), position=(0.55, 0.35, 0.2))
    there = Obstacle("post", post.geometry, motion.homogeneous @ post.placement)
    here, other = (
        Collision(scene=(one,), clearance=0.005) if collision else None for one in (post, there)
    )
    one = check(load_robot("ur5"), plate, Task(0.01, 25, collision=here))
    two = check(load_robot("ur5", base=motion), moved, Task(0.01, 25, collision=other))
    assert one.answer == two.answer
    assert one.covered.tolist() == two.covered.tolist()
    assert abs(one.statistics["fk"] - two.statistics["fk"]) <= 0.02 * one.statistics["fk"]


def test_a_locked_table_is_a_turned_part_and_a_free_one_covers_no_less():
    wide = plane((-0.6, 0.6), (-0.5, 0.5)).cells(4, 4)
    free = check(load_robot("ur5", axes=[TABLE]), wide, TASK)
    for angle in (0.0, 40.0):
        locked = load_robot("ur5", axes=[TABLE], lock={"table": np.radians(angle)})
        limited = load_robot("ur5", axes=[TABLE], limits={"table": [np.radians(angle)] * 2})
        turned = plane((-0.6, 0.6), (-0.5, 0.5), position=TABLE.position, rpy_deg=(0, 0, angle))
        part = check(load_robot("ur5"), turned.cells(4, 4), TASK)
        for robot in (locked, limited):
            verdict = check(robot, wide, TASK)
            assert verdict.answer == part.answer
            assert verdict.covered.tolist() == part.covered.tolist()
        assert part.covered.sum() < free.covered.sum()
    assert free.feasible


@sampled
@pytest.mark.parametrize("seed", seeds(3, all=50))
def test_a_held_part_is_the_mirrored_problem(seed, tmp_path):
    holding, mirrored, cells, task = held_case(seed, tmp_path)
    one, two = check(holding, cells, task), check(mirrored, cells, task)
    assert (one.answer, one.evidence) == (two.answer, two.evidence)
    assert one.covered.tolist() == two.covered.tolist()
    counts = [verdict.statistics["fk"] for verdict in (one, two)]
    assert max(counts) <= 1.01 * min(counts)


def test_an_arm_on_a_rail_with_a_turntable_has_a_witness_that_holds():
    rail = Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5), max_velocity=0.5)
    robot = load_robot("ur5", axes=[rail, TABLE])
    verdict = check(robot, plane((-0.6, 0.6), (-0.5, 0.5)).cells(5, 5), TASK)
    assert verdict.feasible
    assert verify(robot, verdict.cells, TASK, verdict.witness.q).holds
    assert np.ptp(verdict.witness.q[:, 0]) > 0.0


def test_two_more_axes_cost_at_most_three_times_as_much():
    """Evaluations of the arm, over a plate that it covers by itself."""
    where = (0.55, 0.0, 0.1)
    rail = Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5))
    table = Axis("table", "revolute", limits_deg=(-180, 180), position=where, carries="surface")
    plate = (-0.15, 0.15), (-0.25, 0.25)
    alone = check(load_robot("ur5"), plane(*plate, position=where).cells(9, 10), TASK)
    both = check(load_robot("ur5", axes=[rail, table]), plane(*plate).cells(9, 10), TASK)
    assert alone.feasible
    assert both.feasible
    assert both.statistics["fk"] <= 3 * alone.statistics["fk"]
