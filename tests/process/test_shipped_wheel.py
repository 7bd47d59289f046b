"""A wheel with kernels: what it is called, that nothing is compiled, and when all is."""

from __future__ import annotations

import json
import os
import site
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
import samples

from feasibility.cases import builtin_cases

pytestmark = [samples.sampled, pytest.mark.skipif(not samples.EVERYTHING, reason="minutes")]
ROOT = Path(__file__).parents[2]
CASES = sorted(builtin_cases())
CODE = """
import json, sys
import numba
from numba.core import event
if "other numba" in sys.argv:
    numba.__version__ = "0.0.1"
class Compilations(event.Listener):
    count = 0
    def on_start(self, about):
        Compilations.count += 1
    def on_end(self, about):
        pass
event.register("numba:compile", Compilations())
import feasibility
from feasibility.cases import builtin_cases
told = {}
for name in sys.argv[1].split(","):
    robot, cells, task, settings = builtin_cases()[name].build()
    verdict = feasibility.check(robot, cells, task, settings)
    told[name] = [
        verdict.answer, verdict.evidence, verdict.n_covered, verdict.n_edges,
        verdict.statistics["fk"], verdict.statistics["boxes"],
    ]
print(json.dumps([Compilations.count, feasibility.__file__, told]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, with the kernels of a first check."""
    dist = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, ROOT / "tools/make_wheel.py", "--first", "--dist", dist], check=True
    )
    (made,) = dist.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a virtual environment that has the libraries, and the wheel."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    python = folder / "bin" / "python"
    (packages,) = folder.glob("lib/python3*/site-packages")
    libraries = [path for path in sys.path if Path(path) != ROOT and "site-packages" in path]
    (packages / "libraries.pth").write_text("\n".join([*libraries, *site.getsitepackages(), ""]))
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--no-index", wheel], check=True)
    return python


def told(python: Path, folder: Path, *words: str, **more: str) -> tuple[int, Path, dict[str, Any]]:
    """Compilations, the file of the package, and what is said of cases, in a new process."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment |= {"NUMBA_CACHE_DIR": "/dev/null", **more}  # nothing can be kept there
    done = subprocess.run(
        [python, "-c", CODE, *words], cwd=folder, env=environment, stdout=subprocess.PIPE,
        text=True, check=True,
    )  # fmt: skip
    count, file, answers = json.loads(done.stdout)
    return count, Path(file), answers


@pytest.fixture(scope="module")
def from_source(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the checkout says, with kernels for this processor."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", CODE, ",".join(CASES)], env=environment, stdout=subprocess.PIPE,
        cwd=tmp_path_factory.mktemp("elsewhere"), text=True, check=True,
    )  # fmt: skip
    return dict(json.loads(done.stdout)[2])


def test_its_name_says_for_whom_it_is(wheel: Path) -> None:
    tags = wheel.stem.split("-")[2:]
    assert tags[0] == tags[1] == f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert tags[2].startswith(("linux_", "macosx_"))
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (about,) = (name for name in names if name.endswith("/WHEEL"))
        lines = archive.read(about).decode().splitlines()
        kernels = [archive.read(name) for name in names if name.endswith(".kernel")]
    assert f"Tag: {'-'.join(tags)}" in lines
    assert "Root-Is-Purelib: false" in lines
    assert len(kernels) > 15
    for path in (str(ROOT), str(wheel.parent), str(Path.home())):
        assert not any(path.encode() in kernel for kernel in kernels)


def test_it_compiles_nothing_and_says_the_same(
    installed: Path, from_source: dict[str, Any], tmp_path: Path
) -> None:
    count, file, answers = told(installed, tmp_path, ",".join(CASES))
    assert installed.parents[1] in file.parents
    assert count == 0
    assert answers == from_source
    assert answers["paper/4a"][4] == 5952


def test_with_another_numba_it_compiles(
    installed: Path, from_source: dict[str, Any], tmp_path: Path
) -> None:
    count, _, answers = told(installed, tmp_path, "paper/4a", "other numba")
    assert count > 20
    assert answers["paper/4a"] == from_source["paper/4a"]
