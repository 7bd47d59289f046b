"""The command line: exit statuses, one message on stderr, and nothing but answers on stdout."""

import contextlib
import csv
import errno
import io
import json
import os
import pty
import signal
import subprocess
import sys
import threading
import tomllib
import urllib.request
from pathlib import Path

import numba
import pytest
from bad_cases import BAD_CASES, GOOD, write
from guards import GUARD_S
from schema import CHECK, conforms
from small_cases import TEXTS, small_case, small_verdict

import feasibility.checking
from feasibility import Answer, Evidence, Verdict, notices
from feasibility.cases import Case, builtin_cases
from feasibility.cli import command, console
from feasibility.cli import main as cli
from feasibility.notices import NOTICE, compiling_notice
from feasibility.results import load_result, save_result
from feasibility.roadmap import complete
from feasibility.version import version
from feasibility.viewer.live_server import LiveView

COMMAND = [sys.executable, "-m", "feasibility.cli"]


def run(*args, **options):
    """Run the command as a process of its own."""
    return subprocess.run(
        [*COMMAND, *args], capture_output=True, text=True, timeout=GUARD_S, check=False, **options
    )


@pytest.fixture(scope="module", autouse=True)
def kernels():
    """Have the kernels compiled before a test waits for a process that needs them."""
    assert small_verdict("plate").feasible


@pytest.fixture
def plate(tmp_path):
    return write(tmp_path, TEXTS["plate"], "plate.toml")


def message(error, status=2):
    """The one message of a refusal, without the program's name."""
    assert status == 2
    assert error.startswith("coverable")
    assert error.count("coverable: ") <= 1
    return error.partition(": ")[2]


# statuses and answers


def test_feasible_is_status_0(ask):
    status, out, err = ask("check", "paper/4a", "--json")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, err) == (0, "")
    assert (found["verdict"], found["evidence"]) == ("feasible", "witness")
    assert (found["cells"], found["covered"], found["edges"]) == (90, 90, 305)
    assert (found["robot"], found["seed"], found["version"]) == ("puma560", 0, version())


def test_infeasible_is_status_1(ask):
    status, out, err = ask("check", "paper/4f", "--json")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, err) == (1, "")
    assert (found["verdict"], found["evidence"], found["certificate"]) == (
        "infeasible",
        "proof",
        None,
    )
    assert len(found["uncovered"]) == 84


def test_undecided_is_status_3(ask):
    status, out, err = ask(
        "check", "paper/5f", "--json", "--set", "search.time_limit=1e-9", "--set", "search.seed=4"
    )
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, err) == (3, "")
    assert (found["verdict"], found["evidence"], found["seed"]) == ("undecided", "budget", 4)


def test_the_answer_for_people_comes_first(ask, plate):
    status, out, err = ask("check", plate)
    assert (status, err) == (0, "")
    assert out.startswith("feasible: ")
    status, out, err = ask("check", plate, "--set", "surface.u=[1.5, 2.5]")
    assert (status, err) == (1, "")
    assert out.startswith("infeasible: ")
    assert "12 cells: out of reach" in out


def test_the_greedy_search_can_be_asked_for(ask):
    dome = ("check", "paper/4a", "--json", "--set", "surface.cells=[2, 2]")
    status, out, _ = ask(*dome, "--set", "search.method=greedy", "--set", "search.step_deg=1")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, found["verdict"], found["method"]) == (0, "feasible", "greedy")
    assert (found["covered"], found["edges"]) == (4, 6)


# bad input


@pytest.mark.parametrize(
    "name",
    [
        "not toml",
        "unknown robot",
        "radius NaN",
        "misspelt kind",
        "missing mesh",
    ],
)
def test_a_bad_case_is_status_2_and_one_message(name, ask, tmp_path):
    """Every bad case is read in test_approved.py; these come from different readers."""
    path = write(tmp_path, BAD_CASES[name].content)
    status, out, err = ask("check", path, "--json")
    assert out == ""
    text = message(err, status)
    assert text.startswith(path)
    for words in BAD_CASES[name].words:
        assert words in text


