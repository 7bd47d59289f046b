"""The live page in a Chromium: how it is opened, waited for, and read."""

import io
import os
import re
import shutil
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect, sync_playwright

PATIENCE_MS = 120_000
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PLATE = """
[robot]
name = "ur5"

[surface]
kind = "plane"
u = [0.35, 0.65]
v = [-0.2, 0.2]
position = [0, 0, 0.1]
side = "outside"
cells = [6, 8]

[task]
standoff = 0.02
cone_deg = 20
"""
GREEN = "#219954"  # of covered cells


@contextmanager
def chromium():
    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.fail("there is no Chromium on the path, and CHROMIUM names none")
    flags = ["--use-gl=angle", "--use-angle=swiftshader", "--disable-dev-shm-usage"]
    root = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as tools:
        opened = tools.chromium.launch(executable_path=path, args=[*flags, *root])
        yield opened
        opened.close()


def opened(browser, live):
    """A page that has its first answer; what goes wrong on it fails the test."""
    page = browser.new_page(viewport={"width": 1000, "height": 640})
    page.set_default_timeout(PATIENCE_MS)
    page.on("pageerror", lambda error: pytest.fail(f"on the page: {error}"))
    page.goto(live.url)
    certified(page)
    return page


def certified(page, kind="feasible|infeasible|undecided"):
    expect(page.locator("#answer")).to_have_class(re.compile(rf"^({kind}) *$"), timeout=PATIENCE_MS)


def quick(page):
    """Wait for a quick look, which is marked."""
    expect(page.locator("#badge")).to_be_visible(timeout=PATIENCE_MS)
    expect(page.locator("#answer")).to_have_class(re.compile(r"^quick "))
    expect(page.locator("#verdict")).to_have_text(
        re.compile(r"^one motion reaches \d+ of 48 cells")
    )


def values(page):
    return page.evaluate("window.page.panel.values")


def colours(page):
    """The colour of each cell."""
    return page.evaluate("window.page.scene.colours()")


def painted(page, of="green"):
    """How many pixels of the picture are green, or red or purple as missed cells are."""
    pixels = np.asarray(Image.open(io.BytesIO(page.locator("canvas").screenshot()))).astype(int)
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    if of == "green":
        return int(((green > red + 40) & (green > blue + 20)).sum())
    return int(((red > green + 40) & (red > blue)).sum())


def handle(page, point=(0.0, 0.0, 0.0)):
    """Where a point of the handle, in its own lengths, is on the screen."""
    return page.evaluate(
        """(point) => {
          const {viewer, handle} = window.page.scene;
          const box = document.getElementById("meshcat-pane").getBoundingClientRect();
          handle.group.updateMatrixWorld(true);
          viewer.camera.updateMatrixWorld();
          const place = handle.body.localToWorld(new MeshCat.THREE.Vector3(...point));
          place.project(viewer.camera);
          return [box.left + (place.x + 1) / 2 * box.width,
                  box.top + (1 - place.y) / 2 * box.height];
        }""",
        list(point),
    )
