"""Languages of robot controllers, and by which names of files they are chosen."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from coverable.errors import alternatives
from feasibility.read_files import FileError, shown_path


@dataclass(frozen=True, slots=True)
class Language:
    """One language of programs."""

    name: str
    ending: str
    """Of its files, by which it is chosen."""
    maker: str
    external: tuple[str, ...]
    """What it calls external axes; none where it has none."""
    axes: tuple[str, ...]
    """What the six axes of the arm are called."""
    unit: Literal["rad", "deg", "pulses"] = "deg"
    """Of the axes of the arm."""
    digits: int = 4
    """Decimals of these."""
    time_digits: int = 4
    """Decimals of times in s."""
    period: float = 0.1
    """s between points, by default."""
    frame: str = "X Y Z Rx Ry Rz"
    """What mm and degrees (about axes as they stand) of a frame are called; see `frame_words`."""


def _numbered(name: str) -> tuple[str, ...]:
    """The names of six axes."""
    return tuple(name.format(k + 1) for k in range(6))


URSCRIPT = Language(
    "URScript", "script", "Universal Robots", (), _numbered("joint {}"), "rad", 7, period=0.02
)
RAPID = Language(
    "RAPID", "mod", "ABB", tuple(f"eax_{letter}" for letter in "abcdef"), _numbered("rax_{}")
)
KRL = Language("KRL", "src", "KUKA", _numbered("E{}"), _numbered("A{}"))
TP = Language("TP", "ls", "FANUC", (), _numbered("J{}"), time_digits=3, frame="X Y Z W P R")
INFORM = Language("INFORM", "jbi", "Yaskawa", (), tuple("SLURBT"), "pulses", 0)
LANGUAGES = (URSCRIPT, RAPID, KRL, TP, INFORM)
NAMED = alternatives([f".{each.ending} ({each.maker} {each.name})" for each in LANGUAGES])


def language_of(path: str | os.PathLike[str]) -> Language:
    """The language of a file's ending.

    Raises:
        FileError: it is no ending of a program.

    Example:
        >>> language_of("cell.mod").name
        'RAPID'
    """
    ending = Path(path).suffix.lower().lstrip(".")
    for language in LANGUAGES:
        if language.ending == ending:
            return language
    raise FileError(f"expected the name of a program, which ends in {NAMED}", shown_path(path))
