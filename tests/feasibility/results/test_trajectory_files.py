"""Trajectories as files: the same numbers back, replayed as they were read, and hostile files."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from dense_replay import assert_motion
from path_cases import SPEED, assert_keeps_to_limits, interpolated, path_of, run_of, verdict_of

from feasibility.certification import replay
from feasibility.paths import coverage_path
from feasibility.reports.path import as_json, as_text
from feasibility.results import save_trajectory
from feasibility.results.trajectory_files import (
    as_csv,
    as_json_text,
    as_yaml,
    from_csv,
    from_json_text,
    load_trajectory,
)
from feasibility.safe_files import FileError
from feasibility.timing import Trajectory, motion_limits
from feasibility.verdict import Walk

ENDINGS = ("csv", "json")
WRITERS = {"csv": as_csv, "json": as_json_text}


def small_run(k=5, n=2, seed=0):
    """A made-up trajectory."""
    rng = np.random.default_rng(seed)
    return Trajectory(
        joint_names=tuple(f'joint {j}, "{"ä" * j}"' for j in range(n)),
        time=np.cumsum(rng.random(k)),
        q=rng.normal(size=(k, n)) * 10.0 ** rng.integers(-12, 3, (k, n)),
        dq=rng.normal(size=(k, n)),
        ddq=rng.normal(size=(k, n)),
        tool_speed=rng.random(k),
        cell=rng.integers(-1, 3, k),
    )


def assert_same(one, other):
    """The same numbers, bit for bit."""
    assert one.joint_names == other.joint_names
    for name in ("time", "q", "dq", "ddq", "tool_speed", "cell"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("seed", range(5))
def test_what_is_written_is_read_back(ending, seed, tmp_path):
    run = small_run(k=1 + seed, n=1 + seed, seed=seed)
    path = save_trajectory(tmp_path / f"run.{ending}", run)
    assert_same(load_trajectory(path), run)


@pytest.mark.parametrize(
    ("name", "ending"),
    [("4c, coarse", "csv"), ("5c, coarse", "json"), ("ur5", "json"), ("panda", "csv")],
)
def test_a_trajectory_read_back_covers_the_surface_within_all_limits(name, ending, tmp_path):
    verdict = verdict_of(name)
    robot = verdict.robot
    run = load_trajectory(save_trajectory(tmp_path / f"{name}.{ending}", run_of(name)))
    assert run.joint_names == robot.joint_names
    every = np.ones(len(verdict.cells), dtype=bool)
    replayed = replay(robot, verdict.cells, verdict.task, Walk(run.q, run.cell), every)
    assert replayed.accepted, replayed.refusal
    assert_motion(verdict, np.clip(interpolated(run, 5, 2)[0], robot.lower, robot.upper))
    limits = motion_limits(robot, SPEED)
    assert_keeps_to_limits(verdict, run, limits)
    # Differences of what is in the file, not its own word for it.
    h = np.diff(run.time)[:, None]
    assert (np.abs(np.diff(run.q, axis=0)) <= h * limits.velocity * (1 + 1e-6)).all()
    assert (np.abs(np.diff(run.dq, axis=0)) <= h * limits.acceleration * (1 + 1e-6) + 1e-9).all()


def test_yaml_is_what_ros_reads():
    yaml = pytest.importorskip("yaml")
    run = small_run(k=4, n=3)
    q = run.q.copy()
    q[1] = [1e-5, -1e16, -0.0]
    run = replace(run, q=q)
    message = yaml.safe_load(as_yaml(run))
    assert set(message) == {"joint_names", "points"}
    assert message["joint_names"] == list(run.joint_names)
    assert len(message["points"]) == 4
    for k, point in enumerate(message["points"]):
        assert set(point) == {"positions", "velocities", "accelerations", "time_from_start"}
        # YAML 1.1 takes 1e-05 for text; every number must come out as one.
        for name, array in (("positions", run.q), ("velocities", run.dq)):
            assert all(isinstance(value, float) for value in point[name])
            assert point[name] == array[k].tolist()
        assert point["accelerations"] == run.ddq[k].tolist()
        start = point["time_from_start"]
        assert set(start) == {"sec", "nanosec"}
        assert 0 <= start["nanosec"] < 10**9
        assert start["sec"] + 1e-9 * start["nanosec"] == pytest.approx(run.time[k], abs=1e-9)


def test_csv_names_its_columns():
    head = as_csv(run_of("ur5")).splitlines()[1].split(",")
    joints = list(verdict_of("ur5").robot.joint_names)
    assert head[:7] == ["time", *joints]
    assert head[7] == f"{joints[0]}_velocity"
    assert head[-2:] == ["tool_speed", "cell"]


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_damaged_file_is_refused_or_whole(ending, tmp_path):
    rng = np.random.default_rng(11)
    text = WRITERS[ending](small_run(k=6))
    for k in range(300):
        damaged = list(text)
        for _ in range(int(rng.integers(1, 4))):
            place = int(rng.integers(len(damaged)))
            if rng.random() < 0.5:
                damaged[place] = chr(int(rng.integers(1, 0x250)))
            else:
                del damaged[place : place + int(rng.integers(1, 40))]
        path = tmp_path / f"{k % 7}.{ending}"
        path.write_text("".join(damaged), encoding="utf-8")
        try:
            run = load_trajectory(path)
        except FileError as error:
            assert str(path.name) in str(error)  # noqa: PT017 - both outcomes are right
            continue
        assert np.isfinite(run.q).all()
        assert (np.diff(run.time) > 0.0).all()


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    "content",
    [b"", b"\x00" * 100, b"\xff\xfe", b"[" * 100_000, b"{}", b"a: &a [*a]", b"time,cell\n1,2\n"],
)
def test_other_files_are_refused(ending, content, tmp_path):
    path = tmp_path / f"other.{ending}"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"other\."):
        load_trajectory(path)


@pytest.mark.parametrize("ending", ["yaml", "yml"])
def test_yaml_is_written_only(ending, tmp_path):
    path = save_trajectory(tmp_path / f"run.{ending}", small_run())
    assert path.read_text(encoding="utf-8") == as_yaml(small_run())
    with pytest.raises(FileError, match=r"written only; load the trajectory from CSV or JSON"):
        load_trajectory(path)


def test_numbers_that_are_none_are_refused(tmp_path):
    run = small_run()
    record = json.loads(as_json_text(run))
    cases = {
        "positions": [["1.0"] * 2] * 5, "velocities": [[1.0]] * 5,
        "accelerations": [[True] * 2] * 5, "time": [10**400, 1, 2, 3, 4],
        "tool_speed": [None] * 5, "cell": [-1] * 5,
        "joint_names": [1, 2],
    }  # fmt: skip
    for key, value in cases.items():
        with pytest.raises(ValueError, match=key):
            from_json_text(json.dumps(record | {key: value}))
    for text in ("NaN", "Infinity", "-Infinity", "1e999"):
        damaged = as_json_text(run).replace(repr(float(run.q[2, 1])), text, 1)
        with pytest.raises(ValueError, match="q must hold finite numbers"):
            from_json_text(damaged)
        rows = as_csv(run).replace(repr(float(run.q[2, 1])), text, 1)
        with pytest.raises(ValueError, match="q must hold finite numbers"):
            from_csv(rows)
    with pytest.raises(ValueError, match=r"(?s)cell is missing.*x is not known here"):
        from_json_text(json.dumps({k: v for k, v in record.items() if k != "cell"} | {"x": 1}))
    rows = as_csv(small_run()).splitlines()
    rows[2] = "x" + rows[2]
    rows[4] += ",1"
    with pytest.raises(
        ValueError, match=r"(?s)line 3: expected numbers.*line 5: expected 9 columns"
    ):
        from_csv("\n".join(rows))


def test_times_that_do_not_rise_are_refused():
    run = small_run()
    rows = as_csv(run).splitlines()
    with pytest.raises(ValueError, match="times must rise"):
        from_csv("\n".join([*rows[:2], rows[3], rows[2]]))


def test_names_without_a_known_ending(tmp_path):
    for name in ("run.txt", "run", "run.toml"):
        with pytest.raises(FileError, match=r"ends in .csv, .json or .yaml"):
            load_trajectory(tmp_path / name)
        with pytest.raises(FileError, match=r"ends in .csv, .json or .yaml"):
            save_trajectory(tmp_path / name, small_run())
    with pytest.raises(FileError, match="no such file"):
        load_trajectory(tmp_path / "none.csv")


def test_a_file_too_large_is_refused(tmp_path, monkeypatch):
    path = save_trajectory(tmp_path / "run.csv", small_run())
    monkeypatch.setattr("feasibility.results.trajectory_files.CAP", 100)
    with pytest.raises(FileError, match="larger than 100 bytes"):
        load_trajectory(path)


# -- the report ---------------------------------------------------------------------------------


def test_the_report_says_what_the_path_holds():
    path, run = path_of("5c, coarse"), run_of("5c, coarse")
    limits = motion_limits(path.robot, SPEED)
    record = as_json(path, run, limits)
    assert record == json.loads(json.dumps(record, allow_nan=False))
    figures = path.figures
    assert record["covered_m"] + record["revisited_m"] == pytest.approx(record["length_m"])
    assert record["visits"] == path.visits.tolist()
    travel = [joint["travel_deg"] for joint in record["joint_travel"].values()]
    assert np.radians(travel) == pytest.approx(figures.travel)
    assert record["trajectory"]["duration_s"] == run.duration
    assert record["trajectory"]["limits"]["tool_speed"] == SPEED
    assert as_json(path)["trajectory"] is None
    text = as_text(path, run, limits)
    assert text.startswith("path: one continuous motion over 16 cells.")
    assert f"{figures.length:.4g} m on the surface" in text
    assert f"{run.duration:.4g} s" in text
    assert max(map(len, text.splitlines())) <= 100
    assert "time" not in as_text(path)


def test_the_report_of_a_single_cell():
    path = coverage_path(verdict_of("ur5"), only=[0])
    assert as_json(path)["length_ratio"] is None
    assert "over 1 cell." in as_text(path)
