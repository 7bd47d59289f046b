"""Ctrl-C: always status 130, no traceback, no half-written file, wherever the command is."""

import contextlib
import gc
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from jobs import PLATE, run_coverable, verdict_named
from samples import sampled, seeds, spread

from coverable import Store, load_result
from feasibility import interrupts
from feasibility.interrupts import interruptible
from feasibility.safe_files import write_whole

INTERRUPTED = "coverable: interrupted\n"
GUARD_S = 1800.0  # against hanging alone
OURS = ("coverable", "feasibility.cli", "feasibility.safe_files", "feasibility.results")
STORE = ("feasibility.studies.store",)


def check_all(folder: Path):
    """`check` with files in a folder; the same text of the case each time."""
    case = folder.parent / "plate.toml"
    case.write_text(PLATE)
    files = "--witness", folder / "walk.csv", "--save", folder / "a.result"
    return run_coverable("check", case, *files)


@contextlib.contextmanager
def interrupted_at(call: int, swallowed: bool = False, ours: tuple[str, ...] = OURS):
    """Ctrl-C at a call or return of functions of these modules; a library may swallow it.

    Counted from where a command begins to hear it: what comes before has tests of its own.
    """
    count, empty = [0], contextlib.nullcontext

    def profile(frame, event, argument):
        counts = event in ("call", "return")
        counts = counts and frame.f_globals.get("__name__", "").startswith(ours)
        if counts and signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            count[0] += 1
            if count[0] == call + 1:
                sys.setprofile(None)
                with contextlib.suppress(KeyboardInterrupt) if swallowed else empty():
                    signal.raise_signal(signal.SIGINT)

    sys.setprofile(profile)
    try:
        yield count
    finally:
        sys.setprofile(None)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What the command leaves when it is left alone, and the calls that it makes."""
    verdict_named("plate")  # kernels
    folder = tmp_path_factory.mktemp("whole") / "out"
    folder.mkdir()
    check_all(folder)
    with interrupted_at(10**9) as calls:
        assert check_all(folder).status == 0
    return {file.name: file.read_bytes() for file in folder.iterdir()}, calls[0]


@pytest.mark.parametrize("swallowed", [False, True])
def test_at_any_call_of_a_command_that_writes_files(swallowed, whole, tmp_path):
    known, calls = whole
    assert calls > 300
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM), sys.unraisablehook
    left = []
    for call in spread(range(calls - 9), 20):  # a call more or less is made from run to run
        folder = tmp_path / str(call) / "out"
        folder.mkdir(parents=True)
        with interrupted_at(call, swallowed):
            said = check_all(folder)
        assert (said.status, said.err.endswith(INTERRUPTED)) == (130, True), (call, said)
        for file in folder.iterdir():
            same = file.read_bytes() == known[file.name]
            left += [] if same or (file.suffix == ".result" and is_whole(file)) else [file]
        after = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM)
        assert (*after, sys.unraisablehook) == before
    assert left == []


def test_a_store_is_closed_wherever_it_is_cut_short(tmp_path):
    """SQLite keeps files beside one that is open, and in a process garbage is collected seldom."""
    (case := tmp_path / "plate.toml").write_text(PLATE)
    asked = "place", case, "--workers", 0, "--x", 0.3, 0.5, "--count", 1, "--out"
    gc.disable()
    try:
        assert run_coverable(*asked, tmp_path / "whole").status == 0  # and all is imported
        for call in spread(range(30), 8):  # it is open after 26
            with interrupted_at(call, ours=STORE):
                assert run_coverable(*asked, tmp_path / str(call)).status == 130
            assert list(tmp_path.glob("*-*")) == []
    finally:
        gc.enable()


class Dying:
    """The interpreter prints what its callback raises, and goes on."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def printed_and_dropped():
    """As the generated code of Cython does where nothing can be raised."""
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt as error:
        sys.excepthook(type(error), error, error.__traceback__)


@pytest.mark.parametrize("drop", [Dying, printed_and_dropped])
def test_what_is_dropped_is_raised_again_without_waiting_for_an_output(drop):
    def work():
        with interruptible():
            drop()
            while True:  # ended by the second attempt alone
                pass

    with pytest.raises(KeyboardInterrupt):
        work()


def test_a_second_one_ends_the_process_and_leaves_no_file(tmp_path):
    """Also while a file is written, and its writer holds on."""
    code = """
import contextlib, signal, sys
from feasibility.interrupts import interruptible
from feasibility.safe_files import write_whole
def write(stream):
    with contextlib.suppress(BaseException):
        signal.raise_signal(signal.SIGINT)
    print("writing", flush=True)
    signal.raise_signal(signal.SIGINT)
    print("not reached")
with interruptible():
    write_whole(sys.argv[1], write)
"""
    done = process(code, tmp_path / "a.csv")
    assert (done.returncode, done.stdout, done.stderr) == (130, "writing\n", INTERRUPTED)
    assert list(tmp_path.iterdir()) == []


def test_a_handler_of_someone_else_is_left_alone(tmp_path):
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    try:
        with interruptible():
            signal.raise_signal(signal.SIGINT)
            write_whole(tmp_path / "a", lambda stream: stream.write(b"whole"))
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [1]
    assert (tmp_path / "a").read_bytes() == b"whole"
    assert interrupts.INTERRUPTED == 130


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
    done = process(IMPORT, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


AT_EVENT = """
import os, signal, sys
left, begun = int(sys.argv.pop(1)), False
def interrupt(event, about):
    global left, begun
    begun = begun or event == "exec" and about[0].co_filename.endswith("coverable/command.py")
    if begun:
        left -= 1
        if left == 0:
            os.killpg(0, signal.SIGINT)
sys.addaudithook(interrupt)
from coverable.command import run
run()
"""  # Ctrl-C, to the whole group as from a terminal, at the n-th event from our first one on
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


def is_whole(file: Path) -> bool:
    data = file.read_bytes()
    ends = {".html": b"</html>", ".png": b"IEND\xaeB`\x82", ".json": b"}", ".csv": b""}
    if file.suffix in ends:
        newline = file.suffix != ".csv" or data.endswith(b"\n")
        return newline and data.rstrip().endswith(ends[file.suffix])
    if file.suffix == ".result":
        return load_result(file).verdict.feasible
    with Store(file) as store:
        return len(store) >= 0


# Not in a plain run: which event is the n-th depends on what Python finds compiled.
@sampled
@pytest.mark.parametrize("number", seeds(0, all=200))
def test_at_a_random_event(number, tmp_path):
    """Files and imports, most of them: a command has some ten thousand such events."""
    rng = np.random.default_rng([20260713, number])
    command = list(COMMANDS)[(number * 4) % len(COMMANDS)]
    (tmp_path / "plate.toml").write_text(PLATE)
    (tmp_path / "s.toml").write_text(STUDY)
    event = int(rng.integers(1, 40_000))
    done = process(
        AT_EVENT, event, command, *COMMANDS[command], cwd=tmp_path, start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip
    assert done.returncode in (130, 0, 1), done.stderr  # or it has fewer events
    assert (done.returncode == 130) == done.stderr.endswith(INTERRUPTED)
    assert "Traceback" not in done.stderr
    assert "leaked" not in done.stderr
    left = {file.name for file in tmp_path.iterdir()} - {"plate.toml", "s.toml"}
    assert left <= {part for part in COMMANDS[command] if "." in part and part[0].isalpha()}
    assert [name for name in left if not is_whole(tmp_path / name)] == []
