"""Pages in a real browser, by mouse and keyboard: `make test-browser`.

It needs the extra `browser` (playwright) and a Chromium, which `CHROMIUM` names or the path holds.
Without them it fails.
"""

import io
import os
import re
import shutil
import time

import numpy as np
import pinocchio as pin
import pytest
from PIL import Image
from playwright.sync_api import expect, sync_playwright
from scipy.spatial.transform import Rotation

from coverable import Case, Live, check, load_case, view
from feasibility.live.controls import SURFACE
from feasibility.reports.verdict import SENTENCES
from feasibility.viewer.live_server import LiveView

PLATE = """
robot.name = "ur5"
surface = { kind = "plane", u = [0.35, 0.65], v = [-0.2, 0.2], position = [0, 0, 0.1], \
side = "outside", cells = [6, 8] }
task = { standoff = 0.02, cone_deg = 20 }
"""
ASK = """(time) => {
  const slider = document.getElementById("time");
  slider.value = time;
  slider.dispatchEvent(new Event("input"));
  const rows = [...document.querySelectorAll("#readout tr")];
  const joint = viewer.scene_tree.find(["robot", "joint joint1"]).object.quaternion;
  return [document.getElementById("seconds").textContent,
          rows.map((row) => parseFloat(row.cells[1].textContent)),
          [joint.x, joint.y, joint.z, joint.w]];
}"""
PATIENCE_MS = 120_000
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="module")
def browser():
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


@pytest.fixture(scope="module")
def live():
    with Live(Case.from_toml(PLATE, name="plate")) as served:
        yield served


@pytest.fixture
def tab(browser, live):
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.on("pageerror", lambda error: pytest.fail(f"on the page: {error}"))
    page.on("request", lambda request: elsewhere(request.url))
    page.goto(live.url)
    says(page, "feasible")
    yield page
    page.close()
    waited(page=None, met=lambda: not live.pages)


def elsewhere(url):
    """Nothing is fetched from anywhere else."""
    assert re.match(r"http://127\.0\.0\.1:\d+/|ws://127\.0\.0\.1:\d+/|blob:|data:", url), url


def says(page, kind):
    """Wait for an answer of a kind at the top of the page."""
    expect(page.locator(f"b.{kind}").first).to_be_visible(timeout=PATIENCE_MS)


def waited(page, met):
    """Wait for what the program knows, while the browser goes on."""
    end = time.monotonic() + PATIENCE_MS / 1e3
    while not met():
        assert time.monotonic() < end
        time.sleep(0.05) if page is None else page.wait_for_timeout(50)


def test_a_slider_is_dragged_and_the_cells_change_colour(tab, live):
    (page,) = live.pages.values()
    assert SENTENCES["feasible"] in tab.locator("b.feasible").inner_text()
    waited(tab, lambda: painted(tab) > 2000)
    before = pixels(tab)
    box = tab.locator(".mantine-Slider-thumb").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.mouse.move(x, y)
    tab.mouse.down()
    for step in range(1, 13):
        tab.mouse.move(x + 3 * step, y)
        tab.wait_for_timeout(60)
    says(tab, "quick")
    tab.mouse.up()
    says(tab, "infeasible")
    moved = page.values[SURFACE, "x"]
    assert 200 < moved < 500
    waited(tab, lambda: (np.abs(pixels(tab) - before) > 20).any(axis=2).mean() > 0.01)
    drawn = [path for path in page.scene.nodes if path.startswith("/cells/")]
    assert sorted(drawn) == sorted(layer.entry.path for layer in page.answer.paint)
    expect(
        tab.get_by_text(re.compile("not covered: (out of reach|orientation)")).first
    ).to_be_visible()
    tab.keyboard.press("Control+z")
    while page.values[SURFACE, "x"] != 0.0:  # a slow machine may have paused during the drag
        tab.wait_for_timeout(500)
        tab.keyboard.press("Control+z")
    says(tab, "feasible")
    tab.keyboard.press("Control+Shift+z")
    waited(tab, lambda: page.values[SURFACE, "x"] != 0.0)
    tab.get_by_role("button", name="reset").click()
    says(tab, "feasible")
    assert page.values == page.controls.values


def test_a_notebook_shows_the_page_over_a_picture_that_outlives_it(browser):
    """The output stands on a page of another origin, as Jupyter's do."""
    live = Live(Case.from_toml(PLATE, name="plate"))
    try:
        with LiveView(live._repr_mimebundle_()["text/html"]) as notebook:
            page = browser.new_page(viewport={"width": 1000, "height": 700})
            page.goto(notebook.url)
            says(page.frame_locator("iframe"), "feasible")
            live.close()
            page.reload()
            page.wait_for_timeout(1000)
            assert page.locator("iframe").count() == 0
            assert page.evaluate("document.querySelector('img').naturalWidth") > 400
            page.close()
    finally:
        live.close()


def test_the_slider_moves_the_arm_and_the_readout(browser, tmp_path):
    verdict = check(*load_case("paper/4a", ["surface.cells=[4, 5]"]).build())
    drawn = view(verdict, play=False)
    page = browser.new_page(viewport={"width": 900, "height": 640})
    page.goto(drawn.save_html(tmp_path / "view.html").as_uri())
    page.wait_for_function("window.viewer !== undefined", timeout=PATIENCE_MS)
    assert painted(page) > 10, "the start"
    end = drawn.readout.times[-1]
    for second in (0.0, 1.3, 4.7):
        share, values, quaternion = page.evaluate(ASK, second)
        q = drawn.motion.at(np.array([second]))[0]
        assert np.allclose(values[:6], np.degrees(q), atol=0.6)
        assert share == f"{100 * second / end:.0f} %"
        data = verdict.robot.model.createData()
        pin.forwardKinematics(verdict.robot.model, data, q)
        turn = Rotation.from_quat(quaternion).as_matrix()
        assert np.allclose(turn, data.liMi[1].rotation, atol=0.02)
    page.close()
