"""The live page in a real browser, by mouse and keyboard: `make test-browser`.

It needs the extra `browser` (playwright) and a Chromium, which `CHROMIUM` names or the path holds.
Without them it fails.
"""

import re
import time

import numpy as np
import pytest
from live_pages import PATIENCE_MS, chromium, painted, pixels
from playwright.sync_api import expect

from feasibility.cases.case import Case
from feasibility.live.controls import SURFACE
from feasibility.live.serving import Live
from feasibility.reports.verdict import SENTENCES
from feasibility.viewer.live_server import LiveView

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


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


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
