"""Print the table of tools side by side, as Markdown.

Each tool answers in a process of its own, on the same questions (`squares.py`). What it returns is
replayed by code that belongs to none of them (`foreign_replay.py`). The other tools come with the
extra `benchmarks`; one that is not installed has a row that says so.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "paper"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import numpy as np
from fk_unit import pinocchio_fk_us
from foreign_replay import chain, measured
from run import table
from squares import BASE, SQUARES, TIP, bare_urdf

from robots import list_robots

REPEATS = 5
PATIENCE = 600.0  # [s] for one tool and one question
TOOLS: dict[str, tuple[str, dict[str, Any]]] = {
    "coverable, in order": ("ours", {}),
    "coverable, as a surface": ("ours", {"in_order": False}),
    "Descartes": ("descartes", {}),
    "EAIK ladder": ("eaik_ladder", {}),
    "roboplan": ("roboplan_path", {}),
}
ROLL_FIXED = ("roboplan",)  # asked only there
SEEN = (
    "missed mm", "off the lines mm", "off the square mm", "tilt deg", "roll deg",
    "largest step of a joint deg", "beyond limits deg",
)  # fmt: skip
CHECKS = """\
| | coverable | Descartes | EAIK ladder | roboplan |
|---|---|---|---|---|
| looks at | configurations over each cell, of every kind that it finds | closed-form IK at \
each pose | the same | one start, followed by differential IK |
| a free roll | is free | {rolls} samples | {rolls} samples | no: whole poses |
| joint limits | all along | at poses | at poses | at samples |
| tool point, axis and roll between poses | certified, all along | not asked | not asked | at \
samples |
| a jump of a joint between poses | impossible | costs, without a bound | costs, without a bound | \
no: small steps |
| order of poses | given, or any | given | given | given |
| the area between paths | `--area` (roll free) | no | no | no |
| "no" means | proved, or said to be no proof; causes, and the best part | no path among the \
samples | no path among the samples | these starts lead nowhere |
| collisions (asked of nobody here) | with `[collision]`, all along | at poses, and at steps \
between them | no | where its caller adds barriers |"""


def measure(tool: str, number: int, urdf: str) -> dict[str, Any]:
    """Ask one tool one question; least processor time of some answers, after one that loads all."""
    name, how = TOOLS[tool]
    ask = import_module(name).prepare(SQUARES[number], urdf, **how)
    said, q = ask()
    taken = []
    for _ in range(REPEATS):
        began = time.process_time()
        said, q = ask()
        taken.append(1e3 * (time.process_time() - began))
    return {"said": said, "q": None if q is None else np.asarray(q).tolist(), "ms": min(taken)}


def asked(tool: str, number: int, urdf: str) -> dict[str, Any]:
    """The same, in a process of its own; what libraries print is not read."""
    package = import_module(TOOLS[tool][0]).PACKAGE
    try:
        version(package)
    except PackageNotFoundError:
        return {"said": f"{package} is not installed", "q": None, "ms": float("nan")}
    with tempfile.TemporaryDirectory() as folder:
        given, answer = Path(folder) / "arm.urdf", Path(folder) / "answer.json"
        given.write_text(urdf)
        done = subprocess.run(
            [sys.executable, __file__, tool, str(number), str(given), str(answer)],
            capture_output=True, text=True, timeout=PATIENCE, check=False,
        )  # fmt: skip
        if not answer.exists():
            last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
            return {"said": f"failed: {last}", "q": None, "ms": float("nan")}
        found: dict[str, Any] = json.loads(answer.read_text())
        return found


def row(tool: str, number: int, urdf: str, fk_us: float) -> dict[str, object]:
    """One row of the table."""
    square, found = SQUARES[number], asked(tool, number, urdf)
    q = None if found["q"] is None else np.array(found["q"])
    done = {"square": square.name, "tool": tool, "answer": found["said"], "CPU ms": found["ms"]}
    done["in FK calls"] = "" if found["ms"] != found["ms"] else round(1e3 * found["ms"] / fk_us)
    values: list[object] = [""] * len(SEEN)
    if q is not None:
        rotation = square.rotations()[0] if square.fixed else None
        seen = measured(chain(urdf, BASE, TIP), q, square.points(), rotation)
        values = [round(float(value), 3) + 0.0 for value in seen]
        if not TOOLS[tool][1].get("in_order", True):
            values[SEEN.index("off the lines mm")] = "any order"
        if not square.fixed:
            values[SEEN.index("roll deg")] = "free"
    return {**done, "rows": "" if q is None else len(q), **dict(zip(SEEN, values, strict=True))}


def versions() -> str:
    """What was compared."""
    found = []
    for package in ("coverable", "tesseract-robotics", "eaik", "roboplan", "pin", "numpy"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} not installed")
    return ", ".join(found)


def main() -> None:
    """Print everything."""
    arm = next(robot for robot in list_robots() if robot.name == "ur5")
    text, fk_us = Path(arm.urdf).read_text(), pinocchio_fk_us()
    rows = []
    for number, square in enumerate(SQUARES):
        urdf = bare_urdf(text, square)
        for tool in TOOLS:
            if tool in ROLL_FIXED and not square.fixed:
                continue
            rows.append(row(tool, number, urdf, fk_us))
            print(f"{square.name}: {tool}", file=sys.stderr)
    print(f"ur5, tool down, 90 poses; least processor time of {REPEATS} answers, after loading.")
    print(f"One FK call of Pinocchio from Python: {fk_us:.2f} us. {versions()}.")
    print(f"\n{table(rows)}\n\n{CHECKS.format(rolls=len(SQUARES[0].rotations()))}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        tool, number, given, answer = sys.argv[1:]
        found = measure(tool, int(number), Path(given).read_text())
        Path(answer).write_text(json.dumps(found))
    else:
        main()
