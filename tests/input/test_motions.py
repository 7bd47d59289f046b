"""Motions and trajectories as files: columns by name, the same numbers back, YAML for ROS."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from bad_input import SLIDER
from readers import sound_trajectory

from coverable import Robot, Trajectory, load_motion, load_robot, load_trajectory, save_trajectory
from coverable.errors import ArgumentError
from feasibility.read_files import FileError

ROWS = np.array([[0.1, -1.2, 1.3, -0.4, -1.5, 0.6], [0.2, -1.1, 1.2, -0.3, -1.4, 0.7]])
PUMA = load_robot("puma560")
NAMES = PUMA.joint_names


def text_of(names=NAMES, rows=ROWS, separator: str = ",") -> str:
    lines = [separator.join(names), *(separator.join(map(repr, row)) for row in rows.tolist())]
    return "\n".join(lines) + "\n"


@pytest.fixture
def read(tmp_path: Path):
    def reading(text: str, robot: Robot = PUMA):
        (tmp_path / "motion.csv").write_bytes(text.encode())
        return load_motion(tmp_path / "motion.csv", robot)

    return reading


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_go_by_name(separator: str, read) -> None:
    """In any order, in degrees where their name says so, and with the small things files have."""
    order = [3, 0, 5, 1, 4, 2]
    names = [f"{NAMES[k]}_deg" if k in (1, 4) else NAMES[k] for k in order]
    rows = np.where(np.isin(order, (1, 4)), np.degrees(ROWS[:, order]), ROWS[:, order])
    found = read("\ufeff" + text_of(names, rows, separator).replace("\n", " \r\n") + "\n\n")
    np.testing.assert_allclose(found.q, ROWS, atol=1e-15)
    assert found.notes == ()


def test_columns_beside_the_joints(read, tmp_path: Path) -> None:
    extra = np.column_stack([np.arange(2.0), ROWS, np.zeros(2), [4, 5], [1, 0]])
    head = ["time", *NAMES, f"{NAMES[0]}_velocity", "cell", "working"]
    text = text_of(head, extra).replace("4.0,1.0", "4,1").replace("5.0,0.0", ",0")
    found = read(text)
    assert np.array_equal(found.q, ROWS)
    assert found.notes == (f"not used: time, {NAMES[0]}_velocity",)
    assert found.marks.tolist() == [4, -1]
    assert found.working.tolist() == [True, False]
    odd = read(text.replace("4,1\n", "4.5,1\n"))
    assert odd.marks is None
    assert odd.notes == (f"not used: time, {NAMES[0]}_velocity, cell",)
    rows = np.vstack([ROWS, ROWS[-1:]])
    rows[2, 5] -= 2 * np.pi
    assert read(text_of(rows=rows)).notes == (
        "joint6 moves by more than half a turn from row 2 to 3; values must be unwrapped",
    )
    run = replace(small_run(k=2, n=6), joint_names=NAMES[::-1], q=ROWS[:, ::-1])
    found = load_motion(save_trajectory(tmp_path / "run.csv", run), PUMA)
    assert np.array_equal(found.q, ROWS)
    assert found.marks.tolist() == run.cell.tolist()
    with pytest.raises(FileError, match="JSON is written only; give the motion as CSV"):
        load_motion(save_trajectory(tmp_path / "run.json", run), PUMA)


def test_millimetres_on_a_rail(tmp_path: Path, read) -> None:
    (tmp_path / "slider.urdf").write_text(SLIDER)
    robot = load_robot(str(tmp_path / "slider.urdf"))
    rows = np.array([[0.5, 3.0], [0.6, 4.0]])
    assert np.array_equal(read(text_of(robot.joint_names, rows), robot).q, rows)
    rows[:, 0] *= 1e3
    with pytest.raises(FileError, match="holds millimetres, it seems: slide is 600 where"):
        read(text_of(robot.joint_names, rows), robot)


def small_run(k: int, n: int, seed: int = 0) -> Trajectory:
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


NO_TRAJECTORIES = {
    "joint_names": (("a", "a"), "there must be at least one joint, and no name twice"),
    "q": (np.zeros((2, 3)), r"q must have shape \(4, 2\), got \(2, 3\)"),
    "ddq": (np.full((4, 2), np.nan), "ddq must hold finite numbers"),
    "cell": (np.full(4, -2), "cells must be flat indices, or -1 in between"),
}


@pytest.mark.parametrize("name", NO_TRAJECTORIES)
def test_what_is_no_trajectory_says_why(name: str) -> None:
    value, fault = NO_TRAJECTORIES[name]
    with pytest.raises(ArgumentError, match=fault):
        replace(small_run(4, 2), **{name: value})


@pytest.mark.parametrize("seed", range(5))
def test_what_is_written_is_read_back(seed: int, tmp_path: Path) -> None:
    run = small_run(k=1 + seed, n=1 + seed, seed=seed)
    sound_trajectory(run, tmp_path)
    at_work = replace(run, working=np.arange(1 + seed) % 2 == 0, collisions=("self",))
    again = load_trajectory(save_trajectory(tmp_path / "run.csv", at_work))
    assert again.working.tolist() == at_work.working.tolist()
    told = json.loads(save_trajectory(tmp_path / "run.json", at_work).read_text("utf-8"))
    assert (told["working"], told["collisions"]) == (at_work.working.tolist(), ["self"])
    assert np.array_equal(told["positions"], run.q)
    with pytest.raises(FileError, match="are written only; load the trajectory from CSV"):
        load_trajectory(tmp_path / "run.json")
    robot = SimpleNamespace(joint_names=run.joint_names, prismatic=np.arange(1 + seed) == 0)
    told = json.loads(save_trajectory(tmp_path / "a.compas", run, robot).read_text("utf-8"))
    assert told["dtype"] == "compas_fab.robots/JointTrajectory"
    for k, point in enumerate(told["data"]["points"]):
        seconds, rest = point["time_from_start"].values()
        assert seconds + 1e-9 * rest == pytest.approx(run.time[k], abs=1e-9)
        assert point["joint_types"] == [2] + [0] * seed
        assert point["joint_values"] == run.q[k].tolist()
        assert point["velocities"] == run.dq[k].tolist()
    with pytest.raises(FileError, match="needs the arm"):
        save_trajectory(tmp_path / "a.compas", run)
    for name in ("run.txt", "run"):
        with pytest.raises(FileError, match=r"ends in \.csv, \.json, \.yaml or \.compas"):
            save_trajectory(tmp_path / name, run)


def test_yaml_is_what_ros_reads(tmp_path: Path) -> None:
    yaml = pytest.importorskip("yaml")
    run = small_run(k=4, n=3)
    q = run.q.copy()
    q[1] = [1e-5, -1e16, -0.0]  # YAML 1.1 takes 1e-05 for text
    run = replace(run, q=q)
    message = yaml.safe_load(save_trajectory(tmp_path / "run.yml", run).read_text("utf-8"))
    assert message.pop("joint_names") == list(run.joint_names)
    arrays = {"positions": run.q, "velocities": run.dq, "accelerations": run.ddq}
    starts = [point.pop("time_from_start") for point in message["points"]]
    rows = [{name: array[k].tolist() for name, array in arrays.items()} for k in range(4)]
    assert message == {"points": rows}
    whole = [start["sec"] * 10**9 + start["nanosec"] for start in starts]
    assert whole == [round(time * 1e9) for time in run.time.tolist()]
    assert all(0 <= start["nanosec"] < 10**9 for start in starts)
