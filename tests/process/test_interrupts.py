"""Ctrl-C: always status 130, no traceback, no half-written file, wherever the command is."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from jobs import PLATE, run_coverable, verdict_named
from samples import spread

from coverable import load_result
from feasibility.cli.first_interrupt import raised
from feasibility.interrupts import at_leave, leave_at_once
from feasibility.safe_files import write_whole

INTERRUPTED = "coverable: interrupted\n"
GUARD_S = 1800.0  # against hanging alone
OURS = ("coverable", "feasibility.cli", "feasibility.safe_files", "feasibility.results")


def check_all(folder: Path):
    """`check` with files in a folder; the same text of the case each time."""
    case = folder.parent / "plate.toml"
    case.write_text(PLATE)
    files = "--witness", folder / "walk.csv", "--save", folder / "a.result"
    return run_coverable("check", case, *files)


@contextlib.contextmanager
def interrupted_at(call: int, ours: tuple[str, ...] = OURS):
    """Ctrl-C at a call or return of functions of these modules."""
    count = [0]

    def profile(frame, event, argument):
        counts = event in ("call", "return")
        if counts and frame.f_globals.get("__name__", "").startswith(ours):
            count[0] += 1
            if count[0] == call + 1:
                sys.setprofile(None)
                signal.raise_signal(signal.SIGINT)

    sys.setprofile(profile)
    try:
        yield count
    finally:
        sys.setprofile(None)


def forked(work, said: Path) -> tuple[int, str]:
    """The status of a process that begins as this one and works; what it says to stderr."""
    if (child := os.fork()) == 0:
        os.dup2(os.open(said, os.O_CREAT | os.O_WRONLY), 2)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        leave_at_once()
        with contextlib.suppress(BaseException):
            work()
        os._exit(99)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said.read_text()


def test_at_any_call_of_a_command_that_writes_files(tmp_path):
    verdict_named("plate")  # kernels
    (whole := tmp_path / "whole" / "out").mkdir(parents=True)
    check_all(whole)  # and all is imported
    with interrupted_at(10**9) as calls:
        assert check_all(whole).status == 0
    known = {file.name: file.read_bytes() for file in whole.iterdir()}
    assert calls[0] > 250
    for call in spread(range(calls[0] - 9), 14):  # a call more or less is made from run to run
        (folder := tmp_path / str(call) / "out").mkdir(parents=True)

        def work(call=call, folder=folder):
            with interrupted_at(call):
                check_all(folder)

        assert forked(work, folder.parent / "said") == (130, INTERRUPTED), call
        for file in folder.iterdir():
            whole_result = file.suffix == ".result" and load_result(file).verdict.feasible
            assert whole_result or file.read_bytes() == known[file.name], (call, file)


def test_place_says_what_is_known_and_a_store_is_closed(tmp_path):
    """SQLite keeps files beside one that is open."""
    (case := tmp_path / "plate.toml").write_text(PLATE)
    asked = "place", case, "--workers", 0, "--x", 0.3, 0.5, "--count", 3, "--out"
    assert run_coverable(*asked, tmp_path / "whole").status == 0  # and all is imported
    told = []
    for call in spread(range(0, 400, 20), 5):

        def work(call=call):
            with interrupted_at(call, ours=("feasibility.studies", "feasibility.placement")):
                said = run_coverable(*asked, tmp_path / str(call))
            os.write(2, f"{said.out}{said.err}".encode())
            os._exit(said.status)

        status, said = forked(work, tmp_path / "said")
        (tmp_path / "said").unlink()
        assert (status, said.endswith(INTERRUPTED)) == (130, True), (call, said)
        assert list(tmp_path.glob("*-*")) == []
        told.append("placements" in said)
    assert any(told)


def test_the_first_one_is_raised_where_that_is_asked_for_and_the_second_ends_the_process(tmp_path):
    def dropped():
        with raised() as again:
            with contextlib.suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
            with contextlib.suppress(KeyboardInterrupt):
                again()
                os._exit(1)
            with (
                at_leave(lambda: os.write(2, b"outer\n")),
                at_leave(lambda: os.write(2, b"inner\n")),
            ):
                signal.raise_signal(signal.SIGINT)

    assert forked(dropped, tmp_path / "said") == (130, f"inner\nouter\n{INTERRUPTED}")

    def writing():
        write_whole(tmp_path / "a", lambda stream: signal.raise_signal(signal.SIGINT))

    assert forked(writing, tmp_path / "more") == (130, INTERRUPTED)
    assert {file.name for file in tmp_path.iterdir()} == {"said", "more"}


def test_a_handler_of_someone_else_is_left_alone():
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    try:
        with raised():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [1]


def process(code: str, *arguments: object, **more: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True, text=True, timeout=GUARD_S, check=False, **more,
    )  # fmt: skip


AT_IMPORT = """
import os, sys
point = sys.argv.pop(1)
def interrupt(event, about):
    if event == "import" and about[0] == point:
        os.kill(os.getpid(), 2)
sys.addaudithook(interrupt)
from coverable.command import run
run()
"""  # Ctrl-C just before a module is imported for the first time


@pytest.mark.parametrize("module", ["signal", "argparse", "numba"])
def test_from_the_first_instruction(module):
    found = process(AT_IMPORT, module, "check", "paper/4a")
    assert (found.returncode, found.stdout, found.stderr) == (130, "", INTERRUPTED)


AT_THE_END = """
import io, os, sys
class Late(io.StringIO):
    def flush(self):
        if sys._getframe(1).f_code.co_name == "run":
            os.kill(os.getpid(), 2)
sys.stdout = Late()
from coverable.command import run
run()
"""  # Ctrl-C when the answer has been given


def test_at_the_end_of_the_process():
    found = process(AT_THE_END, "cases")
    assert (found.returncode, found.stderr) == (130, INTERRUPTED)


IMPORT = """
import sys
from feasibility.cli.first_interrupt import raised
sys.path.insert(0, sys.argv[1])
try:
    with raised() as again:
        import imported_when_interrupted
        again()
except KeyboardInterrupt:
    print(sys.modules["imported_when_interrupted"].whole)
"""


def test_in_an_import_it_waits_until_the_module_is_whole(tmp_path):
    lines = "import signal", "signal.raise_signal(signal.SIGINT)", "whole = True"
    (tmp_path / "imported_when_interrupted.py").write_text("\n".join(lines))
    done = process(IMPORT, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")
