"""Odd outputs, counts and surroundings of commands: each is one sentence that says what is odd."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from jobs import TEXTS
from jobs import coverable as asked

from feasibility.cli.main import main
from feasibility.paths import PathError
from feasibility.timing import motion_limits
from robots import load_robot

SMALL = ["--set", "surface.cells=[1, 2]"]


def said(*args: object) -> str:
    """The one line that a command says of bad input."""
    status, out, err = asked(*args)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "bug" not in err
    return err


def test_outputs_are_written_where_no_stream_is_open(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "feasibility.cli", "check", "paper/4a", *SMALL]
    outputs = ["--witness", str(tmp_path / "w.csv"), "--save", str(tmp_path / "r.result")]
    closed = ["sh", "-c", '"$@" <&- >&- 2>&-', "sh", *command, *outputs]
    assert subprocess.run(closed, cwd=Path(__file__).parents[2], check=False).returncode == 0
    assert (tmp_path / "w.csv").read_text().startswith("cell,")
    assert main(["verify", str(tmp_path / "r.result")]) == 0


@pytest.mark.parametrize("value", ["x", "", "0", "-1", "1.5", "99999999999", "1e3", "0x1"])
def test_a_number_of_threads_that_is_none(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_NUM_THREADS", value)
    expected = f"NUMBA_NUM_THREADS must be a whole number in 1 .. 1,024, got {value!r}"
    assert expected in said("check", "paper/4a")
    monkeypatch.setenv("NUMBA_NUM_THREADS", "2")
    assert main(["cases"]) == 0


@pytest.mark.parametrize(
    "args",
    [
        ("check", "paper/4a", *SMALL, "--html", "view.html"),
        ("study", "study.toml", "--out", "out.study"),
        ("check", "case.toml"),
    ],
)
def test_a_working_directory_that_is_gone(
    args: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    line = said(*args)
    assert "the working directory has been deleted" in line or "there is no such file" in line


def test_counts_and_speeds_beyond_all_use() -> None:
    place, path = ("place", "paper/4a", *SMALL, "--x", "0", "1"), ("path", "paper/4a", *SMALL)
    metres = "the tool speed must be a positive number of metres per second in 1e-06"
    for args, words in (
        ((*place, "--count", "99999999999"), "count must be a whole number in 1 .. 100,000"),
        ((*place, "--workers=99999999999"), "number of workers must be in 0 .. 1,000"),
        ((*path, "--speed", "1e-300"), metres),
        ((*path, "--velocity", "1e-300"), "velocity must be one positive number in 1e-06"),
        ((*path, "--acceleration", "1e-300"), "acceleration must be one positive number in 1e-06"),
        ((*path, "--speed", "1e-6"), "s apart; give a higher speed"),
        ((*path, "--period", "1e-300"), "the period must be"),
    ):
        assert words in said(*args)
    robot = load_robot("puma560")
    assert motion_limits(robot, 1e-6, 1e6, 1e-6).tool_speed == 1e-6
    for given in ((1e-7,), (0.1, 1e7), (0.1, 1.0, 1e-320), (0.1, np.full(6, 1e308))):
        with pytest.raises(PathError):
            motion_limits(robot, *given)


def test_what_leaves_no_room_is_a_verdict_with_its_cause(tmp_path: Path) -> None:
    """More clearance than standoff."""
    (tmp_path / "case.toml").write_text(f"{TEXTS['plate']}\n[collision]\ntool_clearance = 0.05")
    status, out, err = asked("check", tmp_path / "case.toml", "--json", *SMALL)
    answer = json.loads(out)
    assert (status, answer["verdict"]) in ((1, "infeasible"), (3, "undecided"))
    assert (answer["covered"], len(answer["uncovered"])) == (0, 2)
    assert {cause["cause"] for cause in answer["uncovered"]} == {"collision"}
    assert all("wrist_3_link and surface" in cause["detail"] for cause in answer["uncovered"])
    assert "larger than the standoff (20 mm)" in err
