"""Make the pictures of the live page for the README: its mouse is moved in a headless Chromium.

    python docs/live_pictures.py

A UR5 is to go over a hood that is too far away. The hood is dragged nearer, and let go where that
is feasible: live-1.png, live-2.png and live-3.png beside this file. It needs the extra `browser`
(playwright) and a Chromium on the path.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

from pictures import chromium, save_small
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from coverable import Case, Live

HERE = Path(__file__).parent
SIZE = {"width": 1000, "height": 600}  # [pixel]
PATIENCE = 120_000  # [ms]
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


def keep(page: Page, name: str) -> None:
    """Take a picture of the page, as a small PNG."""
    with Image.open(io.BytesIO(page.screenshot())) as image:
        save_small(image.convert("RGB"), HERE / name)


def answered(page: Page, kind: str) -> None:
    """Wait for an answer of that kind."""
    expect(page.locator("#answer")).to_have_class(re.compile(rf"^{kind} "), timeout=PATIENCE)
    page.wait_for_timeout(500)  # to be painted


def on_screen(page: Page, point: tuple[float, float, float]) -> tuple[float, float]:
    """Where a point of the world, m, is in the window."""
    x, y = page.evaluate(
        """(point) => {
          const {viewer, handle} = window.page.scene;
          const box = document.getElementById("meshcat-pane").getBoundingClientRect();
          viewer.camera.updateMatrixWorld();
          const place = handle.group.localToWorld(new MeshCat.THREE.Vector3(...point));
          place.project(viewer.camera);
          return [box.left + (place.x + 1) / 2 * box.width,
                  box.top + (1 - place.y) / 2 * box.height];
        }""",
        list(point),
    )
    return x, y


def story(page: Page) -> None:
    """The hood is too far away; it is dragged nearer; it is let go."""
    answered(page, "infeasible")
    keep(page, "live-1.png")
    x, y, z = page.evaluate("window.page.scene.handle.body.position.toArray()")
    page.mouse.move(*on_screen(page, (x, y, z)))
    page.mouse.down()
    page.mouse.move(*on_screen(page, (x - 0.08, y - 0.03, z)), steps=8)
    answered(page, "quick")
    keep(page, "live-2.png")
    page.mouse.move(*on_screen(page, (x - 0.25, y - 0.08, z)), steps=8)
    answered(page, "quick")
    page.mouse.up()
    answered(page, "feasible")
    page.mouse.move(5, 5)
    page.wait_for_timeout(500)
    keep(page, "live-3.png")


def main() -> None:
    """Make the pictures."""
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--disable-dev-shm-usage"]
    with Live(Case.from_toml(CASE, name="hood.toml")) as live, sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=chromium(), args=flags)
        page = browser.new_page(viewport=SIZE)
        page.goto(live.url)
        story(page)
        browser.close()


if __name__ == "__main__":
    main()
