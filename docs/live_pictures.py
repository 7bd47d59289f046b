"""Make the pictures of the live page for the README: its mouse is moved in a headless Chromium.

    python docs/live_pictures.py

A UR5 is to go over a hood that is too far away. The hood is dragged nearer, and let go where that
is feasible: live-1.png, live-2.png and live-3.png beside this file. It needs the extra `browser`
(playwright) and a Chromium on the path.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from pictures import chromium, save_small
from PIL import Image
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect, sync_playwright

from coverable import Case, Live
from coverable.arrays import Array
from feasibility.live.arm import LENS
from feasibility.live.page import Page

HERE = Path(__file__).parent
SIZE = {"width": 1000, "height": 600}  # [pixel]
PATIENCE = 120_000  # [ms]
PLANE = np.array([0.06, 0.06, 0.0])  # [m] where the handle moves things level, from its middle
NEARER = np.array([-0.25, -0.08, 0.0])  # [m]
CASE = """
[robot]
name = "ur5"

[surface]
kind = "bspline"
points = [
  [[-0.3, -0.35, 0.00], [-0.3, -0.12, 0.10], [-0.3, 0.12, 0.10], [-0.3, 0.35, 0.00]],
  [[-0.1, -0.35, 0.06], [-0.1, -0.12, 0.20], [-0.1, 0.12, 0.20], [-0.1, 0.35, 0.06]],
  [[ 0.1, -0.35, 0.06], [ 0.1, -0.12, 0.20], [ 0.1, 0.12, 0.20], [ 0.1, 0.35, 0.06]],
  [[ 0.3, -0.35, 0.00], [ 0.3, -0.12, 0.10], [ 0.3, 0.12, 0.10], [ 0.3, 0.35, 0.00]],
]
position = [0.75, 0.1, 0.05]
side = "outside"
cells = [9, 10]

[task]
standoff = 0.02
cone_deg = 20
"""


def keep(tab: Tab, name: str) -> None:
    """Take a picture of the page, as a small PNG."""
    with Image.open(io.BytesIO(tab.screenshot())) as image:
        save_small(image.convert("RGB"), HERE / name)


def answered(tab: Tab, kind: str) -> None:
    """Wait for an answer of that kind."""
    expect(tab.locator(f"b.{kind}").first).to_be_visible(timeout=PATIENCE)
    tab.wait_for_timeout(1500)  # to be painted


def on_screen(tab: Tab, page: Page, point: Array) -> tuple[float, float]:
    """Where a point of the world, m, is in the window."""
    eye, target = np.array(page.client.camera.position), np.array(page.client.camera.look_at)
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    x, y, z = np.stack([right, np.cross(right, ahead), ahead]) @ (point - eye)
    box: Any = tab.locator("canvas").first.bounding_box()
    scale = 0.5 * box["height"] / math.tan(0.5 * LENS)
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    return middle[0] + scale * x / z, middle[1] - scale * y / z


def story(tab: Tab, page: Page) -> None:
    """The hood is too far away; it is dragged nearer by the plane of its handle; it is let go."""
    answered(tab, "infeasible")
    keep(tab, "live-1.png")
    middle = np.array(page.handle.gizmo.position)
    tab.mouse.move(*on_screen(tab, page, middle + PLANE))
    tab.wait_for_timeout(500)
    tab.mouse.down()
    for share in np.linspace(0.0, 0.4, 8):
        tab.mouse.move(*on_screen(tab, page, middle + PLANE + share * NEARER))
        tab.wait_for_timeout(150)  # while it moves, nothing else is looked for
    expect(tab.get_by_text("hold still for the certified answer")).to_be_visible(timeout=PATIENCE)
    keep(tab, "live-2.png")
    for share in np.linspace(0.4, 1.0, 8):
        tab.mouse.move(*on_screen(tab, page, middle + PLANE + share * NEARER))
    tab.mouse.up()
    tab.mouse.move(5, 5)
    answered(tab, "feasible")
    keep(tab, "live-3.png")


def main() -> None:
    """Make the pictures."""
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--disable-dev-shm-usage"]
    with Live(Case.from_toml(CASE, name="hood.toml")) as live, sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=chromium(), args=flags)
        tab = browser.new_page(viewport=SIZE)
        tab.goto(live.url)
        answered(tab, "infeasible")
        tab.locator(".mantine-Notification-closeButton").first.click()  # of drawing without a GPU
        story(tab, *live.pages.values())
        browser.close()


if __name__ == "__main__":
    main()
