"""Odd numbers, outputs and surroundings of commands: each is one sentence that names what is odd."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from small_cases import TEXTS

from feasibility import check
from feasibility.cases import Case, CaseError, all_keys, toml_document
from feasibility.cases.keys import Key, keys_of, kinds
from feasibility.cli.main import main
from feasibility.paths import PathError
from feasibility.timing import motion_limits
from robots import load_robot

SMALL = ["--set", "surface.cells=[1, 2]"]
Ask = Any


@pytest.fixture
def ask(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Ask:
    """ask(arguments) -> status, stdout, stderr, in a folder with a plate."""
    (tmp_path / "plate.toml").write_text(TEXTS["plate"])
    monkeypatch.chdir(tmp_path)

    def asked(*args: object) -> tuple[int, str, str]:
        status = main([str(arg) for arg in args])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return status, out, re.sub(r"compiling .*first run only.*\n", "", err)

    return asked


@pytest.fixture
def said(ask: Ask) -> Any:
    """The one line that a command says of bad input."""

    def line(*args: str) -> str:
        status, out, err = ask(*args)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert "bug" not in err
        return err

    return line


def test_outputs_are_written_where_no_stream_is_open(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "feasibility.cli", "check", "paper/4a", *SMALL]
    outputs = ["--witness", str(tmp_path / "w.csv"), "--save", str(tmp_path / "r.result")]
    closed = ["sh", "-c", '"$@" <&- >&- 2>&-', "sh", *command, *outputs]
    assert subprocess.run(closed, cwd=Path(__file__).parents[2], check=False).returncode == 0
    assert (tmp_path / "w.csv").read_text().startswith("cell,")
    assert main(["verify", str(tmp_path / "r.result")]) == 0


def test_the_witness_on_a_pipe(ask: Ask) -> None:
    reading, writing = os.pipe()
    status, _, err = ask("check", "plate.toml", "--witness", f"/dev/fd/{writing}")
    os.close(writing)
    with open(reading, encoding="utf-8") as stream:
        header, *rows = stream.read().splitlines()
    assert status == 0
    assert header.startswith("cell,shoulder_pan_joint")
    assert {row.split(",")[0] for row in rows} >= {str(k) for k in range(12)}
    assert "witness: /dev/fd/" in err


@pytest.mark.parametrize("value", ["x", "", "0", "-1", "1.5", "99999999999", "1e3", "0x1"])
def test_a_number_of_threads_that_is_none(
    value: str, monkeypatch: pytest.MonkeyPatch, said: Any
) -> None:
    monkeypatch.setenv("NUMBA_NUM_THREADS", value)
    expected = f"NUMBA_NUM_THREADS must be a whole number in 1 .. 1,024, got {value!r}"
    assert expected in said("check", "paper/4a")
    monkeypatch.setenv("NUMBA_NUM_THREADS", "2")
    assert main(["cases"]) == 0


@pytest.mark.parametrize(
    "args",
    [
        ("check", "paper/4a", *SMALL, "--html", "view.html"),
        ("check", "paper/4a", *SMALL, "--witness", "w.csv"),
        ("study", "study.toml", "--out", "out.study"),
        ("check", "case.toml"),
        ("show", "some.result"),
    ],
)
def test_a_working_directory_that_is_gone(
    args: tuple[str, ...], said: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    line = said(*args)
    assert "the working directory has been deleted" in line or "there is no such file" in line


def test_counts_and_speeds_beyond_all_use(said: Any) -> None:
    place, path = ("place", "paper/4a", *SMALL, "--x", "0", "1"), ("path", "paper/4a", *SMALL)
    metres = "the tool speed must be a positive number of metres per second in 1e-06"
    for args, words in (
        ((*place, "--count", "99999999999"), "count must be a whole number in 1 .. 100,000"),
        ((*place, "--workers=99999999999"), "number of workers must be in 0 .. 1,000"),
        ((*place, "--workers=-1"), "number of workers must be in 0 .. 1,000"),
        ((*path, "--speed", "1e-300"), metres),
        ((*path, "--speed", "1e300"), metres),
        ((*path, "--speed", "1e-9"), metres),
        ((*path, "--velocity", "1e-300"), "velocity must be one positive number in 1e-06"),
        ((*path, "--acceleration", "1e-300"), "acceleration must be one positive number in 1e-06"),
        ((*path, "--speed", "1e-6"), "s apart; give a higher speed"),
        ((*path, "--period", "1e-300"), "the period must be"),
    ):
        assert words in said(*args)
    robot = load_robot("puma560")
    for power in range(-320, 309, 4):
        value = float(f"1e{power}")
        if -6 <= power <= 6:
            assert motion_limits(robot, value, value, value).tool_speed == value
            continue
        for given in ((value,), (0.1, value), (0.1, 1.0, value), (0.1, np.full(6, value))):
            with pytest.raises(PathError):
                motion_limits(robot, *given)


def numeric_keys() -> list[tuple[str, Key]]:
    """Kind of surface and key of every key whose example holds a number."""
    closed = [kind for kind in kinds() if not {"file", "pieces"} & set(keys_of("surface", kind))]
    return [
        (key.kind or "sphere", key)
        for key in all_keys()
        if any(sign.isdigit() for sign in key.example) and "name" not in key.type
        and key.table in ("surface", "task", "search", "robot")
        and (not key.kind or key.kind in closed)
    ]  # fmt: skip


def replaced(value: Any, number: float) -> Any:
    """The value with every number in it replaced."""
    if isinstance(value, list):
        return [replaced(item, number) for item in value]
    if isinstance(value, dict):
        return {key: replaced(item, number) for key, item in value.items()}
    return number if isinstance(value, float | int) and not isinstance(value, bool) else value


@pytest.mark.parametrize(
    ("kind", "key"), numeric_keys(), ids=lambda one: one if isinstance(one, str) else one.name
)
def test_no_number_of_a_case_is_beyond_words(kind: str, key: Key) -> None:
    """Each key with 1e300, and the like, in it: a sentence that names the key, or a case."""
    needed = {
        name: tomllib.loads(f"x = {other.example}")["x"]
        for name, other in keys_of("surface", kind).items()
        if other.default is None
    }
    tables: dict[str, dict[str, Any]] = {
        "robot": {"name": "puma560"},
        "surface": {**needed, "kind": kind, "side": "inside", "cells": [2, 3]},
        "task": {"standoff": 0.005, "cone_deg": 45.0},
        "search": {"method": "complete"},
    }
    for number in (1e300, -1e300, 1.5e155, 1e-300, 10**400):
        tables[key.table][key.name] = replaced(tomllib.loads(f"x = {key.example}")["x"], number)
        try:
            Case.from_toml(toml_document(tables)).build()
        except CaseError as error:
            assert re.search(rf"\b{key.name}\b", str(error))  # noqa: PT017 - or it is a case


# what one command finds, the next one begins from


def test_motions_that_explain_writes_are_seeds_of_check(ask: Ask, tmp_path: Path) -> None:
    (folder := tmp_path / "motions").mkdir()
    status, out, err = ask("explain", "plate.toml", "--json", "--witness", folder)
    assert status == 0
    told = json.loads(out)
    helps = [t for t in told["thresholds"] if t["feasible"] is not None]
    assert len(list(folder.iterdir())) == len(helps) == err.count("witness: ")
    header, *rows = csv.reader((folder / "cone.csv").read_text().splitlines())
    assert header[0] == "cell"
    assert {row[0] for row in rows} - {""} == {str(k) for k in range(told["cells"])}
    cone = next(t for t in helps if t["quantity"] == "cone")["feasible"]["value_deg"]
    change = ("--set", f"task.cone_deg={cone}")
    assert ask("verify", "plate.toml", folder / "cone.csv", *change)[0] == 0
    seeds = ("--seeds", folder / "cone.csv")
    status, out, _ = ask("check", "plate.toml", *change, *seeds, "--json")
    assert (status, json.loads(out)["verdict"]) == (0, "feasible")


def test_seeds_and_folders_that_are_none(ask: Ask, tmp_path: Path) -> None:
    """Refused before the work."""
    (tmp_path / "other.csv").write_text("joint1,joint2\n0,0\n")
    greedy = ("--set", "search.method=greedy")
    for args, words in (
        (("explain", "plate.toml", "--witness", tmp_path / "nowhere"), "there is no folder"),
        (("check", "plate.toml", "--seeds", "other.csv"), "other.csv"),
        (("check", "plate.toml", *greedy, "--seeds", "other.csv"), "--seeds needs 'complete'"),
    ):
        status, out, err = ask(*args)
        assert (status, out) == (2, "")
        assert words in err


# scenes that leave no room

SCENES = {
    "more clearance than standoff": (
        "tool_clearance = 0.05", "wrist_3_link and surface", "larger than the standoff (20 mm)",
    ),
    "the base swallowed": (
        '[[collision.scene]]\nname = "rock"\nkind = "sphere"\nradius = 0.3',
        "shoulder_link and rock", "",
    ),
}  # fmt: skip
BAR = """
[collision]
self = false
surface = false
[[collision.tool]]
kind = "box"
size = [0.2, 0.02, 0.02]
position = [0.1, 0, -0.05]
[[collision.scene]]
name = "pin"
kind = "sphere"
radius = 0.01
position = {}
"""


@pytest.mark.parametrize("name", SCENES)
def test_what_leaves_no_room_is_a_verdict_with_its_cause(name: str, ask: Ask) -> None:
    lines, pair, told = SCENES[name]
    Path("case.toml").write_text(f"{TEXTS['plate']}\n[collision]\n{lines}")
    status, out, err = ask("check", "case.toml", "--json")
    answer = json.loads(out)
    assert (status, answer["verdict"]) in ((1, "infeasible"), (3, "undecided"))
    assert (answer["covered"], len(answer["uncovered"])) == (0, 12)
    assert {cause["cause"] for cause in answer["uncovered"]} == {"collision"}
    assert all(pair in cause["detail"] for cause in answer["uncovered"])
    assert told in err


def test_a_motion_that_collides_between_its_rows_is_refused(ask: Ask) -> None:
    """The tool turns about its own axis: its point stays, and a bar at its side meets a pin."""
    robot, one = load_robot("ur5"), "surface.cells=[1, 1]"
    q = check(*Case.from_toml(TEXTS["plate"], overrides=[one]).build()).witness.q[0]
    rows = np.vstack([q, q - np.copysign(np.pi / 2.0, q[5]) * np.eye(6)[5]])
    lines = [",".join(robot.joint_names), *(",".join(map(repr, row.tolist())) for row in rows)]
    Path("foreign.csv").write_text("\n".join(lines) + "\n")
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, rows.mean(axis=0))
    half = data.oMf[robot.tool_frame_id]
    answers = []
    for along, status in ((0.25, 0), (0.15, 1)):  # beyond the end of the bar, and in its way
        place = half.act(np.array([along, 0.0, -0.05])).tolist()
        Path("case.toml").write_text(TEXTS["plate"] + BAR.format(place))
        done, out, err = ask("verify", "case.toml", "foreign.csv", "--json", "--set", one)
        assert (done, err) == (status, "")
        answers.append(json.loads(out))
    assert [answer["verdict"] for answer in answers] == ["holds", "does not hold"]
    (fault,) = answers[1]["refusals"]
    assert (fault["row"], fault["share"]) == (1, pytest.approx(0.5, abs=0.1))
    assert "tool and pin" in fault["text"]
    assert "overlap by 20 mm" in fault["text"]
