"""Readers of untrusted files in processes of their own: started, waited for, and heard.

Shared by the packages, which know nothing of each other. The process runs a script that imports
nothing of the project; it has no environment, and caps on memory, processor time and output.
"""

from __future__ import annotations

import os
import resource
import runpy
import signal
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple


class Limits(NamedTuple):
    """What a process may use."""

    memory: int
    """bytes of address space"""
    seconds: int
    """Of processor time."""
    output: int
    """bytes of the largest file that it may write"""


class Ended(NamedTuple):
    """What a process left behind."""

    written: bytes
    """At most as many bytes as `Limits.output`."""
    too_slow: bool = False
    """It used up its processor time."""
    too_late: bool = False
    """It was still there when the waiting was over."""


def run_apart(script: Path, given: bytes, waiting: float, limits: Limits) -> Ended:
    """Run a script of ours in a Python without environment and site packages.

    Args:
        script: the file.
        given: to its standard input.
        waiting: s, after which it is killed.
        limits: of the process; of what it writes no more is taken.
    """
    command = [sys.executable, "-I", "-S", "-B", "-X", "utf8", __file__, str(script)]
    command += map(str, limits)
    with tempfile.TemporaryFile() as written:
        try:
            done = subprocess.run(
                command,
                input=given,
                stdout=written,
                stderr=subprocess.DEVNULL,
                env={},
                timeout=waiting,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Ended(b"", too_late=True)
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            return Ended(b"", too_slow=True)
        written.seek(0)
        there = os.fstat(written.fileno()).st_size  # room is taken for all that read() is asked for
        return Ended(written.read(min(there, limits.output)))


def folder_of(package: str) -> str | None:
    """The folder that a package is imported from; None where it is not installed."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:  # a folder of that name has no origin
        return None
    return str(Path(spec.origin).parent.parent)


def _limit(kind: int, most: int) -> None:
    hard = resource.getrlimit(kind)[1]
    most = most if hard == resource.RLIM_INFINITY else min(most, hard)
    try:
        resource.setrlimit(kind, (most, hard))
    except (ValueError, OSError):  # macOS does not limit memory
        return


def _run_limited(script: str, limits: Limits) -> None:
    """What the process does."""
    _limit(resource.RLIMIT_CORE, 0)
    _limit(resource.RLIMIT_AS, limits.memory)
    _limit(resource.RLIMIT_CPU, limits.seconds)
    _limit(resource.RLIMIT_FSIZE, limits.output)
    runpy.run_path(script, run_name="__main__")


if __name__ == "__main__":
    _run_limited(sys.argv[1], Limits(*map(int, sys.argv[2:])))
