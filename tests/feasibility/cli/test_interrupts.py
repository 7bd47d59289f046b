"""Ctrl-C at named points: always status 130, no traceback, no half-written file.

Random moments of whole commands are in tests/campaigns/test_interrupts.py.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from guards import GUARD_S
from small_cases import TEXTS, small_verdict

import feasibility.checking
import feasibility.results
import feasibility.safe_files
import feasibility.viewer
from feasibility import interrupts
from feasibility.cli import command, console
from feasibility.cli.main import main
from feasibility.safe_files import write_whole

INTERRUPTED = "coverable: interrupted\n"

AT_IMPORT = """
import os, sys
point = sys.argv.pop(1)
def interrupt(event, about):
    if event == "import" and about[0] == point:
        os.kill(os.getpid(), 2)
sys.addaudithook(interrupt)
from coverable_command import run
run()
"""  # Ctrl-C just before a module is imported for the first time

AT_THE_END = """
import io, os, sys
class Late(io.StringIO):
    def flush(self):
        if sys._getframe(1).f_code.co_name == "run":
            os.kill(os.getpid(), 2)
sys.stdout = Late()
from coverable_command import run
run()
"""  # Ctrl-C when the answer has been given


@pytest.mark.parametrize(
    "module",
    ["signal", "feasibility", "lazy_loader", "argparse", "feasibility.cli.command", "numba"],
)
def test_from_the_first_instruction(module):
    found = subprocess.run(
        [sys.executable, "-c", AT_IMPORT, module, "check", "paper/4a"],
        capture_output=True, text=True, timeout=GUARD_S, check=False,
    )  # fmt: skip
    assert (found.returncode, found.stdout, found.stderr) == (130, "", INTERRUPTED)


def test_at_the_end_of_the_process():
    found = subprocess.run(
        [sys.executable, "-c", AT_THE_END, "cases"],
        capture_output=True, text=True, timeout=GUARD_S, check=False,
    )  # fmt: skip
    assert (found.returncode, found.stderr) == (130, INTERRUPTED)


# named points of a command that writes files

SWALLOWED, RAISED = "swallowed", "raised"
POINTS = [
    (feasibility.checking, "check"),
    (feasibility.viewer, "view"),
    (feasibility.results, "save_result"),
    (feasibility.safe_files, "check_writable"),
    (feasibility.safe_files, "_mode"),
    (os, "fsync"),
    (os, "replace"),
    (command, "print_err"),
    (console, "_write"),
]


def interrupt(how):
    """A Ctrl-C, which a library may swallow."""
    if how == RAISED:
        signal.raise_signal(signal.SIGINT)
    with contextlib.suppress(BaseException):
        signal.raise_signal(signal.SIGINT)


class Page:
    """In place of a view, which takes a while to draw."""

    def html(self) -> str:
        return "<!doctype html>" + "page " * 1000


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Neither search nor drawing: what is tested is what is round them."""
    monkeypatch.setattr(feasibility.checking, "check", lambda *_, **__: small_verdict("plate"))
    monkeypatch.setattr(feasibility.viewer, "view", lambda *_, **__: Page())


@pytest.fixture
def whole(tmp_path):
    """What the command leaves when it is left alone, by the names of its files."""
    folder = tmp_path / "whole"
    folder.mkdir()
    assert check_all(folder) == 0
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def check_all(folder: Path) -> int:
    """`check` with every output in a folder."""
    case = folder.parent / "plate.toml"
    case.write_text(TEXTS["plate"])
    flags = {"--witness": "walk.csv", "--save": "a.result", "--html": "view.html"}
    return main(["check", str(case), *(s for f, n in flags.items() for s in (f, str(folder / n)))])