def test_a_bad_case_as_a_process(tmp_path):
    bad = BAD_CASES["nested too deeply"]
    done = run("check", write(tmp_path, bad.content))
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    assert all(words in done.stderr for words in bad.words)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ((), "COMMAND"),
        (("chek",), "invalid choice: 'chek'"),
        (("check",), "CASE"),
        (("check", "paper/4a", "--jsn"), "--jsn"),
        (("check", "paper/4a", "--js"), "--js"),
        (("check", "paper/4a", "extra"), "extra"),
        (("check", "paper/4a", "--set"), "expected one argument"),
        (("check", "paper/4a", "--set", "cone_deg"), "has no '='"),
        (("check", "paper/4a", "--set", "task.cone_deg=-1"), "task.cone_deg: must lie in 0 .. 180"),
        (("check", "paper/4z"), "neither a built-in case nor a file"),
        (("check", "nowhere.toml"), "nowhere.toml: there is no such file"),
        (("check", "/dev/zero"), "is not a regular file"),
        (("check", "."), "is a folder"),
        (("check", ""), "neither a built-in case nor a file"),
        (("check", "paper/4a", "--html", "no/such/view.html"), "there is no folder no/such"),
        (("check", "paper/4a", "--save", "."), "is a folder"),
        (("check", "paper/4a", "--save", "a", "--html", "./a"), "is also the file of --save"),
        (("show",), "RESULT"),
        (("show", "nowhere"), "there is no such file"),
        (("show", __file__), "is not a result file"),
        (("robots", "--all"), "--all"),
    ],
)
def test_mistakes_in_the_arguments_are_status_2(ask, args, words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    status, out, err = ask(*args)
    assert out == ""
    assert words in message(err, status)


def test_outputs_are_checked_before_the_search(ask, monkeypatch, plate):
    def never(*_, **__):
        raise AssertionError("the search must not run")

    monkeypatch.setattr(feasibility.checking, "check", never)
    outputs = ("--save", "no/a", "--html", "no/b", "--witness", "no/c")
    status, _, err = ask("check", plate, *outputs)
    text = message(err, status)
    assert all(f"{flag} no/" in text for flag in ("--save", "--html", "--witness"))


def test_a_bug_says_that_it_is_one(ask, monkeypatch, plate, capsys):
    def broken(*_, **__):
        raise KeyError("a slip")

    monkeypatch.setattr(feasibility.checking, "check", broken)
    status, out, err = ask("check", plate)
    assert (status, out) == (2, "")
    assert "this is a bug in coverable: KeyError: 'a slip'" in err
    assert "COVERABLE_TRACEBACK=1" in err
    monkeypatch.setenv("COVERABLE_TRACEBACK", "1")
    assert cli.main(["check", plate]) == 2
    assert "Traceback (most recent call last)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "x"), "x: No space left on device"),
        (MemoryError(), "not enough memory; use fewer cells"),
        (ImportError("libpinocchio.so: cannot open"), "libpinocchio.so: cannot open"),
    ],
)
def test_trouble_of_the_machine_is_status_2_and_no_bug(ask, monkeypatch, plate, error, words):
    def troubled(*_, **__):
        raise error

    monkeypatch.setattr(feasibility.checking, "check", troubled)
    status, _, err = ask("check", plate)
    assert words in message(err, status)
    assert "bug" not in err


def test_what_a_library_says_of_an_interrupt_is_no_error(ask, monkeypatch, plate):
    def broken(*_, **__):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise ImportError("some part of it failed to import")

    monkeypatch.setattr(feasibility.checking, "check", broken)
    assert ask("check", plate) == (130, "", "coverable: interrupted\n")


# outputs


def test_outputs_are_written_and_named(ask, plate, tmp_path):
    walk, saved, page = (tmp_path / name for name in ("walk.csv", "a.result", "view.html"))
    status, out, err = ask(
        "check", plate, "--json", "--witness", walk, "--save", saved, "--html", page
    )
    assert status == 0
    assert json.loads(out)["covered"] == 12
    assert [line.split(":")[0] for line in err.splitlines()] == ["result", "view", "witness"]
    assert all(str(path) in err for path in (walk, saved, page))

    verdict = load_result(saved).verdict
    assert verdict.feasible
    header, *rows = csv.reader(walk.read_text().splitlines())
    assert header == ["cell", *verdict.robot.joint_names]
    assert [[float(value) for value in row[1:]] for row in rows] == verdict.witness.q.tolist()
    assert {row[0] for row in rows} - {""} == {str(cell) for cell in range(12)}
    assert page.read_text().lstrip().lower().startswith("<!doctype html>")


def test_the_witness_in_the_json(ask, plate, tmp_path):
    """The same numbers as in the file."""
    walk = tmp_path / "walk.csv"
    assert ask("check", plate, "--witness", walk)[0] == 0
    header, *rows = csv.reader(walk.read_text().splitlines())
    status, out, err = ask("check", plate, "--json", "--witness", "-")
    assert (status, err) == (0, "")
    found = json.loads(out)
    witness = found.pop("witness")
    conforms(found, CHECK)
    assert list(witness) == ["joints", "q", "cell"]
    assert witness["joints"] == header[1:]
    assert witness["q"] == [[float(value) for value in row[1:]] for row in rows]
    assert witness["cell"] == [int(row[0]) if row[0] else None for row in rows]


