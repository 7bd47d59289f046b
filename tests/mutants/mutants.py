"""Small faults, put into the product one at a time: which of them do the tests of their room find?

`mutants.toml` lists them. Each is one edit in a file of the product, given by what is there and
what takes its place, and not by a line; it has to match exactly once. The tree is copied to a
temporary folder, and the tests of a room have to pass there first. Then each fault is put into a
copy of that, and the tests run until one fails, those first that found a fault before: ten times as
fast. A fault that no test finds survives.

    python tests/mutants/mutants.py [REGEX]      those whose room, file, edit or words match
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("mutants.toml")
LEFT_OUT = (".git", ".venv", "out", "notebooks", "build", "dist", ".*_cache", ".hypothesis")
SECONDS = 900  # after which a fault counts as found
FAILED = (1, 2)  # pytest's status where tests fail, or cannot be imported
FINDERS = "MUTANTS_FOUND_BY"  # tests that found a fault before, for pytest's child


class Mutant(NamedTuple):
    """One fault."""

    room: str
    file: str
    old: str
    new: str
    words: str
    tests: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.file}: {self.words}"

    def faults(self, root: Path = ROOT) -> Iterator[str]:
        """Why it cannot be put in; nothing where it can."""
        text = (root / self.file).read_text("utf-8") if (root / self.file).is_file() else None
        times = 0 if text is None else text.count(self.old)
        if text is None:
            yield f"{self}: there is no such file"
        elif times != 1:
            yield f"{self}: {self.old!r} is there {times} times, and has to be there once"
        elif self.old == self.new:
            yield f"{self}: changes nothing"
        for test in self.tests:
            file, _, name = test.partition("::")
            text = (root / file).read_text("utf-8") if (root / file).exists() else ""
            if f"def {name.partition('[')[0]}" not in text:
                yield f"{self}: there are no tests {test}"

    def put_into(self, root: Path) -> None:
        """Edit the file in a copy of the tree, whose files may be links to those of another."""
        path = root / self.file
        text = path.read_text("utf-8").replace(self.old, self.new)
        path.unlink()
        path.write_text(text, "utf-8")


def mutants() -> list[Mutant]:
    """All of the list, in its order."""
    found = []
    for room, entries in tomllib.loads(LIST.read_text("utf-8")).items():
        file, tests = "", list[str]()
        for entry in entries:
            if isinstance(entry, list):
                old, new, words, *other = entry
                own = other[0].split() if other else tests
                found.append(Mutant(room, file, old, new, words, tuple(own)))
            elif entry.startswith("tests/"):
                file, tests = "", [*([] if file else tests), entry]
            else:
                file = entry
    return found


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """As a plugin of the child: tests that found a fault before come first."""
    finders = os.environ[FINDERS].split("\n")
    items.sort(key=lambda item: item.nodeid not in finders)


def passes(
    tests: tuple[str, ...], root: Path, finders: set[str], seconds: float | None = None
) -> bool:
    """Do tests pass in a copy of the tree? Not where they take longer than that.

    Args:
        tests, root, seconds: what pytest is given, where, and for how long.
        finders: tests that come first; the one that fails is added.

    Raises:
        SystemExit: there are no such tests.
    """
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    command += ["-p", Path(__file__).stem, *tests]
    path = os.pathsep.join([str(root), str(root / "tests/mutants")])
    surroundings = os.environ | {"PYTHONPATH": path, FINDERS: "\n".join(finders)}
    with subprocess.Popen(
        command, cwd=root, env=surroundings, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as running:  # fmt: skip
        try:
            said, _ = running.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            return False
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(running.pid, signal.SIGKILL)  # what the tests started, too
    if running.returncode > max(FAILED):  # below 0 a fault ended the process: it is found
        sys.exit(f"pytest cannot run {' '.join(tests)}:\n{said}")
    finders.update(re.findall(r"^FAILED (\S+)", said, re.MULTILINE))
    return running.returncode == 0


def survivors(chosen: list[Mutant]) -> list[Mutant]:
    """Those that no test finds; each is said as soon as it is known.

    Raises:
        SystemExit: tests do not pass without any fault.
    """
    left = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        whole, copy = Path(folder, "whole"), Path(folder, "copy")
        shutil.copytree(ROOT, whole, symlinks=True, ignore=shutil.ignore_patterns(*LEFT_OUT))
        finders = dict[tuple[str, ...], set[str]]()
        for one in chosen:
            if one.tests not in finders and not passes(one.tests, whole, set()):
                sys.exit(f"{' '.join(one.tests)}: fails without any fault")
            found_by = finders.setdefault(one.tests, set())
            begin = time.monotonic()
            # Links: compiled kernels come along, and what this fault leaves behind goes with it.
            shutil.copytree(whole, copy, symlinks=True, copy_function=os.link)
            one.put_into(copy)
            survives = passes(one.tests, copy, found_by, SECONDS)
            shutil.rmtree(copy)
            left += [one] if survives else []
            became, took = "SURVIVES" if survives else "found", time.monotonic() - begin
            print(f"{became:8} {took:4.0f} s  {one}", flush=True)
    return left


def main(pattern: str = "") -> int:
    """Try the faults that match; 1 where some survive, 2 where some cannot be put in."""
    every = mutants()
    wrong = [fault for one in every for fault in one.faults()]
    chosen = [one for one in every if re.search(pattern, "\n".join(map(str, one[:5])))]
    if wrong or not chosen:
        print("\n".join(wrong) or f"no fault matches {pattern!r}", file=sys.stderr)
        return 2
    left = survivors(chosen)
    print(f"\n{'room':32} {'faults':>6} {'found':>6} {'survive':>8}")
    rooms = {one.room: [each for each in chosen if each.room == one.room] for one in chosen}
    for room, own in [*rooms.items(), ("all", chosen)]:
        alive = sum(one in left for one in own)
        print(f"{room:32} {len(own):6} {len(own) - alive:6} {alive:8}")
    for one in left:
        print(f"survives: {one}\n    {one.old!r} -> {one.new!r}")
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
