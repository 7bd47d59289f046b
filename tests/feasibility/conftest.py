"""What the tests of commands share."""

from __future__ import annotations

import re

import pytest

from feasibility.cli import main as cli


@pytest.fixture
def ask(capsys):
    """Run the command in this process: ask(arguments) -> status, stdout, stderr."""

    def asked(*args):
        status = cli.main([str(arg) for arg in args])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        # A busy machine may take a while to load kernels; that it says so has its own test.
        return status, out, re.sub(r"compiling .*first run only.*\n", "", err)

    return asked
