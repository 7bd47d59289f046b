"""Commands in this process: arguments in; status, stdout and stderr out."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable
from typing import NamedTuple

import pytest

from feasibility.cli import main as cli


class Said(NamedTuple):
    """What a command said."""

    status: int
    out: str
    err: str


def asked(*args: object) -> Said:
    """Run `coverable` with these arguments."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.main([str(arg) for arg in args])
    assert "Traceback" not in err.getvalue()
    # A busy machine may take a while to load kernels; that it says so has its own test.
    said = re.sub(r"compiling .*first run only.*\n", "", err.getvalue())
    return Said(status, out.getvalue(), said)


@pytest.fixture
def ask() -> Callable[..., Said]:
    """ask(arguments) -> status, stdout, stderr of a command that runs in this process."""
    return asked
