"""What bounds say of the tool between samples, against Pinocchio at many places in between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import run_of, verdict_of

from feasibility.timing.between_samples import NEAR, motion_near
from feasibility.timing.sampled_trajectory import (
    KINDS,
    accelerations,
    coefficients,
    derivative,
    values,
)
from feasibility.timing.speed_limits import tool_slopes
from feasibility.timing.tool_between_samples import fastest_tool
from robots import Kinematics

MANY = 16  # places between two samples


def jumpy():
    """A few samples of a trajectory whose accelerations were changed: joints swing in between."""
    run, rng = run_of("ur5"), np.random.default_rng(3)
    rows = slice(100, 160)
    ddq = run.ddq[rows] + rng.normal(size=(60, run.q.shape[1]))
    arrays = {name: getattr(run, name)[rows] for name in ("time", "q", "dq", "tool_speed", "cell")}
    return replace(run, ddq=ddq, **arrays)


@pytest.mark.parametrize("kind", KINDS)
def test_accelerations_are_second_derivatives(kind):
    run = jumpy()
    expected = derivative(run, derivative(run, coefficients(run, kind)))
    np.testing.assert_allclose(accelerations(run, kind), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("make", [jumpy, lambda: run_of("ur5")], ids=["jumpy", "smooth"])
def test_the_tool_is_nowhere_faster_than_said(make):
    robot, run = verdict_of("ur5").robot, make()
    dense = 0.0
    for kind in KINDS:
        points = coefficients(run, kind)
        slopes = derivative(run, points)
        speeds = tool_slopes(robot, values(points, MANY), values(slopes, MANY))
        dense = max(dense, float(speeds.max()))
    looked_at = fastest_tool(robot, run, 0.0)
    assert dense * (1.0 - 1e-9) <= looked_at <= 1.02 * dense
    # What is not looked at is slower than what is enough.
    assert dense <= max(fastest_tool(robot, run, 1.001 * dense), 1.001 * dense)
    assert fastest_tool(robot, run, 0.5 * dense) == pytest.approx(looked_at, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [jumpy, lambda: run_of("ur5")], ids=["jumpy", "smooth"])
def test_the_motion_is_near_its_lines(make, kind):
    robot, run = verdict_of("ur5").robot, make()
    near = motion_near(robot, run, kind)
    assert max(near.point, near.turn) <= NEAR
    assert (near.walk.cell[near.walk.cell >= 0] == run.cell[run.cell >= 0]).all()
    points, kinematics = coefficients(run, kind), Kinematics(robot)
    counts = np.diff(np.flatnonzero(_is_sample(near.walk.q, run.q)))
    assert len(counts) == len(run) - 1
    assert make is not jumpy or counts.max() > 1
    first = np.concatenate([[0], np.cumsum(counts)])
    for k in np.argsort(-counts)[:6].tolist() + list(range(0, len(counts), len(counts) // 6)):
        lines = near.walk.q[first[k] : first[k + 1] + 1]
        bent = values(points[:, k : k + 1], MANY * counts[k])
        share = np.linspace(0.0, 1.0, MANY * counts[k] + 1) * counts[k]
        straight = np.stack([np.interp(share, range(len(lines)), joint) for joint in lines.T], 1)
        tips, line = (kinematics.tools(q)[0] for q in (bent, straight))
        assert _away(tips, line) <= near.point + 1e-9  # chords for the tool's way along a line


def _away(points, line):
    """The largest distance of points (k, 3) from the nearest piece of a polygon (m, 3)."""
    begin, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begin) * way).sum(axis=2) / length, 0.0, 1.0)
    return np.linalg.norm(begin + share[..., None] * way - points[:, None], axis=2).min(1).max()


def _is_sample(all_rows, some):
    """Which rows are the next of `some`, in their order."""
    count, found = 0, []
    for row in all_rows:
        found.append(count < len(some) and np.array_equal(row, some[count]))
        count += found[-1]
    return np.array(found)
