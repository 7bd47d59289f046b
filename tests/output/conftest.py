"""The commands of commands.toml, and `ask`."""

from collections.abc import Callable

import pytest
from command_table import Commands
from jobs import Said, run_coverable


@pytest.fixture
def ask() -> Callable[..., Said]:
    """ask(arguments) -> status, stdout, stderr of a command that runs in this process."""
    return run_coverable


@pytest.fixture(scope="session")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Commands:
    """commands.run(command, name, *more): what a command of the table says."""
    return Commands(tmp_path_factory.mktemp("commands"))
