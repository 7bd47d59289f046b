"""Which coverable this is."""

from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


@cache
def version() -> str:
    """The version of the installed distribution; "unknown" where the code runs uninstalled."""
    try:
        return installed_version("coverable")
    except PackageNotFoundError:
        return "unknown"
