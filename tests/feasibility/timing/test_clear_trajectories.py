"""Curves and timed motions among bodies: judged between samples, the pair and the time named."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from path_cases import interpolated

from feasibility import Task, check
from feasibility.certification import collision_replay
from feasibility.collisions import Bodies, Collision, Obstacle, gather
from feasibility.paths import CoveragePath, PathError, coverage_path
from feasibility.reports.path import as_json, as_text
from feasibility.results.trajectory_files import as_csv
from feasibility.timing import Trajectory, trajectory
from feasibility.timing.between_samples import deviations, deviations_between
from feasibility.timing.path_timing import _refusal
from feasibility.timing.sampled_trajectory import motion_between
from feasibility.timing.smoothing import blended, sampled
from robots import Kinematics, load_robot
from surfaces import plane

BESIDE = Obstacle.box("post", (0.1, 0.1, 0.6), position=(0.75, 0.0, 0.3))
PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
AMONG = Task(0.02, cone_deg=30, collision=Collision(clearance=0.005, scene=(BESIDE,)))


@cache
def path() -> CoveragePath:
    """The UR5 over a plate with a post behind it."""
    return coverage_path(check(load_robot("ur5"), PLATE.cells(2, 3), AMONG))


@cache
def run() -> Trajectory:
    return trajectory(path(), 0.1)


def bodies_of(task: Task) -> Bodies:
    found = gather(path().robot, PLATE, task.collision, task.standoff)
    assert found is not None
    return found


def off_lines(rows: np.ndarray, dense: np.ndarray) -> np.ndarray:
    """(m - 1, k, n) how far dense places are from the line between two rows, as a set."""
    found = []
    for (a, b), places in zip(pairwise(rows), dense, strict=True):
        way = b - a
        share = np.clip((places - a) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        found.append(np.abs(places - a - share[:, None] * way))
    return np.array(found)


@pytest.mark.parametrize("seed", range(5))
def test_deviations_bound_how_far_parabolas_and_cubics_are_from_their_chords(seed: int) -> None:
    """Random cubics, some of them almost straight: the bound holds, and is not idle."""
    rng = np.random.default_rng(seed)
    count, n = 40, 3
    a, way, bends = rng.normal(size=(count, n)), rng.normal(size=(count, n)), []
    for wide in np.geomspace(1e-4, 3.0, count):
        bends.append(wide * rng.normal(size=(2, n)))
    ends = np.array(bends)  # q'' runs straight from one to the other
    ends[::3] = way[::3, None] * rng.uniform(-1.0, 1.0, (len(ends[::3]), 2, 1))
    t = np.linspace(0.0, 1.0, 101)[None, :, None]
    first, last = ends[:, :1], ends[:, 1:]
    curve = first * t**2 / 2 + (last - first) * t**3 / 6
    curve = a[:, None] + way[:, None] * t + curve - t * curve[:, -1:]
    most, way_on = [], []
    for k in range(count):
        rows = curve[k, [0, -1]]
        most.append(off_lines(rows, curve[k][None])[0].max(axis=0))
        way_on.append(deviations(rows, ends[k][:, None])[0])
    assert (np.array(most) <= np.array(way_on) + 1e-12).all()
    assert max((m / w).max() for m, w in zip(most, way_on, strict=True)) > 0.5
    straight = np.array(way_on)[::3]
    assert straight.max() < 1e-9


@pytest.mark.parametrize(("kind", "degree"), [("quintic", 5), ("cubic", 3)])
def test_what_a_controller_makes_of_samples_stays_within_the_deviations(
    kind: str, degree: int
) -> None:
    places, finer = 4, 6
    walk = motion_between(run(), kind, places)  # type: ignore[arg-type]
    bounds = deviations_between(run(), kind, walk.q)  # type: ignore[arg-type]
    q, _, _ = interpolated(run(), degree, places * finer)
    np.testing.assert_allclose(q[::finer], walk.q, atol=1e-9)
    dense = np.stack([q[k : len(q) - finer + k : finer] for k in range(finer + 1)], axis=1)
    assert (off_lines(walk.q, dense) <= bounds[:, None] + 1e-9).all()
    assert bounds.max() < 1e-3


def test_a_run_past_a_post_keeps_its_clearance_everywhere() -> None:
    """Single configurations of the quintics, densely: none is nearer than it may be."""
    assert run().collisions == ("self", "surface", "scene")
    q, _, _ = interpolated(run(), 5, 3)
    bodies = bodies_of(AMONG)
    for row in q[::7]:
        assert collision_replay(path().robot, bodies, row[None]).accepted
    assert _refusal(path(), run()) == ""


def test_a_turn_that_would_collide_is_made_sharper_or_refused() -> None:
    """The clearance that the path itself just keeps: rounding its corners may not take of it."""
    certificate = path().certificate
    assert certificate.min_clearance is not None
    first, second = certificate.nearest_pair or ("", "")
    tight = replace(
        AMONG,
        collision=Collision(
            clearance=0.005,
            scene=(BESIDE,),
            clearances=((first, second, certificate.min_clearance - 1e-5),),
        ),
    )
    robot, cells = path().robot, path().cells
    assert collision_replay(robot, bodies_of(tight), path().walk.q).accepted
    curve = blended(robot, cells, tight, path().walk)
    rows = sampled(robot, curve, 0, len(curve.marks) - 1).q
    assert collision_replay(robot, bodies_of(tight), rows).accepted


def test_a_curve_through_an_object_is_refused_with_the_pair() -> None:
    ahead = Obstacle.box("bracket", (0.05, 0.05, 0.3), position=(0.5, 0.0, 0.5))
    task = replace(AMONG, collision=Collision(scene=(ahead,)))
    with pytest.raises(PathError, match=r"from cell \[\d, \d\] on \(.* and bracket overlap by"):
        trajectory(replace(path(), task=task), 0.1)


def test_a_timed_motion_that_collides_names_pair_depth_and_time() -> None:
    """A ball where the tool's flange is halfway: the deepest instant lies where it is said."""
    robot, bodies = path().robot, bodies_of(AMONG)
    half = len(run()) // 2
    link = next(solid for solid in bodies.solids if solid.owner == "wrist_3_link")

    frames = Kinematics(robot).joints(run().q[half : half + 1])
    middle = frames.rotations[0, link.joint] @ link.placement[:3, 3] + frames.points[0, link.joint]
    ball = Obstacle.sphere("ball", 0.01, position=tuple(middle))
    task = replace(AMONG, collision=Collision(self_=False, surface=False, scene=(ball,)))
    blocked = replace(path(), task=task)
    said = _refusal(blocked, run())
    match = re.fullmatch(r"(\w+) and ball overlap.*, at (\d+\.\d+) s", said)
    assert match is not None
    at = float(match[2])
    q = np.array([np.interp(at, run().time, column) for column in run().q.T])
    then = collision_replay(robot, bodies_of(task), q[None])
    assert not then.accepted
    assert match[1] in {name for fault in then.faults for name in fault.pair}


def test_the_reports_say_how_near_bodies_come() -> None:
    found = as_json(path(), run())
    certificate = path().certificate
    assert found["certificate"]["min_clearance_m"] == certificate.min_clearance
    assert found["certificate"]["nearest_pair"] == list(certificate.nearest_pair or ())
    assert found["collisions"] == ["self", "surface", "scene"]
    assert "bodies at least" in as_text(path(), run())
    head = as_csv(run()).splitlines()[0]
    assert head == "# collisions are checked with the arm itself, the surface and the scene"
