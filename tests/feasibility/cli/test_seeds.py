"""`explain --witness` and `check --seeds`: what one command finds, the next one begins from."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from bad_cases import write
from small_cases import TEXTS


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    return Path(write(tmp_path, TEXTS["plate"], "plate.toml"))


def test_explain_writes_the_motions_that_check_begins_from_and_verify_accepts(
    ask, plate: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "motions"
    folder.mkdir()
    status, out, err = ask("explain", plate, "--json", "--witness", folder)
    assert status == 0
    told = json.loads(out)
    helps = [t for t in told["thresholds"] if t["feasible"] is not None]
    files = sorted(folder.iterdir())
    assert len(files) == len(helps) == err.count("witness: ")
    header, *rows = csv.reader((folder / "cone.csv").read_text().splitlines())
    assert header[0] == "cell"
    assert {row[0] for row in rows} - {""} == {str(k) for k in range(told["cells"])}

    cone = next(t for t in helps if t["quantity"] == "cone")["feasible"]["value_deg"]
    change = ("--set", f"task.cone_deg={cone}")
    assert ask("verify", plate, folder / "cone.csv", *change)[0] == 0
    status, out, _ = ask("check", plate, *change, "--seeds", folder / "cone.csv", "--json")
    assert status == 0
    assert json.loads(out)["verdict"] == "feasible"


def test_a_folder_that_is_not_there_is_refused_before_the_work(
    ask, plate: Path, tmp_path: Path
) -> None:
    status, out, err = ask("explain", plate, "--witness", tmp_path / "nowhere")
    assert (status, out) == (2, "")
    assert "there is no folder" in err


def test_seeds_of_another_arm_are_refused(ask, plate: Path, tmp_path: Path) -> None:
    motion = write(tmp_path, "joint1,joint2\n0,0\n", "other.csv")
    status, out, err = ask("check", plate, "--seeds", motion)
    assert (status, out) == (2, "")
    assert "other.csv" in err


def test_the_greedy_search_takes_no_seeds(ask, plate: Path, tmp_path: Path) -> None:
    motion = write(tmp_path, "joint1\n0\n", "seeds.csv")
    status, _, err = ask("check", plate, "--set", "search.method=greedy", "--seeds", motion)
    assert status == 2
    assert "--seeds needs 'complete'" in err
