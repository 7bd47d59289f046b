"""A wheel that brings compiled kernels: `make wheel` writes it to dist/.

The sources are copied, and the copy is warmed up, with kernels compiled for any processor of this
kind. What they kept goes into the copy as `coverable_shipped_kernels`, and
setuptools makes the wheel, for this Python and platform. Which installation may use which kernel is
in the names of the files (`coverable_kernel_files.py`): elsewhere they are compiled as from source.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "coverable*.py")
PACKAGES = ("coverable_meshes", "robots", "surfaces", "feasibility")
FIRST = (("check", "paper/4a"), ("check", "paper/4d"))
# Machine code is for one architecture, where Python itself may be for two.
PLATFORM = sysconfig.get_platform().replace("universal2", platform.machine())
SETUP = """
from setuptools import Distribution, setup
class ForThisPlatform(Distribution):
    def has_ext_modules(self):
        return True
setup(distclass=ForThisPlatform)
"""


def main() -> None:
    """Make the wheel."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dist", type=Path, default=ROOT / "dist", help="folder for the wheel")
    parser.add_argument("--first", action="store_true", help="only the kernels of a first check")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source, kept = Path(folder) / "source", Path(folder) / "kept"
        copy_sources(source)
        for command in FIRST if given.first else [("warm-up",)]:
            print("compiling for: coverable", *command, flush=True)
            compile_kernels(source, kept, command)
        kernels = collect(kept, source / "coverable_shipped_kernels")
        wheel = make(source, given.dist.resolve())
    print(f"{wheel} ({wheel.stat().st_size / 1e6:.1f} MB, {kernels} kernels)")


def copy_sources(to: Path) -> None:
    """Copy all that the wheel is made of, without what was compiled here."""
    to.mkdir()
    for pattern in SOURCES:
        for path in ROOT.glob(pattern):
            shutil.copy(path, to)
    for name in PACKAGES:
        shutil.copytree(ROOT / name, to / name, ignore=shutil.ignore_patterns("__pycache__"))


def compile_kernels(source: Path, kept: Path, command: tuple[str, ...]) -> None:
    """Run a command of the copy, and keep what it compiles.

    Raises:
        subprocess.CalledProcessError: if it neither decides nor says why not.
    """
    environment = {
        **os.environ,
        "PYTHONPATH": str(source),
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_CACHE_DIR": str(kept),
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_DISABLE_INTEL_SVML": "1",  # its functions need not be there elsewhere
    }
    done = subprocess.run(
        [sys.executable, "-m", "feasibility.cli", *command],
        cwd=kept.parent, env=environment, stdout=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode not in (0, 1, 3):  # feasible, infeasible, undecided
        raise subprocess.CalledProcessError(done.returncode, ["coverable", *command])


def collect(kept: Path, to: Path) -> int:
    """Put all files of kernels into one folder; how many there are."""
    to.mkdir()
    files = list(kept.glob("*/*.kernel"))
    for path in files:
        shutil.copy(path, to / path.name)
    return len(files)


def make(source: Path, dist: Path) -> Path:
    """Let setuptools make the wheel of a folder.

    Raises:
        subprocess.CalledProcessError: if it cannot.
    """
    (source / "setup.py").write_text(SETUP)
    (source / "setup.cfg").write_text(f"[bdist_wheel]\nplat_name = {PLATFORM}\n")
    options = ["-q", "--no-deps", "--no-build-isolation", "-w", "made", "."]
    subprocess.run([sys.executable, "-m", "pip", "wheel", *options], cwd=source, check=True)
    (made,) = (source / "made").glob("*.whl")
    dist.mkdir(parents=True, exist_ok=True)
    return Path(shutil.move(made, dist / made.name))


if __name__ == "__main__":
    main()
