"""Arms of the catalogue robot_descriptions (the extra `coverable[arms]`), which git fetches.

The catalogue names for each arm a public repository and a commit, and where in it the URDF lies;
importing its module clones. That is done in a process of its own, after a word on stderr, and only
where the commit is not here yet. What it leaves is a file like any other: `check_urdf` reads it.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from robots.errors import RobotError

EXTRA = "needs the extra: pip install 'coverable[arms]'"
FOLDER, COMMIT = "ROBOT_DESCRIPTIONS_CACHE", "ROBOT_DESCRIPTION_COMMIT"  # as the catalogue reads
# git asks no questions, and gives up where nothing arrives for a minute.
PATIENCE = {
    "GIT_TERMINAL_PROMPT": "0",
    "GIT_HTTP_LOW_SPEED_LIMIT": "1000",
    "GIT_HTTP_LOW_SPEED_TIME": "60",
}
SHA = re.compile("[0-9a-f]{40}")
ASK = """
import json, sys
from importlib import import_module
found = vars(import_module("robot_descriptions." + sys.argv[1]))
names = ("URDF_PATH", "XACRO_PATH", "XACRO_ARGS", "PACKAGE_PATH", "REPOSITORY_PATH")
names += ("XACRO_PACKAGE_PATHS",)
print(json.dumps({name: found[name] for name in names if name in found}))
"""


class Description(NamedTuple):
    """The files of an arm."""

    path: str
    """Of the URDF or .xacro file."""
    folders: tuple[str, ...]
    """With its packages."""
    xacro_args: dict[str, str]


class Source(NamedTuple):
    """Where a description comes from, and where it lies."""

    url: str
    commit: str
    folder: Path
    """The clone, which need not be there."""

    @property
    def is_here(self) -> bool:
        """Whether git has checked the commit out, which it notes at the end."""
        try:
            head = (self.folder / ".git" / "HEAD").read_text(encoding="ascii").strip()
        except (OSError, ValueError):
            return False
        return head == self.commit or (not SHA.fullmatch(self.commit) and bool(SHA.fullmatch(head)))


def is_here(module: str) -> bool:
    """Whether a description has been fetched; False without the extra."""
    return find_spec("robot_descriptions") is not None and source(module).is_here


def source(module: str) -> Source:
    """Where the description of that module comes from; fetches nothing.

    Raises:
        RobotError: the extra is not installed.
    """
    if find_spec("robot_descriptions") is None:
        raise RobotError(EXTRA, f"robot {module!r}")
    from robot_descriptions import DESCRIPTIONS
    from robot_descriptions._repositories import REPOSITORIES

    repository = REPOSITORIES[str(DESCRIPTIONS[module].repository)]
    commit, name = os.environ.get(COMMIT), repository.cache_path
    place = os.path.expanduser(os.environ.get(FOLDER, "~/.cache/robot_descriptions"))
    folder = Path(place) / (name if commit is None else f"{name}-{commit}/{name}")
    return Source(repository.url, repository.commit if commit is None else commit, folder)


def description(module: str) -> Description:
    """The files of an arm, fetched first where they are not here.

    Raises:
        RobotError: the extra or git is not installed, or the repository cannot be fetched.
    """
    return _described(module, source(module))


@cache
def _described(module: str, where: Source) -> Description:
    """The same; nothing of what could not be fetched is kept."""
    found = _asked(module, where) if where.is_here else _fetched(module, where)
    folders = (found["PACKAGE_PATH"], found["REPOSITORY_PATH"])
    further = tuple(found.get("XACRO_PACKAGE_PATHS", {}).values())
    if "URDF_PATH" in found:
        return Description(found["URDF_PATH"], (*folders, *further), {})
    return Description(found["XACRO_PATH"], (*folders, *further), found.get("XACRO_ARGS", {}))


def _fetched(module: str, where: Source) -> dict[str, Any]:
    """What the module of an arm says, whose repository is cloned by one process at a time."""
    try:
        where.folder.parent.mkdir(parents=True, exist_ok=True)
        with open(where.folder.parent / "coverable.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not where.is_here:
                _say(
                    f"fetching {where.url} at {where.commit[:12]} into {where.folder}, once, for "
                    f"the arm {module} (with its drawings, often tens of megabytes) ..."
                )
            return _asked(module, where)
    except OSError as error:
        raise RobotError(_offline(str(error), where), f"robot {module!r}") from error


def _asked(module: str, where: Source) -> dict[str, Any]:
    """What the module of an arm says once it is imported, which may clone."""
    if shutil.which("git") is None:
        raise RobotError(_offline("git is not installed", where), f"robot {module!r}")
    done = subprocess.run(
        [sys.executable, "-P", "-c", ASK, module],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        env=PATIENCE | os.environ,
        check=False,
    )
    if done.returncode == 0:
        return dict(json.loads(done.stdout.splitlines()[-1]))  # its own words come before
    said = re.findall(r"stderr: '((?:fatal|error): .*)", done.stderr) or done.stderr.splitlines()
    why = said[-1].strip(" '") if said else "its process broke off"
    raise RobotError(_offline(why, where), f"robot {module!r}")


def _offline(why: str, where: Source) -> str:
    """What is wrong, and what would do."""
    return (
        f"cannot be fetched from {where.url} ({why[:300]}); where there is a network: git clone "
        f"{where.url} {where.folder}, then git -C {where.folder} checkout {where.commit}; "
        f"bring that folder here, or name another one in {FOLDER}. Or give a URDF of your own: "
        'urdf = "my_arm.urdf" in a case, load_robot("my_arm.urdf") in Python'
    )


def _say(text: str) -> None:
    """A line on stderr, if there is one."""
    if sys.stderr is not None:
        sys.stderr.write(text + "\n")
        sys.stderr.flush()
