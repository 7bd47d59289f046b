"""Odd outputs, counts and surroundings of commands: each is one sentence that says what is odd."""

import itertools
import subprocess
import sys
from pathlib import Path

import pytest
from jobs import run_coverable as asked

from coverable import Search, Task, check, load_robot, plane
from feasibility.cli.main import main

SMALL = ["--set", "surface.cells=[1, 2]"]


def said(*args: object) -> str:
    """The one line that a command says of bad input."""
    status, out, err = asked(*args)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "bug" not in err
    return err


def test_outputs_are_written_where_no_stream_is_open(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "coverable", "check", "paper/4a", *SMALL]
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


@pytest.mark.parametrize("args", [
    ("check", "paper/4a", *SMALL, "--html", "view.html"),
    ("study", "study.toml", "--out", "out.study"), ("check", "case.toml"),
])  # fmt: skip
def test_a_working_directory_that_is_gone(args, tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    line = said(*args)
    assert "the working directory has been deleted" in line or "there is no such file" in line


def test_arguments_in_another_order_or_of_another_kind() -> None:
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    good = (load_robot("ur5"), plate.cells(2, 2), Task(standoff=0.02, cone_deg=20), Search())
    names, bad = ("robot", "cells", "task", "search"), ("ur5", plate, {"standoff": 0.02}, "greedy")
    for which in itertools.product((False, True), repeat=4):
        wrong = [name for name, w in zip(names, which, strict=True) if w]
        if wrong:
            with pytest.raises(TypeError) as caught:
                check(*(b if w else g for w, g, b in zip(which, good, bad, strict=True)))
            assert [fault.split(":")[0] for fault in str(caught.value).split("; ")] == wrong
    with pytest.raises(TypeError, match=r"robot: .*cells: .*task: "):
        check(good[2], good[0], good[1])
    with pytest.raises(TypeError, match=r"g\(u, v\) of your own becomes one by parametric"):
        check(good[0], lambda u, v: (u, v, 0.3), good[2])