def test_where_there_is_no_witness_the_json_has_null(ask):
    status, out, _ = ask("check", "paper/4f", "--json", "--witness", "-")
    assert (status, json.loads(out)["witness"]) == (1, None)


def test_the_witness_goes_to_stdout_within_json_only(ask, plate):
    status, _, err = ask("check", plate, "--witness", "-")
    assert "--witness -: goes with --json" in message(err, status)


def test_no_witness_is_written_for_an_infeasible_case(ask, tmp_path):
    walk = tmp_path / "walk.csv"
    status, _, err = ask("check", "paper/4f", "--witness", walk)
    assert status == 1
    assert "nothing written" in err
    assert "is infeasible" in err
    assert not walk.exists()


def test_a_result_shows_as_a_page(ask, tmp_path):
    save_result(small_verdict("long plate"), small_case("long plate"), tmp_path / "a")
    status, out, err = ask("show", tmp_path / "a", "--html", tmp_path / "view.html")
    assert status == 0
    assert out.startswith("long plate: infeasible (proof): ")
    assert str(tmp_path / "view.html") in err
    assert "long plate" in (tmp_path / "view.html").read_text()


def test_show_serves_the_view_until_ctrl_c(ask, monkeypatch, tmp_path):
    save_result(small_verdict("plate"), small_case("plate"), tmp_path / "a")
    seen = []

    def wait(live):
        with urllib.request.urlopen(live.url, timeout=GUARD_S) as page:
            seen.append((live.url, page.read()))
        raise KeyboardInterrupt

    monkeypatch.setattr(LiveView, "wait", wait)
    status, out, err = ask("show", tmp_path / "a", "--no-browser")
    ((url, page),) = seen
    assert (status, err.strip()) == (0, f"view: {url} (served until Ctrl-C)")
    assert b"plate: feasible" in page
    assert out.startswith("plate: feasible (witness): ")


def test_a_reader_that_leaves_is_no_error():
    first, rest = os.pipe()
    os.close(first)
    child = subprocess.run(
        [*COMMAND, "cases"], stdout=rest, stderr=subprocess.PIPE, timeout=GUARD_S, check=False
    )
    os.close(rest)
    assert (child.returncode, child.stderr) == (0, b"")


def test_a_full_disk_under_stdout_is_status_2():
    with open("/dev/full", "w") as full:
        child = subprocess.run(
            [*COMMAND, "cases"], stdout=full, stderr=subprocess.PIPE, timeout=GUARD_S, check=False
        )
    assert (child.returncode, child.stderr) == (2, b"coverable: No space left on device\n")


def test_answers_survive_a_narrow_encoding(tmp_path):
    arm = write(tmp_path, GOOD.replace("puma560", "пума"))
    done = run("check", arm, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 2
    assert "is not" in done.stderr or "there is no robot" in done.stderr
    assert "Traceback" not in done.stderr


# lists


def test_cases_lists_the_built_in_ones(ask):
    status, out, err = ask("cases")
    assert (status, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()[1:]] == list(builtin_cases())
    status, out, _ = ask("cases", "--json")
    rows = json.loads(out)["cases"]
    assert status == 0
    assert [row["name"] for row in rows] == list(builtin_cases())
    assert rows[0]["cells"] == [9, 10]


# start and progress


@pytest.mark.parametrize("args", [["--help"], ["check", "--help"], ["--version"], ["chek"]])
def test_help_loads_no_heavy_library(args):
    program = "import sys; from feasibility.cli.main import main; status = main(sys.argv[1:])\n"
    program += "print(sorted({m.partition('.')[0] for m in sys.modules}), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", program, *args], capture_output=True, text=True, check=True
    )
    loaded = done.stderr.splitlines()[-1]
    assert "'feasibility'" in loaded
    for library in ("numpy", "pinocchio", "scipy", "networkx", "numba", "rich", "robots"):
        assert f"'{library}'" not in loaded


def test_a_plain_check_loads_only_what_it_needs():
    program = "import sys; from feasibility.cli.main import main; status = main(sys.argv[1:])\n"
    program += "print(*sys.modules, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", program, "check", "paper/4a"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    loaded = set(done.stderr.split())
    assert {"numba", "pinocchio", "feasibility.roadmap.complete"} <= loaded
    late = {
        "networkx",
        "scipy.spatial",
        "scipy.optimize",
        "trimesh",
        "matplotlib",
        "urllib.request",
    }
    late |= {"feasibility.collisions.gathering", "feasibility.paper.greedy", "surfaces.passes"}
    assert not late & loaded


