"""`coverable warm-up`: every kernel compiled once, so that no command has to wait for it later."""

from __future__ import annotations

import argparse
import io
import os
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path

from feasibility.cli.command_parts import STATUS, add_command, json_text
from feasibility.cli.console import Bar, print_err, print_out

MESH = """
robot.name = "ur5"
task = { standoff = 0.02, cone_deg = 30 }
[surface]
kind = "mesh"
file = "sheet.off"
position = [0.4, -0.1, 0.2]
side = "outside"
cells = 6
"""
TORUS = """
robot = { name = "puma560", limits = "set-1" }
task = { standoff = 0.005, cone_deg = 45 }
search = { method = "greedy", step_deg = 0.5 }
[surface]
kind = "torus"
ring = 0.8
tube = 0.3
u_deg = [20, 60]
v_deg = [-20, 20]
cells = [3, 3]
"""
CLEAR = ("--set", "collision.clearance=0.005")
FEW = ("--set", "surface.cells=[2, 2]")
COMMANDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("the search", ("check", "paper/4a")),
    ("proofs", ("check", "paper/4d")),
    ("collisions", ("check", "paper/5e", *CLEAR)),
    ("proofs with collisions", ("check", "paper/5f", *CLEAR, "--set", "surface.cells=[3, 3]")),
    ("thresholds with collisions", ("explain", "paper/4a", *CLEAR, *FEW)),
    ("meshes", ("check", "mesh.toml")),
    ("the greedy search", ("check", "paper/4f", "--set", "search.method=greedy")),
    ("the greedy search on triangles", ("check", "torus.toml")),
    ("explain", ("explain", "paper/4c")),
    ("path", ("path", "paper/4a", "--order", "shortest")),
    ("passes", ("path", "paper/4a", "--passes", "0", "--pitch", "0.1")),
    ("divide", ("divide", "paper/4d")),
    ("place", ("place", "paper/4c", "--yaw", "-10", "10", "--count", "2", "--workers", "0")),
)
"""What is compiled, in words, and a command that uses it."""


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
    add_command(
        subcommands, "warm-up", partial(warm_up, subcommands.choices),
        help="compile everything once, so that nothing has to wait for it later",
        description="Compile every kernel that a command may need, by commands over small cases. "
        "What is compiled already is not compiled again.",
    )  # fmt: skip


def warm_up(
    commands: dict[str, argparse.ArgumentParser], args: argparse.Namespace, began: float
) -> int:
    """`coverable warm-up`: run `COMMANDS` without their answers.

    Args:
        commands: the parsers of all commands.
        args, began: see `Command`.

    Raises:
        RuntimeError: a command neither decides nor says why not.
    """
    from numba.core import event

    with (
        Bar() as bar,
        tempfile.TemporaryDirectory() as folder,
        event.install_recorder("numba:compile") as recorded,
    ):
        files = _write_cases(Path(folder))
        for done, (what, words) in enumerate(COMMANDS):
            bar(done, len(COMMANDS), f"compiling: {what}")
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                inner = argparse.Namespace(command=words[0])
                commands[words[0]].parse_args([files.get(word, word) for word in words[1:]], inner)
                status = inner.run(inner, time.perf_counter())
            if status not in STATUS.values():
                raise RuntimeError(f"{' '.join(words)} ends with status {status}")
    compiled = sum(about.is_start for _, about in recorded.buffer)
    seconds = time.perf_counter() - began
    if args.json:
        print_out(json_text({"compiled": compiled, "seconds": seconds}))
    elif compiled:
        print_out(f"compiled {compiled} functions in {seconds:.0f} s; nothing is left to compile")
    else:
        print_out("everything is compiled already")
    _say_where_nothing_is_kept()
    return 0


def _say_where_nothing_is_kept() -> None:
    """That this was in vain, because kernels cannot be written anywhere."""
    from coverable.kernels import FOLDER

    if FOLDER is None:
        print_err(
            "note: kernels can be kept safely neither beside the code nor in the cache of the home "
            "folder, so each process compiles them; set NUMBA_CACHE_DIR to a folder of your own"
        )


def _write_cases(folder: Path) -> dict[str, str]:
    """Write the cases that are not built in; their paths by name."""
    count = 13
    at = [(i / 60, j / 60) for i in range(count) for j in range(count)]
    points = [f"{x:.6f} {y:.6f} {0.5 * (x - 0.1) ** 2:.6f}" for x, y in at]
    corners = [i * count + j for i in range(count - 1) for j in range(count - 1)]
    faces = [f"3 {k} {k + a} {k + b}" for k in corners for a, b in ((13, 14), (14, 1))]
    sheet = ["OFF", f"{len(points)} {len(faces)} 0", *points, *faces, ""]
    texts = {"sheet.off": os.linesep.join(sheet), "mesh.toml": MESH, "torus.toml": TORUS}
    for name, text in texts.items():
        (folder / name).write_text(text)
    return {name: str(folder / name) for name in texts}
