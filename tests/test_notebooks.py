"""The notebooks run, on the smaller grids they choose themselves, and are saved with pictures."""

import base64
import io
import json
import re
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import samples
from IPython.core.interactiveshell import InteractiveShell
from PIL import Image

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
each = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
SHOWN = set[tuple]()


@each
def test_it_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process, which has loaded by then what each kernel of Jupyter would load anew."""
    monkeypatch.setenv("COVERABLE_FEW", "1")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.chdir(path.parent)
    monkeypatch.setitem(sys.modules, "__main__", sys.modules["__main__"])  # IPython has its own
    shell = InteractiveShell.instance(cache_size=0)
    monkeypatch.setattr(shell, "kernel", "a notebook", raising=False)
    # IPython would print what goes wrong where a value is shown, and go on.
    monkeypatch.setattr(shell, "showtraceback", Mock(side_effect=AssertionError("see above")))

    def shown(value: Any, whole: Any = shell.display_formatter.format) -> tuple[dict, dict]:
        """Pictures and pages, which nobody sees here, of one value of each kind."""
        kind = type(value), getattr(value, "feasible", None)
        known = kind in SHOWN and not samples.EVERYTHING
        SHOWN.add(kind)
        return ({}, {}) if known else whole(value)

    monkeypatch.setattr(shell.display_formatter, "format", shown)
    try:
        for cell in json.loads(path.read_text("utf-8"))["cells"]:
            if cell["cell_type"] == "code":
                shell.run_cell("".join(cell["source"])).raise_error()
    finally:
        InteractiveShell.clear_instance()


@each
def test_it_is_saved_with_its_outputs(path: Path) -> None:
    text = path.read_text("utf-8")
    cells = [c for c in json.loads(text)["cells"] if c["cell_type"] == "code"]
    assert sum(one.stat().st_size for one in NOTEBOOKS) <= 6e6
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    kinds = {output.get("name", output["output_type"]) for output in outputs}
    assert kinds <= {"stdout", "execute_result", "display_data"}
    texts = ["".join(o.get("text", o.get("data", {}).get("text/plain", ""))) for o in outputs]
    assert not [text for text in texts if re.search(r"/(tmp|home|Users)/", text)]
    # Pictures are left of views, and no pages.
    assert not re.search(r"text/html|<iframe|https?:", text)
    pictures = [o["data"]["image/png"] for o in outputs if "image/png" in o.get("data", {})]
    assert sum("View(" in text for text in texts) >= 2
    assert len(pictures) >= 2
    for picture in pictures:
        with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
            assert np.asarray(image.convert("L")).std() > 5
