"""Outputs that are no files: pipes such as /dev/stdout, and devices."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from feasibility.cli.main import main
from feasibility.safe_files import FileError, check_writable, write_whole


def test_a_pipe_takes_all_that_is_written() -> None:
    reading, writing = os.pipe()
    data = os.urandom(20_000)  # a pipe holds 64 kB
    path = f"/dev/fd/{writing}"
    check_writable(path)
    assert str(write_whole(path, lambda stream: stream.write(data))) == path
    os.close(writing)
    with open(reading, "rb") as stream:
        assert stream.read() == data


def test_a_named_pipe_stays_one(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, lambda stream: stream.write(b"walk"))
    assert os.read(reading, 100) == b"walk"
    os.close(reading)
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_device_in_a_folder_that_takes_no_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """As /dev is to everyone but root."""
    plain = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) != "/dev" and plain(path, mode))
    check_writable("/dev/null")
    with pytest.raises(FileError, match="cannot be written to"):
        check_writable("/dev/coverable.csv")


def test_the_witness_on_a_pipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = tmp_path / "plate.toml"
    case.write_text(
        '[robot]\nname = "ur5"\n[surface]\nkind = "plane"\nu = [0.4, 0.6]\nv = [-0.1, 0.1]\n'
        'position = [0, 0, 0.1]\nside = "outside"\ncells = [2, 2]\n'
        "[task]\nstandoff = 0.02\ncone_deg = 20\n"
    )
    reading, writing = os.pipe()
    assert main(["check", str(case), "--witness", f"/dev/fd/{writing}"]) == 0
    os.close(writing)
    with open(reading, encoding="utf-8") as stream:
        header, *rows = stream.read().splitlines()
    assert header.startswith("cell,shoulder_pan_joint")
    assert {row.split(",")[0] for row in rows} >= {"0", "1", "2", "3"}
    assert "witness: /dev/fd/" in capsys.readouterr().err
