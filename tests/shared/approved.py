"""Approved texts: what is said and printed, kept as files that people read when they change.

`pytest --accept` writes them anew, and git shows what changed. What differs from one machine or run
to the next is masked first.
"""

import difflib
import re
from pathlib import Path

import pytest

from coverable.errors import CoverableError

MASKS = ((re.compile(r"\d+(\.\d+)? s\b"), "# s"), (re.compile(r"\b(pid|port) \d+"), r"\1 #"))
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")


def refused(make, *arguments, **named) -> str:
    """What is said by a refusal, on one line."""
    with pytest.raises(CoverableError) as caught:
        make(*arguments, **named)
    return " / ".join(str(caught.value).splitlines())


class Approved:
    """Compares texts with files of `approved/` beside the test."""

    def __init__(self, folder: Path, temporary: Path, accept: bool) -> None:
        self.folder, self.temporary, self.accept = folder, temporary, accept

    def masked(self, text: str) -> str:
        """Without folders of this run, and without times."""
        text = text.replace(str(self.temporary), "FOLDER")
        for found, instead in MASKS:
            text = found.sub(instead, text)
        return text.rstrip() + "\n"

    def __call__(self, name: str, text: str, *, numbers: bool = True) -> None:
        """Fail unless this is the approved text `name`; with `numbers=False` all numbers are #."""
        __tracebackhide__ = True
        path, text = self.folder / f"{name}.txt", self.masked(text)
        text = text if numbers else NUMBER.sub("#", text)
        if self.accept:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
        known = path.read_text("utf-8") if path.is_file() else ""
        changes = difflib.unified_diff(known.splitlines(), text.splitlines(), n=0, lineterm="")
        told = f"not what {path} has approved; pytest --accept writes it, git shows it, read it"
        assert text == known, "\n".join([told, *changes])


@pytest.fixture
def approved(request: pytest.FixtureRequest, tmp_path: Path) -> Approved:
    """approved(name, text): is it word for word what tests/.../approved/name.txt says?"""
    folder = request.path.parent / "approved"
    return Approved(folder, tmp_path, request.config.getoption("accept"))
