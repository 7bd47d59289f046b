"""What all tests share: made-up inputs that do not depend on what ran before, and Ctrl-C."""

import gc
import signal
from pathlib import Path

import pytest
import samples
from approved import approved  # noqa: F401
from hypothesis import HealthCheck, settings

# However long a busy machine takes over an example, or over making them up; drawn from the same
# numbers each time. (Hypothesis adds some out of those of our modules that are loaded by then.)
settings.register_profile(
    "suite", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("campaign", settings.get_profile("suite"), max_examples=2000)
settings.load_profile("suite")

# A shell lets its background jobs ignore Ctrl-C, and their children with them. Tests that interrupt
# a command they started wait for it in vain, unless it starts with Python's own handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Collecting the tests makes no garbage to speak of.
gc.disable()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--accept", action="store_true", help="write approved texts anew")
    parser.addoption("--samples", choices=("few", "all"), default="few", help="how much is drawn")


def pytest_configure(config: pytest.Config) -> None:
    """Say how much is drawn at random before tests are collected."""
    config.addinivalue_line("markers", "sampled: a campaign runs more of it (--samples=all)")
    if config.getoption("samples") == "all":
        samples.EVERYTHING = True
        settings.load_profile("campaign")


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """What tests share holds no examples, and need not be imported to look for them."""
    asking = collection_path.name.startswith(("test_", "bench_"))
    shared = collection_path.suffix == ".py" and not asking
    return True if shared else None


def pytest_collection_finish() -> None:
    """What is loaded by now stays: collections of garbage need not look through it each time."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # they would be a twentieth of all processor time otherwise
    gc.enable()
