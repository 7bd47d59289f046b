"""Make the pictures of the README with the project's own viewer and a headless Chromium.

    python docs/pictures.py            # all of them
    python docs/pictures.py paper-4a   # one

Each is written beside this file as NAME.png; `--keep FOLDER` keeps the page that was photographed.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from coverable import Task, View, bspline, check, load_robot, mesh, sphere, view

HERE = Path(__file__).parent
SIZE = (900, 650)  # [pixel]
LARGEST = 200_000  # [byte] of a PNG


def paper_4a() -> View:
    """The paper's first case: a PUMA 560 inside a dome, limits set 1, and the covering motion."""
    dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
    verdict = check(
        load_robot("puma560", limits="set-1"),
        dome.cells(9, 10),
        Task(standoff=0.005, cone_deg=45),
    )
    return view(verdict, "paper/4a", play=False, at=0.62)


def mesh_hood() -> View:
    """A UR5 over a sheet like the hood of a car, which comes as triangles."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 5), np.linspace(-0.35, 0.35, 6), indexing="ij")
    crown = 0.12 * (1 - (x / 0.4) ** 2) * (1 - 0.6 * (y / 0.45) ** 2)
    bulge = 0.04 * np.exp(-((y / 0.12) ** 2))
    sheet = bspline(np.stack([x, y, crown + bulge], axis=-1))
    drawn = sheet.cells(40, 48).triangles(np.arange(40 * 48), samples=1)
    part = mesh(trimesh.Trimesh(drawn.vertices, drawn.faces), position=(0.5, 0, 0))
    verdict = check(load_robot("ur5"), part.cells(count=120), Task(standoff=0.02, cone_deg=20))
    return view(verdict, "hood of a car, a mesh", play=False, at=0.6)


PICTURES: dict[str, Callable[[], View]] = {"paper-4a": paper_4a, "mesh-hood": mesh_hood}


def photograph(page: Path, picture: Path) -> None:
    """Let Chromium paint a page into a small PNG.

    Raises:
        SystemExit: there is no Chromium, or it painted nothing.
    """
    with tempfile.TemporaryDirectory() as profile:
        subprocess.run(
            [
                chromium(), "--headless=new", "--no-sandbox", "--disable-gpu",
                "--disable-dev-shm-usage", "--virtual-time-budget=15000",
                f"--user-data-dir={profile}", f"--window-size={SIZE[0]},{SIZE[1]}",
                f"--screenshot={picture}", page.resolve().as_uri(),
            ],
            check=True, capture_output=True, timeout=120,
        )  # fmt: skip
    with Image.open(picture) as image:
        painted = image.convert("RGB")
    # A browser without WebGL paints the background alone, and says that all went well.
    if len(np.unique(np.asarray(painted).reshape(-1, 3), axis=0)) < 300:
        raise SystemExit(f"{picture} is empty: this chromium has no WebGL")
    save_small(painted, picture)


def chromium() -> str:
    """The path of a Chromium.

    Raises:
        SystemExit: there is none.
    """
    names = ("chromium", "chromium-browser", "chrome")
    browser = next(filter(None, map(shutil.which, names)), None)
    if browser is None:
        raise SystemExit("the pictures need chromium on the PATH")
    return browser


def save_small(painted: Image.Image, picture: Path) -> None:
    """Save a small PNG.

    Raises:
        SystemExit: it is not small.
    """
    # Fewer colours only where the file would be too large: they shift the rare ones.
    for smaller in (painted, painted.quantize(256), painted.quantize(64)):
        smaller.save(picture, optimize=True)
        if picture.stat().st_size <= LARGEST:
            return
    raise SystemExit(f"{picture} has more than {LARGEST} bytes")


def main() -> None:
    """Make the pictures that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PICTURES)}")
    parser.add_argument("--keep", metavar="FOLDER", help="where to leave the pages")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(args.keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for name in args.names or PICTURES:
            if name not in PICTURES:
                parser.error(f"there is no picture {name!r}; there are {', '.join(PICTURES)}")
            page = PICTURES[name]().save_html(folder / f"{name}.html")
            photograph(page, HERE / f"{name}.png")


if __name__ == "__main__":
    main()
