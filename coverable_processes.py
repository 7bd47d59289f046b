"""Readers of untrusted files in processes of their own: started, waited for, and heard.

Shared by the packages, which know nothing of each other. The process is a script that imports
nothing of the project, has no environment, and puts caps on itself.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple


class Ended(NamedTuple):
    """What a process left behind."""

    written: bytes
    """At most as much as was asked for."""
    too_slow: bool = False
    """It used up its processor time."""
    too_late: bool = False
    """It was still there when the waiting was over."""


def run_apart(script: Path, given: bytes, waiting: float, most: int) -> Ended:
    """Run a script of ours in a Python without environment and site packages.

    Args:
        script: the file.
        given: to its standard input.
        waiting: s, after which it is killed.
        most: bytes that are taken of what it writes.
    """
    command = [sys.executable, "-I", "-S", "-B", "-X", "utf8", str(script)]
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
        return Ended(written.read(most))
