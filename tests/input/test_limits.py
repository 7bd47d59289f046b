"""Hostile files, made from seeds: none takes 1 GB or 20 s, opens another file, or lacks its words.

Each is read in a process of its own, which ends when it takes more.
"""

from __future__ import annotations

import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import bad_input
import hostile_stores
import hostile_visuals as hostile
import pytest
import samples
from readers import READERS, of_bad
from samples import sampled, seeds

from coverable_errors import CoverableError
from feasibility.cases import load_case
from feasibility.results import load_trajectory
from feasibility.studies import Store, load_study, open_workers, run_tasks
from feasibility.viewer.robot import draw
from robots import load_robot
from robots.shapes import link_shapes
from surfaces import read_net
from surfaces.meshes import read_mesh

MOST_MEMORY = 1 << 30  # [byte]
MOST_TIME = 20  # [s] of processor time
PATIENCE = 1800  # [s] after which something is waited for that never comes
LIGHT = [maker for maker in hostile.MAKERS if maker is not hostile.just_drawn]
MAKERS = hostile.MAKERS if samples.EVERYTHING else LIGHT
CASE = READERS["case"]
ASKED: dict[str, tuple[Callable[[Path], object], ...]] = {
    **{reader: (READERS[reader].read,) for reader in ("motion", "srdf", "urdf", "result")},
    "case": (load_case, load_study),
    "net": (read_net,),
    "trajectory": (load_trajectory,),
}
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


class Outcome(NamedTuple):
    """What became of one file."""

    said: str
    opened: list[str]
    seconds: float
    memory: int
    """Bytes at the most."""


def alone(work: Callable[[], str], folder: Path) -> Outcome:
    """Do it in a process of its own, within limits; what it says, or how it ended."""
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
    if "Traceback" in printed.read_text(errors="replace") or not answer.exists():
        said = f"Traceback: ended with {status}: {printed.read_text(errors='replace')[-500:]}"
    return Outcome(said, opened, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)


def within_limits(
    outcome: Outcome, own: set[str] | None = None, folder: Path | None = None
) -> None:
    """Not over 1 GB, not over 20 s, not without its sentence, and no other file opened."""
    assert "Traceback" not in outcome.said
    assert outcome.memory < MOST_MEMORY, f"{outcome.memory >> 20} MB"
    assert outcome.seconds < MOST_TIME
    assert all(line.isprintable() for line in outcome.said.split("\n"))
    if own is not None:
        inside = {Path(one).name for one in outcome.opened if one.startswith(str(folder))}
        assert inside <= own, "nothing beside the mesh is opened"
        assert not [one for one in outcome.opened if re.match("/etc|/dev/(?!null)", one)]


@sampled
@pytest.mark.parametrize("seed", seeds(1, all=5))
@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_a_mesh_that_is_a_trap(maker: hostile.Maker, seed: int, tmp_path: Path) -> None:
    """As a picture of a robot, as its body, and as a surface; first within all limits."""
    folder = tmp_path / "robot"
    path, words = hostile.make(maker, seed, folder)
    (name,) = re.findall('filename="(.*?)"', Path(path).read_text())
    text = Path(path).read_text().replace("<visual>", BALL + "<collision>")
    body = folder / "body.urdf"
    body.write_text(text.replace("</visual>", "</collision>"))

    def read_all() -> str:
        said = ["\n".join(draw(load_robot(path)).notes)]
        if maker is hostile.just_drawn:  # larger ones may be surfaces and bodies
            return said[0]
        shapes = link_shapes(load_robot(str(body)))
        said += ["\n".join(shapes.notes), " ".join(shapes.unchecked)]
        try:
            said += [f"{len(read_mesh(folder / name, 1.0).faces)} faces"]
        except CoverableError as error:
            said += [str(error)]
        return "\n\n".join(said)

    outcome = alone(read_all, tmp_path)
    within_limits(outcome, {"arm.urdf", "body.urdf", name}, folder)
    drawn, *others = outcome.said.split("\n\n")
    assert drawn.startswith("not drawn: ") == bool(words)
    assert re.search(words, drawn)
    if others:
        assert bool(others[0]) == bool(words)
        assert others[1] == ("base tip" if words else "tip")
        assert others[2]


def test_every_bad_input_of_the_tables(tmp_path: Path) -> None:
    """One after the other, those of TOML as cases, as studies and as settings."""
    bad_input.lay_out(tmp_path)

    def read_all() -> str:
        said = []
        for reader in ("case", "net", "motion", "trajectory", "srdf", "urdf", "result"):
            for name, one in bad_input.bad(reader).items():
                file = name if reader in ("net", "trajectory") else READERS.get(reader, CASE).file
                (tmp_path / file).write_bytes(of_bad(reader, name))
                for read in ASKED.get(reader, ()):
                    try:
                        read(tmp_path / file)
                    except CoverableError as error:
                        said.append(str(error))
                if one.good == "whole" and reader == "case":
                    with pytest.raises(CoverableError):
                        load_case("paper/4a", [one.content.decode().strip()])
        return "\n".join(said)

    outcome = alone(read_all, tmp_path)
    within_limits(outcome)
    assert outcome.said.count("\n") > 500


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two cases, with its store."""
    return hostile_stores.study_with_store(tmp_path_factory.mktemp("study"))


@sampled
@pytest.mark.parametrize("seed", seeds(4, all=60))
def test_stores_of_studies(seed: int, study: Path, tmp_path: Path) -> None:
    store = hostile_stores.tampered(study / "out.study", random.Random(100 + seed), tmp_path)

    def show() -> str:
        tasks = load_study(study / "study.toml").tasks
        try:
            with open_workers(0) as workers, Store(store) as opened:
                return f"shown: {run_tasks(tasks, workers, opened)}"
        except CoverableError as error:
            return str(error)

    outcome = alone(show, tmp_path)
    within_limits(outcome)
    assert "out.study" in outcome.said
    assert "shown: " not in outcome.said


def test_all_bad_urdfs_in_a_process_that_never_sees_the_native_parser(tmp_path: Path) -> None:
    """Which would crash for some of them; memory and time are capped by the system."""
    for k, name in enumerate(bad_input.bad("urdf")):
        (tmp_path / f"{k}.urdf").write_bytes(of_bad("urdf", name))
    program = f"""
import glob, resource, sys
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
resource.setrlimit(resource.RLIMIT_AS, (2 * 2**30, 2 * 2**30))
from robots.urdf import UrdfError, check_urdf
for path in glob.glob({str(tmp_path)!r} + "/*.urdf"):
    try:
        check_urdf(path)
    except UrdfError:
        pass
assert "pinocchio" not in sys.modules
"""
    here = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=here,
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
