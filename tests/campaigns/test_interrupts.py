"""Ctrl-C at 200 random moments of the seven commands with outputs: 130, and nothing half written.

A moment is a share of the time that the command takes when it is left alone, from its first
instruction to its end. The signal goes to the whole process group, as from a terminal.
"""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from guards import GUARD_S
from small_cases import TEXTS

from feasibility.results import load_result
from feasibility.studies import Store

MOMENTS = 200
SEED = 20260713
EXITING = 0x4  # PF_EXITING of Linux: the process is past its last instruction

BEGIN = """
import os, sys
ready = int(sys.argv.pop(1))
def tell(event, about):
    if event == "exec" and about[0].co_filename.endswith("coverable_command.py"):
        os.write(ready, b"!")
sys.addaudithook(tell)
from coverable_command import run
run()
"""  # says when the first instruction that is ours is due

STUDY = 'base.case = "plate.toml"\nvary."task.cone_deg" = [20, 30, 40, 50, 60, 70]\n'
RANGE = ("--x", "0.3", "0.5", "--count", "8")
TABLES = ("--csv", "p.csv", "--map", "p.png", "--html", "p.html")
COMMANDS = {
    "check": ("plate.toml", "--witness", "a.csv", "--save", "a.result", "--html", "a.html"),
    "path": ("plate.toml", "--out", "b.csv", "--out", "b.json", "--html", "b.html"),
    "divide": ("plate.toml", "--html", "c.html"),
    "explain": ("plate.toml", "--html", "d.html"),
    "place": ("plate.toml", "--workers", "0", "--out", "p.study", *RANGE, *TABLES),
    "study": ("s.toml", "--workers", "2", "--out", "s.study", "--csv", "s.csv", "--html", "s.html"),
    "compare": ("plate.toml", "--robots", "ur5,panda", "--csv", "r.csv", "--html", "r.html"),
}
INPUTS = {"plate.toml": TEXTS["plate"], "s.toml": STUDY}


class End(NamedTuple):
    """How a command ended."""

    status: int
    err: str
    late: bool
    """Had it ended before the signal came?"""
    seconds: float
    """From its first instruction."""


def run(command: str, folder: Path, moment: float | None) -> End:
    """Run a command in a folder, and interrupt it so many seconds after its first instruction."""
    for name, text in INPUTS.items():
        (folder / name).write_text(text)
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN, str(writing), command, *COMMANDS[command]],
        cwd=folder, pass_fds=[writing], start_new_session=True, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    os.close(writing)
    os.read(reading, 1)
    os.close(reading)
    began, late = time.monotonic(), False
    if moment is not None:
        time.sleep(moment)
        os.killpg(process.pid, signal.SIGINT)
        late = exiting(process.pid)
    _, err = process.communicate(timeout=GUARD_S)
    return End(process.returncode, err, late, time.monotonic() - began)


def exiting(pid: int) -> bool:
    """Is a child past its last instruction?"""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return fields[0] in "ZX" or bool(int(fields[6]) & EXITING)


@pytest.fixture(scope="session")
def lengths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    """Seconds that each command takes; all of its outputs are there afterwards."""
    found = {}
    for command in COMMANDS:
        folder = tmp_path_factory.mktemp(command)
        run(command, folder, None)
        again = run(command, folder, None)
        assert again.status in (0, 1), again.err
        assert {file.name for file in folder.iterdir()} - set(INPUTS) == outputs(command)
        assert [name for name in outputs(command) if not is_whole(folder / name)] == []
        found[command] = again.seconds
    return found


def outputs(command: str) -> set[str]:
    """Names of the files that a command writes."""
    return {part for part in COMMANDS[command] if "." in part and part[0].isalpha()} - set(INPUTS)


def is_whole(file: Path) -> bool:
    """Is an output one that a command has finished?"""
    data = file.read_bytes()
    match file.suffix:
        case ".html":
            return data.rstrip().endswith(b"</html>")
        case ".png":
            return data.rstrip().endswith(b"IEND\xaeB`\x82")
        case ".csv":
            lines = [line for line in data.decode().splitlines() if not line.startswith("#")]
            return data.endswith(b"\n") and len({len(row) for row in csv.reader(lines)}) == 1
        case ".json":
            return bool(json.loads(data))
        case ".result":
            return load_result(file).verdict.feasible
    with Store(file) as store:
        return len(store) >= 0


@pytest.mark.parametrize("number", range(MOMENTS))
def test_at_a_random_moment(number, lengths, tmp_path):
    rng = np.random.default_rng([SEED, number])
    command = list(COMMANDS)[number % len(COMMANDS)]
    for attempt in range(20):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        share = rng.random()
        end = run(command, folder, share * lengths[command])
        if not (end.late and end.status != 130):
            break
    print(f"{command} at {share:.3f}: {end.status} after {end.seconds:.2f} s")
    assert end.status == 130, end.err
    assert end.err.endswith("coverable: interrupted\n")
    assert "Traceback" not in end.err
    assert "leaked" not in end.err
    left = {file.name for file in folder.iterdir()} - set(INPUTS)
    assert left <= outputs(command)
    assert [name for name in left if not is_whole(folder / name)] == []
