"""Odd numbers and odd surroundings: each is one sentence that names what is odd."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feasibility.cases import Case, CaseError
from feasibility.cases.keys import Key, all_keys, keys_of, kinds
from feasibility.cli.main import main
from feasibility.paths import PathError
from feasibility.timing.speed_limits import motion_limits
from robots import load_robot

SMALL = ["--set", "surface.cells=[1, 2]"]


def said(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    """The one line that a command says of bad input."""
    status = main(args)
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert "bug" not in err
    return err


def test_outputs_are_written_where_no_stream_is_open(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "feasibility.cli", "check", "paper/4a", *SMALL]
    outputs = ["--witness", str(tmp_path / "w.csv"), "--save", str(tmp_path / "r.result")]
    closed = ["sh", "-c", '"$@" <&- >&- 2>&-', "sh", *command, *outputs]
    assert subprocess.run(closed, cwd=Path(__file__).parents[3], check=False).returncode == 0
    assert (tmp_path / "w.csv").read_text().startswith("cell,")
    assert main(["verify", str(tmp_path / "r.result")]) == 0


@pytest.mark.parametrize("value", ["x", "", "0", "-1", "1.5", "99999999999", "1e3", "0x1"])
def test_a_number_of_threads_that_is_none(
    value: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("NUMBA_NUM_THREADS", value)
    expected = f"NUMBA_NUM_THREADS must be a whole number in 1 .. 1,024, got {value!r}"
    assert expected in said(capsys, "check", "paper/4a")
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
    args: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    line = said(capsys, *args)
    assert "the working directory has been deleted" in line or "there is no such file" in line


def test_counts_and_speeds_beyond_all_use(capsys: pytest.CaptureFixture[str]) -> None:
    place = "place", "paper/4a", *SMALL, "--x", "0", "1"
    assert "count must be a whole number in 1 .. 100,000" in said(
        capsys, *place, "--count", "99999999999"
    )
    for count in ("99999999999", "-1"):
        assert "number of workers must be in 0 .. 1,000" in said(
            capsys, *place, f"--workers={count}"
        )
    path = "path", "paper/4a", *SMALL
    for speed in ("1e-300", "1e300", "1e-9"):
        line = said(capsys, *path, "--speed", speed)
        assert "the tool speed must be a positive number of metres per second in 1e-06" in line
        assert f"got {float(speed)!r}" in line
    for limit in ("--velocity", "--acceleration"):
        assert f"{limit[2:]} must be one positive number in 1e-06" in (
            said(capsys, *path, limit, "1e-300")
        )
    assert "s apart; give a higher speed" in said(capsys, *path, "--speed", "1e-6")
    assert "the period must be" in said(capsys, *path, "--period", "1e-300")


def test_every_speed_is_an_error_or_within_its_caps() -> None:
    robot = load_robot("puma560")
    for power in range(-320, 309, 4):
        value = float(f"1e{power}")
        if -6 <= power <= 6:
            assert motion_limits(robot, value, value, value).tool_speed == value
        else:
            for given in ((value,), (0.1, value), (0.1, 1.0, value), (0.1, np.full(6, value))):
                with pytest.raises(PathError):
                    motion_limits(robot, *given)


def examples(keys: dict[str, Key]) -> dict[str, Any]:
    """The example of every key that is needed."""
    return {
        name: tomllib.loads(f"x = {key.example}")["x"]
        for name, key in keys.items()
        if key.default is None
    }


def replaced(value: Any, number: float) -> Any:
    """The value with every number in it replaced; None where there is none."""
    if isinstance(value, list):
        return [replaced(item, number) for item in value]
    if isinstance(value, dict):
        return {key: replaced(item, number) for key, item in value.items()}
    return number if isinstance(value, float | int) and not isinstance(value, bool) else value


def numeric_keys() -> list[tuple[str, str, str]]:
    """Kind of surface, table and name of every key whose example holds a number."""
    closed = [kind for kind in kinds() if not {"file", "pieces"} & set(keys_of("surface", kind))]
    found = []
    for key in all_keys():
        if not any(sign.isdigit() for sign in key.example) or "name" in key.type:
            continue
        if key.table in ("surface", "task", "search", "robot") and (
            not key.kind or key.kind in closed
        ):
            found.append((key.kind or "sphere", key.table, key.name))
    return found


@pytest.mark.parametrize(("kind", "table", "name"), numeric_keys())
def test_no_number_of_a_case_is_beyond_words(kind: str, table: str, name: str) -> None:
    """Each key with 1e300, and the like, in it: a sentence that names the key, or a case."""
    keys = dict(keys_of("surface", kind))
    surface = {"kind": kind, "side": "inside", **examples(keys), "cells": [2, 3]}
    tables: dict[str, dict[str, Any]] = {
        "robot": {"name": "puma560"},
        "surface": surface | {"kind": kind},
        "task": {"standoff": 0.005, "cone_deg": 45.0},
        "search": {"method": "complete"},
    }
    example = tomllib.loads(f"x = {dict(keys_of(table, kind))[name].example}")["x"]
    for number in (1e300, -1e300, 1.5e155, 1e-300, 10**400):
        tables[table][name] = replaced(example, number)
        refused = refusal(text_of(tables))
        assert refused is None or re.search(rf"\b{name}\b", refused), refused


def refusal(text: str) -> str | None:
    """What is said of a case that is not taken."""
    try:
        Case.from_toml(text).build()
    except CaseError as fault:
        return str(fault)
    return None


def text_of(tables: dict[str, dict[str, Any]]) -> str:
    """A case as TOML, a key a line."""
    rows = [
        f"[{table}]\n" + "".join(f"{key} = {toml(value)}\n" for key, value in part.items())
        for table, part in tables.items()
    ]
    return "\n".join(rows)


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
