"""The roll in both judges: what dense samples show is accepted, and refused outside the range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rasters import raster

from feasibility import Task
from feasibility.certification import replay, replay_over_surface
from feasibility.certification.rolls import (
    largest_off,
    off_middle,
    products_of_changes,
    reference_axes,
    roll_vectors,
    tool_frames,
)
from feasibility.roll import Roll, projected, roll_of
from feasibility.targets import u_directions
from feasibility.verdict import Walk
from robots import Kinematics, load_robot

REFERENCES = {
    "plane": None,
    "ball": (0.2, 1.0, 0.0),
    "pipe": None,
    "ring": None,
    "spline": None,
    "mesh": (1.0, 0.3, 0.1),
    "sheets": (1.0, 0.0, 0.0),
}
BESIDE = 0.5  # deg


def rolls(robot, cells, q, reference):
    """(k,) rad, over the closest points of the surface."""
    points, axes = Kinematics(robot).tools(q)
    found = cells.surface.closest(points)
    b = -cells.surface.side_sign * found.normal
    feet = points - found.height[:, None] * found.normal
    e = u_directions(cells.surface, feet)
    if reference is not None:
        unit = np.array(reference) / np.linalg.norm(reference)
        e = np.tile(cells.surface.rotation @ unit, (len(b), 1))
    return roll_of(reference_axes(robot, q), axes, projected(e, b)[0], b)


def limited(name, low=-BESIDE, high=BESIDE):
    """A raster, with a task whose range is that of dense samples and a little more or less."""
    made, reference = raster(name), REFERENCES[name]
    between = 0.5 * (made.q[1:] + made.q[:-1])
    found = np.unwrap(rolls(made.robot, made.cells, made.q, reference))
    middle = rolls(made.robot, made.cells, between, reference)
    aside = (middle - found[:-1] + np.pi) % (2 * np.pi) - np.pi
    seen = np.degrees(np.concatenate([found, found[:-1] + aside]))
    turn = 360.0 * np.round(seen.mean() / 360.0)
    most = seen.min() - turn + low, seen.max() - turn + high
    return made._replace(task=replace(made.task, roll_deg=most, roll_reference=reference))


@pytest.mark.parametrize("name", REFERENCES)
def test_motions_within_the_range_are_accepted(name):
    made = limited(name)
    found = replay_over_surface(*made)
    assert found.accepted, found.refusal
    off = made.task.roll.off(rolls(made.robot, made.cells, made.q, REFERENCES[name]))
    assert np.abs(off).max() - 1e-6 <= found.certificate.max_roll <= made.task.roll.half + 1e-9


@pytest.mark.parametrize("name", REFERENCES)
def test_motions_beyond_one_end_of_the_range_are_refused_there(name):
    for ends in ((-BESIDE, -BESIDE), (BESIDE, BESIDE)):
        made = limited(name, *ends)
        found = replay_over_surface(*made)
        assert not found.accepted
        (fault,) = (fault for fault in found.faults if "the roll is" in str(fault))
        off = np.abs(made.task.roll.off(rolls(made.robot, made.cells, made.q, REFERENCES[name])))
        assert off[fault.row] == pytest.approx(off.max(), abs=1e-6)
        assert 0.49 < float(fault.text.split()[3]) < 0.51


@pytest.mark.parametrize("name", ["plane", "pipe", "mesh"])
def test_a_turn_of_the_tool_between_two_rows_is_seen(name):
    """Every row is right; only between them the roll is not."""
    made, k = limited(name), 40
    robot = replace(made.robot, lower=made.robot.lower - 7, upper=made.robot.upper + 7)
    for turn in (2 * np.pi, -2 * np.pi):
        q = made.q.copy()
        q[k:, 5] += turn
        found = replay_over_surface(robot, made.cells, made.task, q)
        assert [fault.row for fault in found.faults] == [k - 1]
        assert "the roll is" in found.refusal


@pytest.mark.parametrize("long_way", [False, True])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_long_way_round_is_refused(sign, long_way):
    """Over one cell, from one end of the range to the other."""
    made = raster("plane")
    robot = replace(made.robot, lower=made.robot.lower - 7, upper=made.robot.upper + 7)
    roll = np.degrees(rolls(robot, made.cells, made.q[:1], None)[0])
    task = replace(made.task, roll_deg=(roll - 20.0, roll + 20.0))
    rows = np.repeat(made.q[:1], 2, axis=0)
    over = 38.0 - 360.0 if long_way else 38.0
    rows[:, 5] += sign * np.radians([-19.0, -19.0 + over])
    points, _ = Kinematics(robot).tools(rows)
    cell = int(np.argmin(np.linalg.norm(made.cells.centres - points[0], axis=1)))
    none = np.zeros(len(made.cells), dtype=bool)
    walk = Walk(rows, np.array([cell, cell]))
    for found in (
        replay(robot, made.cells, task, walk, none),
        replay_over_surface(robot, made.cells, task, rows, none),
    ):
        assert found.accepted is not long_way
        if found.accepted:
            assert np.radians(19.0) - 1e-6 <= found.certificate.max_roll <= task.roll.half


@pytest.mark.parametrize("arm", ["puma560", "ur5", "panda"])
def test_bounds_hold_between_configurations(arm):
    """Of random segments beside a fixed frame, and beside one that turns with them."""
    robot, rng = load_robot(arm), np.random.default_rng(8)
    roll, s = Roll(0.7, np.radians(80)), np.linspace(0.0, 1.0, 41)
    certified = 0
    for _ in range(150):
        size = 10 ** rng.uniform(-2.0, -0.3)
        low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
        start = rng.uniform(low, high)
        q = start + s[:, None] * size * rng.uniform(-1.0, 1.0, robot.n)
        _, axes = Kinematics(robot).tools(q)
        x = reference_axes(robot, q)
        tilt = rng.normal(size=3) * 0.3
        b = axes[0] + tilt + s[:, None] * size * rng.uniform(-0.5, 0.5, 3)
        length = np.linalg.norm(b, axis=1, keepdims=True)
        b /= length
        t, _ = projected(
            np.tile(x[0], (len(s), 1)) @ turn_about(axes[0], -0.7 + rng.uniform(-1, 1)), b
        )
        z = roll_vectors(x, axes, t, b, roll)
        ends = [np.diff(v[[0, -1]], axis=0) for v in (x, np.cross(axes, x), t, np.cross(b, t))]
        frames = tool_frames(robot, q[[0, -1]], axes[[0, -1]], x[[0, -1]])
        bend = frames.second_derivatives(robot, np.abs(q[-1] - q[0])[None])
        # Second derivatives of the frame's own vectors, from dense differences.
        for vector in (t, np.cross(b, t)):
            second = np.linalg.norm(np.diff(vector, 2, axis=0), axis=1).max() * (len(s) - 1) ** 2
            bend = bend + np.sqrt(2.0) * 1.05 * second
        bend = bend + products_of_changes(*ends)
        bound = largest_off(z[:1], z[-1:], bend, np.zeros((1, 2)), roll.half)
        certified += np.isfinite(bound[0])
        assert off_middle(z).max() <= bound[0] + 1e-9
    assert certified > 50


def turn_about(axis, angle):
    """(3, 3) transposed rotation by an angle about a unit axis."""
    cross = np.cross(np.eye(3), axis)
    return (np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross).T


def test_wide_ranges_are_certified_from_end_to_end():
    """A slow turn from one end of a range of 300 degrees to the other, in parts."""
    roll = Roll(0.0, np.radians(150))
    angle = np.radians(np.linspace(-149, 149, 60))
    z = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    bend = 2.0 * np.diff(angle) ** 2
    bound = largest_off(z[:-1], z[1:], bend, np.zeros((59, 2)), roll.half)
    assert (bound >= np.maximum(np.abs(angle[1:]), np.abs(angle[:-1])) - 1e-9).all()
    assert np.isfinite(bound).all()
    across = 2.0 * np.array([[-1.0, 0.1], [-1.0, -0.1]])
    assert not np.isfinite(largest_off(across[:1], across[1:], bend[:1], np.zeros((1, 2)), 3.0))


def test_without_limits_nothing_is_said_of_the_roll():
    made = raster("plane")
    assert replay_over_surface(*made).certificate.max_roll is None
    free = made._replace(task=replace(made.task, roll_deg=(-180, 180)))
    assert replay_over_surface(*free).accepted
    held = Task(0.01, 20, tolerance=1e-3, approach=(0, 0, -1))
    assert replay_over_surface(made.robot, made.cells, held, made.q).accepted
    held = replace(held, approach=(0, 1, -1))
    assert "tool axis tilts 45" in replay_over_surface(made.robot, made.cells, held, made.q).refusal
