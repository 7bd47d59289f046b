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


def pixels(page):
    """The picture, (height, width, 3), 0 to 255."""
    canvas = page.locator("canvas").first
    return np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB")).astype(int)


def painted(page):
    """How many pixels of the picture are green, as covered cells are."""
    red, green, blue = np.moveaxis(pixels(page), 2, 0)
    return int(((green > red + 20) & (green > blue + 10)).sum())
