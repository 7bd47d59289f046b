"""The commands of tests/output/commands.toml: each runs once, in one folder for all of them."""

import contextlib
import io
import json
import shlex
import tomllib
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jobs import Said, run_coverable
from mesh_writers import off, plate

TABLE = tomllib.loads(Path(__file__).parents[1].joinpath("output/commands.toml").read_text("utf-8"))
LINES, NUMBERS, REFUSED, WHOLE = map(TABLE.pop, ("files", "numbers", "refused", "whole"))
FILES = {name: text.replace(" ; ", "\n") + "\n" for name, text in LINES.items()}
COMMANDS = [(command, name) for command in TABLE for name in TABLE[command]]
NEEDS = {
    "walk.csv": ("check", "files"), "plate.result": ("check", "files"),
    "long.result": ("check", "no motion to write"), "greedy.result": ("check", "greedy"),
    "cut.result": ("check", "cut"), "exhausted.result": ("check", "greedy without a motion"),
}  # fmt: skip
BROKEN = {"empty.stl": b"", "zip.stl": b"PK\x03\x04" + bytes(200), "page.stl": b"<html>",
          "cut.stl": b"x" * 80 + b"\xff\xff\xff\x7f" + bytes(50)}  # fmt: skip


class Commands:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run = cache(self._run)
        for name, text in FILES.items():
            (folder / name).write_text(text)
        for name, content in BROKEN.items():
            (folder / name).write_bytes(content)
        for name, size in (("sheet.off", 0.2), ("mm.off", 200.0)):
            (folder / name).write_bytes(off(*plate(4, 4, size, size)))

    def words(self, command: str, name: str) -> list[str]:
        return [command, *shlex.split(TABLE[command][name])]

    def _run(self, command: str, name: str, *more: str) -> Said:
        words = self.words(command, name)
        if more and "--html" in words:  # its page is drawn once
            at = words.index("--html")
            del words[at : at + 2]
        words += more
        for file in set(words) & set(NEEDS):
            if NEEDS[file] != (command, name):
                self.run(*NEEDS[file])
        return self.say(words)

    def say(self, words: list[str]) -> Said:
        with contextlib.chdir(self.folder):
            return run_coverable(*words)

    def page(self, command: str, name: str) -> str:
        self.run(command, name)
        words = self.words(command, name)
        return (self.folder / words[words.index("--html") + 1]).read_text("utf-8")


def forged(path: Any, text: Callable = str, task: Any = None, **arrays: Callable) -> str:
    """The same result file with another text of its case, a second statement of it, or arrays."""
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    meta = json.loads(members["meta.json"])
    meta["case"]["toml"] = text(meta["case"]["toml"])
    members["meta.json"] = json.dumps(meta | ({} if task is None else {"task": task})).encode()
    for name, change in arrays.items():
        buffer = io.BytesIO()
        np.save(buffer, change(np.load(io.BytesIO(members[f"{name}.npy"]))))
        members[f"{name}.npy"] = buffer.getvalue()
    with zipfile.ZipFile(f"{path}.forged", "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
    return f"{path}.forged"
