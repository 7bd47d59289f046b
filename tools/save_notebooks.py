"""Run notebooks, one after another, and save them with their pictures.

    .venv/bin/python tools/save_notebooks.py                                 # all of them
    .venv/bin/python tools/save_notebooks.py notebooks/06_collisions.ipynb

The pages that views leave beside their pictures are not saved: they are 26 MB, of which Jupyter and
GitHub show nothing in a notebook that somebody else has run. Whoever runs it sees them.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parent.parent


def save(path: Path) -> None:
    """Run one notebook in its folder, and save it without pages and times."""
    notebook = nbformat.read(path, as_version=4)
    folder = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, timeout=None, resources=folder, record_timing=False).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", ()):
            output.get("data", {}).pop("text/html", None)
    nbformat.write(notebook, path)


def main(paths: list[Path]) -> None:
    """Save these notebooks, or all."""
    os.environ.pop("COVERABLE_FEW", None)  # whoever reads them sees the whole grids
    for path in paths or sorted((ROOT / "notebooks").glob("*.ipynb")):
        save(path)
        print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
