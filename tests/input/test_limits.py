"""Hostile files from seeds: none takes 1 GB or 20 s, opens another file, or lacks its words."""

import json
import os
import re
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import bad_input
import hostile_visuals as hostile
import samples
from readers import READERS, of_bad
from samples import sampled

from coverable import load_case, load_robot, load_study
from coverable.errors import CoverableError
from feasibility.viewer.robot_visuals import draw
from robots.shapes.links import link_shapes
from surfaces.meshes.sources import read_mesh

MOST_MEMORY = 1 << 30  # [byte]
MOST_TIME = 20  # [s] of processor time
PATIENCE = 1800  # [s] after which something is waited for that never comes
# Each .dae file takes three processes more than a second each.
DAE = [name for name, (ending, *_) in hostile.TRAPS.items() if ending == "dae"]
FEW = {*hostile.TRAPS} - {*DAE} | {"wide", "entity beside it"}
TRAPS = [*hostile.TRAPS, *hostile.LARGE] if samples.EVERYTHING else sorted(FEW)
OWN_NAMES = {"net": "net as JSON", "trajectory": "trajectory as CSV"}
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


class Outcome(NamedTuple):
    said: str
    opened: list[str]
    seconds: float
    memory: int
    """Bytes at the most."""


def alone(work: Callable[[], str], folder: Path) -> Outcome:
    """Do it in a process of its own, within limits; what it says or prints, or how it ended."""
    answer, printed = folder / "answer.json", folder / "printed.txt"
    child = os.fork()
    if child == 0:
        opened: list[str] = []
        try:
            with printed.open("wb") as stream:
                os.dup2(stream.fileno(), 1)
                os.dup2(stream.fileno(), 2)
            taken = int(re.findall(r"VmData:\s+(\d+)", Path("/proc/self/status").read_text())[0])
            resource.setrlimit(resource.RLIMIT_DATA, (taken * 1024 + MOST_MEMORY,) * 2)
            resource.setrlimit(resource.RLIMIT_CPU, (2 * MOST_TIME,) * 2)
            signal.alarm(PATIENCE)
            sys.addaudithook(
                lambda event, facts: opened.append(str(facts[0])) if event == "open" else None
            )
            said = work()
        except BaseException as error:  # noqa: BLE001 - the process ends here
            said = f"Traceback: {error!r}"
        answer.write_text(json.dumps([said, opened]))
        os._exit(0)
    _, status, used = os.wait4(child, 0)
    said, opened = json.loads(answer.read_text()) if answer.exists() else ("", [])
    if (text := printed.read_text(errors="replace")) or not answer.exists():
        said = f"Traceback: ended with {status}: {text[-500:]}"
    return Outcome(said, opened, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)


def within_limits(outcome: Outcome, own: set[str] | None = None, folder: Path | None = None):
    """Not over 1 GB, not over 20 s, not without its sentence, and no other file opened."""
    assert "Traceback" not in outcome.said
    assert outcome.memory < MOST_MEMORY, f"{outcome.memory >> 20} MB"
    assert outcome.seconds < MOST_TIME
    assert all(line.isprintable() for line in outcome.said.split("\n"))
    if own is not None:
        inside = {Path(one).name for one in outcome.opened if one.startswith(str(folder))}
        assert inside <= own, "nothing beside the mesh is opened"
        assert not [one for one in outcome.opened if re.match("/etc|/dev/(?!null)", one)]


@sampled("name", TRAPS)
def test_a_mesh_that_is_a_trap(name: str, tmp_path: Path) -> None:
    """As a picture of a robot, as its body beside a ball, and as a surface; all within limits."""
    folder = tmp_path / "robot"
    path, words = hostile.make(name, folder)
    (mesh,) = re.findall('filename="(.*?)"', text := path.read_text())
    text = text.replace("<visual>", BALL + "<collision>").replace("</visual>", "</collision>")
    (folder / "body.urdf").write_text(text)

    def read_all() -> str:
        drawing = draw(load_robot(str(path)))
        said = ["\n".join(drawing.notes), f"{len(drawing.commands)} drawn"]
        if name in hostile.LARGE:  # larger ones may be surfaces and bodies
            return "\n\n".join(said)
        shapes = link_shapes(load_robot(str(folder / "body.urdf")))
        said += ["\n".join(shapes.notes), " ".join(shapes.unchecked), f"{len(shapes.solids)}"]
        try:
            said += [f"{len(read_mesh(folder / mesh, 1.0).faces)} faces"]
        except CoverableError as error:
            said += [str(error)]
        return "\n\n".join(said)

    outcome = alone(read_all, tmp_path)
    within_limits(outcome, {"arm.urdf", "body.urdf", mesh}, folder)
    drawn, commands, *others = outcome.said.split("\n\n")
    assert drawn.startswith("not drawn: ") == bool(words)
    assert re.search(words, drawn)
    assert words or commands != "0 drawn"
    if others:
        assert bool(others[0]) == bool(words)
        assert others[1:3] == (["base tip", "1"] if words else ["tip", "2"])
        assert others[3]


def test_files_that_grow_when_they_are_read(tmp_path: Path) -> None:
    """Those of TOML as cases, as studies and as settings; what is said stands in approved texts."""
    bad_input.lay_out(tmp_path)
    growing = {name: one for name, one in bad_input.bad("case").items() if one.good == "whole"}

    def read_all() -> str:
        jobs: list[tuple[Callable[[Path], object], str, bytes]] = []
        for reader in ("net", "trajectory", "result", "urdf"):
            read = READERS[OWN_NAMES.get(reader, reader)].read
            file = {"result": "a.result", "urdf": "arm.urdf"}.get(reader, "")
            jobs += [(read, file or name, of_bad(reader, name)) for name in bad_input.bad(reader)]
        for one in growing.values():
            jobs += [(read, "a.toml", one.content) for read in (load_case, load_study, as_setting)]
        said = 0
        for read, file, content in jobs:
            (tmp_path / file).write_bytes(content)
            try:
                read(tmp_path / file)
            except CoverableError:
                said += 1
        return f"{len(jobs) - said} of {len(jobs)} are read"

    outcome = alone(read_all, tmp_path)
    within_limits(outcome)
    assert re.match("1[01][0-9] of [34][0-9][0-9] are read", outcome.said)  # URDFs, nearly all


def as_setting(path: Path) -> object:
    return load_case("paper/4a", [path.read_text("utf-8", errors="replace").strip()])
