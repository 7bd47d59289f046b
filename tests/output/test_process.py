"""The command as a process: who reads it, bugs and trouble, waiting, Ctrl-C."""

import contextlib
import errno
import io
import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import tomllib
import urllib.request
from pathlib import Path
from unittest.mock import Mock

import numba
import pytest
from live_windows import GUARD_S, window
from numba.core import event
from samples import EVERYTHING

import feasibility.checking
from feasibility import notices
from feasibility.cli import main as cli
from feasibility.cli import warm_up
from feasibility.notices import NOTICE, compiling_notice
from feasibility.version import version
from feasibility.viewer.live_server import LiveView

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-m", "coverable"]
SMALL = ("check", "paper/4a", "--set", "surface.cells=[2, 2]")


def run(*args, **options):
    given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return subprocess.run([*COMMAND, *args], timeout=GUARD_S, check=False, cwd=ROOT, **given)


def test_the_installed_command_is_this_one(ask):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"coverable": "coverable.command:run"}
    assert ask("--version") == (0, f"coverable {version()}\n", "")


def test_a_reader_that_leaves_is_no_error_and_a_full_disk_status_2():
    first, rest = os.pipe()
    os.close(first)
    child = run("cases", stdout=rest)
    os.close(rest)
    assert (child.returncode, child.stderr) == (0, "")
    with open("/dev/full", "w") as full:
        child = run("cases", stdout=full)
    assert (child.returncode, child.stderr) == (2, "coverable: No space left on device\n")


def test_answers_survive_a_narrow_encoding():
    done = run(*SMALL, "--set", "robot.name=пума", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stdout) == (2, "")
    assert "there is no robot" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_terminal_sees_progress_and_stdout_the_answer_alone():
    program = (
        "import os, sys, feasibility.checking as c; from feasibility.cli.main import main\n"
        "real = c.check\n"
        "def told(*a, clock, **more):\n"
        "    clock.report(3, 12, 'a search'); return real(*a, clock=clock, **more)\n"
        "c.check = told; said = main(sys.argv[1:]); sys.stdout.flush(); os._exit(said)"
    )
    leader, follower = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-c", program, *SMALL, "--json"],
        stdout=subprocess.PIPE, stderr=follower, env={**os.environ, "TERM": "xterm"}, cwd=ROOT,
    )  # fmt: skip
    os.close(follower)
    seen = b""
    with contextlib.suppress(OSError):  # the other end has closed
        while chunk := os.read(leader, 4096):
            seen += chunk
    out, _ = child.communicate(timeout=GUARD_S)
    os.close(leader)
    assert child.returncode == 0
    assert json.loads(out)["verdict"] == "feasible"
    assert b"a search" in seen


@pytest.fixture
def search(monkeypatch):
    """search(error): takes the place of the search."""
    return lambda error: monkeypatch.setattr(feasibility.checking, "check", Mock(side_effect=error))


def test_a_bug_says_that_it_is_one(search, monkeypatch, capsys):
    search(KeyError("a slip"))
    assert cli.main(list(SMALL)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "this is a bug in coverable: KeyError: 'a slip'" in err
    assert "COVERABLE_TRACEBACK=1" in err
    monkeypatch.setenv("COVERABLE_TRACEBACK", "1")
    assert cli.main(list(SMALL)) == 2
    assert "Traceback (most recent call last)" in capsys.readouterr().err


@pytest.mark.parametrize(("error", "words"), [
    (OSError(errno.ENOSPC, "No space left on device", "x"), "x: No space left on device"),
    (MemoryError(), "not enough memory; use fewer cells"),
    (ImportError("libpinocchio.so: cannot open"), "libpinocchio.so: cannot open"),
])  # fmt: skip
def test_trouble_of_the_machine_is_status_2_and_no_bug(ask, search, error, words):
    search(error)
    said = ask(*SMALL)
    assert (said.status, said.out) == (2, "")
    assert words in said.err
    assert "bug" not in said.err


@pytest.mark.parametrize("line", ["check paper/4a --save no/a --html no/b --witness no/c",
                                  "path paper/4a --order spiral --passes 0 --pitch 0.1",
                                  "path paper/4a --program a.jbi", "divide paper/4a --html no/b",
                                  "verify paper/4a no.csv"])  # fmt: skip
def test_what_cannot_be_done_is_refused_before_any_search(ask, search, line):
    search(AssertionError("the search must not run"))
    said = ask(*line.split())
    assert said.status == 2
    assert "must not run" not in said.err


def out_of_patience():
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join()


def compiled():
    numba.njit(lambda x: x + 1)(1)


def test_a_long_wait_for_kernels_is_explained_once_for_each_purpose(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with compiling_notice(patience=1e6):
        compiled()
    with compiling_notice(patience=0.0):
        out_of_patience()  # but nothing is compiled
    assert sys.stderr.getvalue() == ""
    with compiling_notice(patience=0.0):
        with compiling_notice(patience=0.0, notice=notices.COLLISIONS):
            out_of_patience()
            compiled()
            compiled()
        assert sys.stderr.getvalue() == notices.COLLISIONS + "\n"
        compiled()
    assert sys.stderr.getvalue() == notices.COLLISIONS + "\n" + NOTICE + "\n"
    assert len({notices.CUTTING, notices.GREEDY, notices.COLLISIONS, NOTICE}) == 4


@pytest.mark.sampled
def test_after_a_warm_up_nothing_is_compiled(ask, monkeypatch):
    """In the few, of the first of its commands, which is compiled by then."""
    monkeypatch.setattr(warm_up, "COMMANDS", warm_up.COMMANDS[: None if EVERYTHING else 1])
    assert json.loads(ask("warm-up", "--json").out)["compiled"] >= 0
    with event.install_recorder("numba:compile") as recorded:
        for line in ("check paper/4b --json", "path paper/5d --passes 90 --pitch 0.2",
                     "explain paper/4a --set collision.clearance=0.01 --set surface.cells=[2,2]",
                     "divide paper/4f")[: None if EVERYTHING else 1]:  # fmt: skip
            assert ask(*line.split()).status in (0, 1, 3)
        assert recorded.buffer == []
    assert ask("warm-up").out == "everything is compiled already\n"


def test_show_serves_the_view_until_ctrl_c(commands, monkeypatch):
    commands.run("check", "files")
    seen = []

    def wait(live):
        with urllib.request.urlopen(live.url, timeout=GUARD_S) as page:
            seen.append((live.url, page.read()))
        raise KeyboardInterrupt

    monkeypatch.setattr(LiveView, "wait", wait)
    said = commands.say(["show", "plate.result", "--no-browser"])
    ((url, page),) = seen
    assert (said.status, said.err.strip()) == (0, f"view: {url} (served until Ctrl-C)")
    assert b"plate.toml: feasible" in page


def test_a_live_page_is_served_until_ctrl_c_which_is_its_end_and_no_fault():
    """Right after a window has asked something, too."""
    with subprocess.Popen(
        [*COMMAND, "live", "paper/4a", "--no-browser"], cwd=ROOT, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as child:  # fmt: skip
        line = child.stderr.readline()
        wanted = r"live: (http://127\.0\.0\.1:\d+/\S+/) \(served until Ctrl-C\)\n"
        url = re.fullmatch(wanted, line)[1]
        with window(url) as socket:
            socket.recv(timeout=GUARD_S)
            child.send_signal(signal.SIGINT)
            out, err = child.communicate(timeout=GUARD_S)
    assert (child.returncode, out, err.strip()) == (0, "", "")
