"""Hostile files, made from seeds: none takes 1 GB or 20 s, and each has its sentence.

Each is read in a process of its own, which ends when it takes more. The generators, and samples in
the normal suite: `hostile_*.py`, `test_hostile_visuals.py`, `test_toml_limits.py` and
`test_stored_results.py`.
"""

from __future__ import annotations

import json
import os
import random
import re
import resource
import signal
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import hostile_stores
import hostile_texts
import hostile_visuals
import pytest

from coverable_errors import CoverableError
from feasibility.cases import CaseError, load_case
from feasibility.studies import Store, load_study, open_workers, run_tasks
from feasibility.viewer.robot import draw
from robots import load_robot
from surfaces.meshes import read_mesh

MOST_MEMORY = 1 << 30  # [byte]
MOST_TIME = 20  # [s] of processor time
PATIENCE = 120  # [s] after which something is waited for that never comes


class Outcome(NamedTuple):
    """What became of one file."""

    said: str
    seconds: float
    memory: int
    """Bytes at the most."""


def alone(work: Callable[[], str], folder: Path) -> Outcome:
    """Do it in a process of its own, within limits; what it says, or how it ended."""
    answer, printed = folder / "answer.json", folder / "printed.txt"
    child = os.fork()
    if child == 0:
        try:
            with printed.open("wb") as stream:
                os.dup2(stream.fileno(), 1)
                os.dup2(stream.fileno(), 2)
            taken = int(re.findall(r"VmData:\s+(\d+)", Path("/proc/self/status").read_text())[0])
            resource.setrlimit(resource.RLIMIT_DATA, (taken * 1024 + MOST_MEMORY,) * 2)
            resource.setrlimit(resource.RLIMIT_CPU, (2 * MOST_TIME,) * 2)
            signal.alarm(PATIENCE)
            answer.write_text(json.dumps(work()))
        except BaseException as error:  # noqa: BLE001 - the process ends here
            answer.write_text(json.dumps(f"Traceback: {error!r}"))
        os._exit(0)
    _, status, used = os.wait4(child, 0)
    said = json.loads(answer.read_text()) if answer.exists() else f"Traceback: ended with {status}"
    if "Traceback" in printed.read_text(errors="replace"):
        said = f"Traceback: {printed.read_text(errors='replace')[-500:]}"
    return Outcome(said, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)


def within_limits(outcome: Outcome) -> None:
    """None over 1 GB, none over 20 s, none without its sentence."""
    assert "Traceback" not in outcome.said
    assert outcome.memory < MOST_MEMORY, f"{outcome.memory >> 20} MB"
    assert outcome.seconds < MOST_TIME
    assert all(line.isprintable() for line in outcome.said.split("\n"))


def drawn(path: str) -> str:
    """The notes of a drawing."""
    return "\n".join(draw(load_robot(path)).notes)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("maker", hostile_visuals.MAKERS, ids=lambda maker: maker.__name__)
def test_pictures(maker: hostile_visuals.Maker, seed: int, tmp_path: Path) -> None:
    path, words = hostile_visuals.make(maker, seed, tmp_path / "robot")
    outcome = alone(lambda: drawn(path), tmp_path)
    within_limits(outcome)
    if words:
        assert outcome.said.startswith("not drawn: ")
        assert re.search(words, outcome.said)
    else:
        assert outcome.said == ""


def test_many_pictures_at_once(tmp_path: Path) -> None:
    """Two thousand shapes of as many kinds, and large files one after the other."""
    balls = "".join(
        f'<visual><geometry><sphere radius="0.{k:04}1"/></geometry></visual>' for k in range(2000)
    )
    rows = "".join(f"v {k} 0 0\nv {k} 1 0\nf -1 -2 -3\n" for k in range(300_000))
    names = [hostile_visuals.write(tmp_path, f"{k}.obj", f"v {k} 0 0\n{rows}") for k in range(6)]
    for number, shapes in enumerate((balls, "".join(map(hostile_visuals.visual, names)))):
        folder = tmp_path / str(number)
        folder.mkdir()
        text = hostile_visuals.urdf(shapes)
        path = str(tmp_path / hostile_visuals.write(tmp_path, f"{number}.urdf", text))
        outcome = alone(lambda path=path: drawn(path), folder)  # type: ignore[misc]
        within_limits(outcome)
        assert re.search("more than (1,500,000 triangles|8 s)", outcome.said)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("maker", hostile_visuals.MAKERS, ids=lambda maker: maker.__name__)
def test_the_same_files_as_surfaces(
    maker: hostile_visuals.Maker, seed: int, tmp_path: Path
) -> None:
    path, _ = hostile_visuals.make(maker, seed, tmp_path / "robot")
    (name,) = re.findall('filename="(.*?)"', Path(path).read_text())

    def work() -> str:
        try:
            return f"{len(read_mesh(Path(path).parent / name, 1.0).faces)} faces"
        except CoverableError as error:
            return str(error)

    if maker is not hostile_visuals.just_drawn:  # larger ones may be surfaces
        outcome = alone(work, tmp_path)
        within_limits(outcome)
        assert outcome.said


@pytest.mark.parametrize("seed", range(60))
def test_texts(seed: int, tmp_path: Path) -> None:
    text = hostile_texts.deep(random.Random(seed))
    path = tmp_path / "deep.toml"
    path.write_text(text)

    def work() -> str:
        found = []
        for load in (load_case, load_study):
            with pytest.raises(CaseError) as caught:
                load(path)
            found.append(str(caught.value))
        with pytest.raises(CaseError) as caught:
            load_case("paper/4a", [text.strip()])
        return "\n".join((*found, str(caught.value)))

    outcome = alone(work, tmp_path)
    within_limits(outcome)
    assert "deep.toml: " in outcome.said


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two cases, with its store."""
    return hostile_stores.study_with_store(tmp_path_factory.mktemp("study"))


@pytest.mark.parametrize("seed", range(100, 160))
def test_stores(seed: int, good: Path, tmp_path: Path) -> None:
    store = hostile_stores.tampered(good / "out.study", random.Random(seed), tmp_path)

    def work() -> str:
        tasks = load_study(good / "study.toml").tasks
        try:
            with open_workers(0) as workers, Store(store) as opened:
                return f"shown: {run_tasks(tasks, workers, opened)}"
        except CoverableError as error:
            return str(error)

    outcome = alone(work, tmp_path)
    within_limits(outcome)
    assert "out.study" in outcome.said
    assert "shown: " not in outcome.said