def test_help_and_version_answer_on_stdout(ask):
    status, out, err = ask("--help")
    assert (status, err) == (0, "")
    assert all(command in out for command in ("check", "cases", "robots", "show"))
    status, out, err = ask("check", "--help")
    assert (status, err) == (0, "")
    for flag in ("--json", "--witness", "--save", "--html", "--set"):
        assert flag in out
    assert "0 feasible, 1 infeasible, 3 undecided, 2 bad input" in out
    assert ask("--version") == (0, f"coverable {version()}\n", "")


def test_the_installed_command_is_this_one():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    # Its import makes Ctrl-C end this process: test_interrupts runs it in one of its own.
    assert project["scripts"] == {"coverable": "coverable_command:run"}


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_shows_on_a_terminal_and_nowhere_else(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with console.Bar() as bar:
        bar(1, 1, "looking")
    assert sys.stderr.getvalue() == ""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with console.Bar() as bar:
        bar(1, None, "looking [around]")
        bar(9, 9, "cells")
    assert "9/9" in sys.stderr.getvalue()


def test_a_terminal_sees_progress_and_a_file_does_not(plate):
    """The bar goes to stderr's terminal; stdout holds the answer alone."""
    program = "import sys, feasibility.checking as c; from feasibility.cli.main import main\n"
    program += "real = c.check\n"
    program += "def told(*a, clock, **more):\n"
    program += "    clock.report(3, 12, 'a search'); return real(*a, clock=clock, **more)\n"
    program += "c.check = told; sys.exit(main(sys.argv[1:]))"
    leader, follower = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-c", program, "check", plate, "--json"],
        stdout=subprocess.PIPE,
        stderr=follower,
        env={**os.environ, "TERM": "xterm"},
    )
    os.close(follower)
    seen = b""
    while True:
        try:
            chunk = os.read(leader, 4096)
        except OSError:  # the other end has closed
            break
        if not chunk:
            break
        seen += chunk
    out, _ = child.communicate(timeout=GUARD_S)
    os.close(leader)
    assert child.returncode == 0
    assert json.loads(out)["verdict"] == "feasible"
    assert b"a search" in seen


@pytest.mark.parametrize(("answer", "status"), [*zip(Answer, (0, 1, 3), strict=True)])
def test_every_answer_has_its_status(ask, monkeypatch, plate, answer, status):
    plain = small_verdict("long plate")

    def said(*_, **__):
        fields = {name: getattr(plain, name) for name in Verdict.__dataclass_fields__}
        return Verdict(**{**fields, "answer": answer, "evidence": Evidence.BUDGET})

    monkeypatch.setattr(feasibility.checking, "check", said)
    assert command.STATUS[answer] == status
    assert ask("check", plate)[0] == status


def test_a_long_wait_for_kernels_is_explained(monkeypatch):
    def out_of_patience():
        for thread in threading.enumerate():
            if isinstance(thread, threading.Timer):
                thread.join()

    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with compiling_notice(patience=1e6):
        numba.njit(lambda x: x + 1)(1)
    assert sys.stderr.getvalue() == ""
    with compiling_notice(patience=0.0):
        out_of_patience()  # but nothing is compiled
    assert sys.stderr.getvalue() == ""
    with compiling_notice(patience=0.0):
        out_of_patience()
        numba.njit(lambda x: x + 1)(1)
        numba.njit(lambda x: x + 2)(1)
    assert sys.stderr.getvalue() == NOTICE + "\n"


def test_what_says_itself_what_it_compiles_is_not_said_around_it(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with compiling_notice(patience=0.0):
        with compiling_notice(patience=0.0, notice=notices.COLLISIONS):
            for thread in threading.enumerate():
                if isinstance(thread, threading.Timer):
                    thread.join()
            numba.njit(lambda x: x + 1)(1)
        assert sys.stderr.getvalue() == notices.COLLISIONS + "\n"
        numba.njit(lambda x: x + 2)(1)
    assert sys.stderr.getvalue() == notices.COLLISIONS + "\n" + NOTICE + "\n"


def test_what_is_compiled_is_said_once_for_each_purpose(monkeypatch, plate, capsys):
    """Cutting surfaces and the search, each with its own words."""
    monkeypatch.setattr(notices, "PATIENCE", 0.0)

    def compiling(real):
        def first(*args, **more):
            for _ in range(2):  # kernels of one purpose
                numba.njit(lambda x: x + 1)(1)
            return real(*args, **more)

        return first

    monkeypatch.setattr(Case, "build", compiling(Case.build))
    monkeypatch.setattr(complete, "warm_up", compiling(complete.warm_up))
    assert cli.main(["check", plate]) == 0
    assert sorted(capsys.readouterr().err.splitlines()) == sorted([notices.CUTTING, NOTICE])
    assert len({notices.CUTTING, notices.GREEDY, NOTICE}) == 3