@pytest.mark.parametrize("how", [RAISED, SWALLOWED])
@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize(
    ("module", "name"), POINTS, ids=lambda part: getattr(part, "__name__", part)
)
def test_at_named_points(module, name, when, how, whole, tmp_path, monkeypatch, capsys):
    count = []

    def interrupted(*args, **keywords):
        count.append(1)
        if when == "before" and len(count) == 1:
            interrupt(how)
        done = plain(*args, **keywords)
        if when == "after" and len(count) == 1:
            interrupt(how)
        return done

    plain = getattr(module, name)
    monkeypatch.setattr(module, name, interrupted)
    folder = tmp_path / "out"
    folder.mkdir()
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM), sys.unraisablehook
    status = check_all(folder)
    err = capsys.readouterr().err
    assert count
    assert status == 130
    assert err.endswith(INTERRUPTED)
    assert "Traceback" not in err
    for file in folder.iterdir():
        assert file.read_bytes() == whole[file.name]
    after = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM), sys.unraisablehook
    assert after == before


def test_in_a_callback_of_the_interpreter(monkeypatch, tmp_path, capsys):
    """Python prints it and goes on: it is raised again, without waiting for an output."""

    class Dying:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def check(*_, **__):
        Dying()
        while True:  # ended by the second attempt alone
            pass

    monkeypatch.setattr(feasibility.checking, "check", check)
    (tmp_path / "out").mkdir()
    assert check_all(tmp_path / "out") == 130
    assert capsys.readouterr().err == INTERRUPTED


def test_in_a_compiled_module_that_prints_and_drops_it(monkeypatch, tmp_path, capsys):
    """As the generated code of Cython does where nothing can be raised."""

    def check(*_, **__):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            sys.excepthook(type(error), error, error.__traceback__)
        while True:
            pass

    monkeypatch.setattr(feasibility.checking, "check", check)
    (tmp_path / "out").mkdir()
    assert check_all(tmp_path / "out") == 130
    assert capsys.readouterr().err == INTERRUPTED


IMPORT = """
import sys
from feasibility.interrupts import interruptible
sys.path.insert(0, sys.argv[1])
try:
    with interruptible():
        import imported_when_interrupted
        while True:
            pass
except KeyboardInterrupt:
    print(sys.modules["imported_when_interrupted"].whole)
"""


def test_in_an_import_it_waits_until_the_module_is_whole(tmp_path):
    lines = "import signal", "signal.raise_signal(signal.SIGINT)", "whole = True"
    (tmp_path / "imported_when_interrupted.py").write_text("\n".join(lines))
    done = subprocess.run(
        [sys.executable, "-c", IMPORT, tmp_path], capture_output=True, text=True, timeout=GUARD_S
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


def test_a_second_one_ends_the_process_and_leaves_no_file(monkeypatch, tmp_path, capfd):
    """Also while a file is written, and its writer holds on."""
    ended = []

    def end(status):
        ended.append((status, list(tmp_path.iterdir())))
        raise SystemExit

    monkeypatch.setattr(os, "_exit", end)

    def write(stream):
        interrupt(SWALLOWED)
        assert len(list(tmp_path.iterdir())) == 1
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt), interrupts.interruptible():
        write_whole(tmp_path / "a.csv", write)
    assert ended == [(130, [])]
    assert capfd.readouterr().err == INTERRUPTED


def test_a_handler_of_someone_else_is_left_alone():
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    try:
        with interrupts.interruptible():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [1]


def test_a_time_limit_that_a_callback_of_the_interpreter_drops_comes_again(monkeypatch):
    """Garbage is collected at any moment, and what its callbacks raise is dropped."""
    monkeypatch.setattr(interrupts, "_wake", lambda: None)  # the alarm rings where this test says

    class Callback:
        def __del__(self):
            interrupts._again(0, None)

    def work():
        with interrupts.interruptible(), interrupts.limited(lambda: 0.0, TimeoutError):
            Callback()
            interrupts._again(0, None)
            ended.append(1)

    ended = []
    with pytest.raises(TimeoutError):
        work()
    assert not ended
