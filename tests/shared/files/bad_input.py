"""Bad input as data: good files, and what is changed in them, of tests/input/bad/READER.toml.

The table [good] holds good texts; every other table says, for one of them, what its bad ones have
for it, by name:

    "name" = 'table.key = value'   a key of a TOML that is set, or removed where there is no "="
    "name" = 'text'                what takes the place of § in it, or comes behind it
    "name" = [...]                 several keys, or the texts old, new, old, new ...

[whole] has texts for themselves, [encoded] an encoding and a text, [set] settings of a built-in
case. In all of them «x»×3 is xxx, and in the x of it # counts from 0 and @ from 1.
"""

import os
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mesh_patches import grid
from mesh_writers import stl, stl_of

TABLES = Path(__file__).parents[2] / "input" / "bad"
TIMES = re.compile(r"«([^»]*)»×(\d+)")
KEY = re.compile(r"(robot|surface|task|collision|search|serach|tusk)\.([^ ]+)(?: = (.*))?")


class Bad(NamedTuple):
    reader: str
    good: str
    """The table that it is from: of which good text it is, or one of the tables of their own."""
    change: Any
    """As the table has it."""

    @property
    def content(self) -> bytes:
        """Of the file; empty where there is none."""
        if isinstance(self.change, dict) or self.good == "set":
            return b""
        if self.good == "whole":
            return many(self.change).encode("latin-1" if self.reader == "result" else "utf-8")
        if self.good == "encoded":
            return many(self.change[1]).encode(self.change[0])
        return many(changed(goods(self.reader)[self.good], self.change)).encode()


def many(text: str) -> str:
    """A text with what is written once, and meant many times, as often as it is meant."""

    def repeated(found: re.Match[str]) -> str:
        unit, times = found[1], int(found[2])
        if "#" not in unit and "@" not in unit:
            return unit * times
        parts = (unit.replace("#", str(k)).replace("@", str(k + 1)) for k in range(times))
        return "".join(parts)

    return TIMES.sub(repeated, text)


def slug(name: str) -> str:
    return re.sub(r"[^\w.]+", "-", name)


def with_key(text: str, change: str) -> str:
    """A TOML with one key set or removed."""
    found = KEY.fullmatch(change)
    assert found, change
    table, key, value = found.groups()
    if f"[{table}]\n" not in text:
        text = f"{text}[{table}]\n"
    before, inside = text.split(f"[{table}]\n")
    rows = re.match(r"(?:[^\[\n].*\n)*", inside)[0].splitlines(keepends=True)
    after = inside[sum(map(len, rows)) :]
    if value is None:
        kept = [row for row in rows if not row.startswith(f"{key} = ")]
        assert len(kept) < len(rows), f"there is no {key}"
    else:
        row, had = f"{key} = {value}\n", [row.split(" = ")[0] for row in rows]
        kept = [row if name == key else old for name, old in zip(had, rows, strict=True)]
        kept += [] if key in had else [row]
    return f"{before}[{table}]\n{''.join(kept)}{after}"


def changed(text: str, change: str | list[str]) -> str:
    if isinstance(change, str) and not KEY.fullmatch(change):
        return text.replace("§", change) if "§" in text else f"{text}{change}\n"
    changes = [change] if isinstance(change, str) else change
    if all(KEY.fullmatch(one) for one in changes):
        for one in changes:
            text = with_key(text, one)
        return text
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert text.count(old), f"{old!r} is not in the good text"
        text = text.replace(old, new, 1)
    return text


@cache
def goods(reader: str) -> dict[str, str]:
    found: dict[str, str] = dict(_tables(reader).get("good", {}))
    if "head" in found:  # cases, a line each
        found = {name: text.replace(" ; ", "\n") + "\n" for name, text in found.items()}
    head = found.pop("head", "")
    return {name: text if "[robot]" in text else head + text for name, text in found.items()}


@cache
def bad(reader: str) -> dict[str, Bad]:
    found = {}
    for table, changes in _tables(reader).items():
        for name, change in changes.items() if table != "good" else ():
            assert name not in found, name
            found[name] = Bad(reader, table, change)
    return found


@cache
def _tables(reader: str) -> dict[str, Any]:
    return tomllib.loads((TABLES / f"{reader}.toml").read_text("utf-8"))


GOOD_CASE = goods("case")["sphere"]
"""A small case of the paper's sphere."""

SLIDER = TABLES.with_name("good").joinpath("slider.urdf").read_text()
NET_POINTS = [[[0.1 * i, 0.1 * j, 0.01 * i * j] for j in range(3)] for i in range(3)]


def net_csv(points: Any = NET_POINTS) -> bytes:
    rows = [f"{i},{j},{x!r},{y!r},{z!r}" for i, row in enumerate(points)
            for j, (x, y, z) in enumerate(row)]  # fmt: skip
    return "\n".join(["row,column,x,y,z", *rows, ""]).encode()


def sheet(width: float = 0.2, count: int = 5) -> np.ndarray:
    """Triangles (F, 3, 3) m of a flat square that looks up, from the origin on."""
    u, v, faces = grid(count, count)
    return width * np.stack([u, v, 0 * u], axis=1)[faces]


def lay_out(folder: Path) -> Path:
    """Write the files that bad cases name, good ones and bad ones."""
    flat, poses = sheet(), goods("poses")["csv"]
    nan = flat.copy()
    nan[1, 1, 1] = np.nan
    side = 2.0 * sheet(100.0, 1)
    x, y = np.meshgrid([400.0, 500.0, 600.0], [-100.0, 0.0, 100.0, 200.0], indexing="ij")
    grid = np.stack([x, y, 300.0 + 0 * x], axis=2)
    texts = {
        "slider.urdf": SLIDER,
        "gripper.urdf": (TABLES.with_name("good") / "gripper.urdf").read_text(),
        "panda.srdf": '<robot name="panda"><disable_collisions link1="panda_link1" '
        'link2="panda_link2" reason="Adjacent"/></robot>',
        "toolpath.csv": poses,
        "nan.csv": poses.replace("0,0,1\n400,100", "0,0,0\n400,nan"),
        "zero.csv": poses.replace("0,0,1\n400,100", "0,0,0\n400,100"),
        "one.csv": "".join(poses.splitlines(keepends=True)[:2]),
        "broken.xacro": "<robot><link></robot>",
    }
    meshes = {
        "part": flat, "millimetres": 1000 * flat, "nan": nan, "empty": flat[:0],
        "line": flat * [1, 0, 0], "fixture": side,
        "thirteen": np.concatenate([np.add(flat, [k, 0, 0]) for k in range(13)]),
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    for name, triangles in meshes.items():
        (folder / f"{name}.stl").write_bytes(stl_of(triangles))
    with (folder / "many.stl").open("wb") as stream:
        stream.write(stl([], [], count=5_000_000))
        stream.truncate(84 + 50 * 5_000_000)  # takes no room on the disk
    np.save(folder / "points.npy", grid)
    grid[1, 2, 2] = np.nan
    np.save(folder / "nan.npy", grid)
    (folder / "link.xacro").symlink_to("/etc/passwd")
    (folder / "endless-include.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="endless-include.xacro"/></robot>'
    )
    os.mkfifo(folder / "pipe.xacro")
    return folder
