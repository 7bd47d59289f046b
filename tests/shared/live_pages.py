"""Pages in a Chromium: how it is started, and what is painted there."""

import io
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import sync_playwright

PATIENCE_MS = 120_000
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


@contextmanager
def chromium():
    """The browser that CHROMIUM names, or that is on the path."""
    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.fail("there is no Chromium on the path, and CHROMIUM names none")
    flags = ["--use-gl=angle", "--use-angle=swiftshader", "--disable-dev-shm-usage"]
    root = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as tools:
        opened = tools.chromium.launch(executable_path=path, args=[*flags, *root])
        yield opened
        opened.close()


def painted(page, of="green"):
    """How many pixels of the picture are green, or red or purple as missed cells are."""
    canvas = page.locator("canvas").first
    pixels = np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB")).astype(int)
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    if of == "green":
        return int(((green > red + 20) & (green > blue + 10)).sum())
    return int(((red > green + 30) & (red > blue + 10)).sum())
