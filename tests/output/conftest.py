"""The commands of commands.toml, and `ask`."""

from __future__ import annotations

import pytest
from ask import ask  # noqa: F401
from command_table import Commands


@pytest.fixture(scope="session")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Commands:
    """commands.run(command, name, *more): what a command of the table says."""
    return Commands(tmp_path_factory.mktemp("commands"))
