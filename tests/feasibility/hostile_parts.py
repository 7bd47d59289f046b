"""What robots with hostile pictures are made of."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path

Maker = Callable[[random.Random, Path], tuple[str, str]]
"""Writes files, and gives the mesh's name and the words of the note (a pattern)."""

TRIANGLE = "0 0 0 1 0 0 0 1 0"
DRAWN = ""
"""No note: the shape can be drawn, and what lies beside it must only not be touched."""


def urdf(visuals: str) -> str:
    """An arm of two links with these visuals on its first."""
    return (
        f'<robot name="arm"><link name="base">{visuals}</link><link name="tip"/>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )


def visual(name: str, more: str = "") -> str:
    """One visual that names a mesh."""
    return f'<visual>{more}<geometry><mesh filename="{name}"/></geometry></visual>'


def trap(rng: random.Random, folder: Path, name: str) -> str:
    """A file beside the mesh that must not be opened; gives the name to write for it."""
    kind = rng.choice(("pipe", "sparse", "folder", "missing", "outside", "url"))
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "sparse":
        (folder / name).touch()
        os.truncate(folder / name, 1 << 40)
    elif kind == "folder":
        (folder / name).mkdir()
    elif kind == "outside":
        return f"../../../../../../dev/{rng.choice(('zero', 'stdin', 'tty'))}"
    elif kind == "url":
        return f"http://127.0.0.1:9/{name}"
    return name


def write(folder: Path, name: str, content: str | bytes) -> str:
    """A new file; gives its name."""
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return name
