"""The live page in a real browser, by mouse and keyboard: `make test-browser`.

It needs the extra `browser` (playwright) and a Chromium, which `CHROMIUM` names or the path holds.
Without them it fails.
"""

import re
import time

import numpy as np
import pytest
from live_pages import (
    GREEN,
    PATIENCE_MS,
    PLATE,
    certified,
    chromium,
    colours,
    handle,
    opened,
    painted,
    quick,
    values,
)
from playwright.sync_api import expect

from coverable import Case, Live, check, load_case
from feasibility.reports import verdict as report
from feasibility.viewer.live_server import LiveView


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def served():
    with Live(Case.from_toml(PLATE, name="plate")) as live:
        yield live


@pytest.fixture
def tab(browser, served):
    page = opened(browser, served)
    yield page
    page.close()


def test_a_slider_is_dragged_and_the_cells_change_colour(tab):
    assert tab.inner_text("#verdict") == report.SENTENCES["feasible"]
    expect(tab.locator("#progress")).to_have_text("certified · 48 of 48 cells · evidence: witness")
    assert set(colours(tab)) == {GREEN}
    green, red = painted(tab), painted(tab, "red")
    assert green > 2000

    slider = tab.locator("#position-x")
    box = slider.bounding_box()
    middle, height = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.mouse.move(middle, height)
    tab.mouse.down()
    tab.mouse.move(middle + 0.22 * box["width"], height, steps=6)
    quick(tab)
    assert GREEN not in colours(tab)  # paler while it is not certified
    tab.mouse.up()
    certified(tab, "infeasible")
    assert values(tab)["position"][0] > 250
    assert tab.inner_text("#verdict") == report.SENTENCES["infeasible"]
    expect(tab.locator("#badge")).to_be_hidden()
    missed = [colour for colour in colours(tab) if colour != GREEN]
    assert 0 < len(missed) <= 48
    assert painted(tab) < green
    assert painted(tab, "red") > red + 500
    assert f"{48 - len(missed)} of 48 cells" in tab.inner_text("#progress")
    assert "out of reach" in tab.inner_text("#causes")
    expect(tab.locator("#painted")).to_be_in_viewport(
        ratio=1
    )  # beside the cells, without scrolling
    assert "not covered: out of reach" in tab.inner_text("#painted")
    assert "proof: a bound shows" in tab.inner_text("#rows")

    tab.keyboard.press("Control+z")
    certified(tab, "feasible")
    assert values(tab)["position"] == [0, 0, 100]
    assert set(colours(tab)) == {GREEN}
    tab.click("#redo")
    certified(tab, "infeasible")
    tab.click("#reset")
    certified(tab, "feasible")
    assert values(tab)["position"] == [0, 0, 100]


def test_the_handle_is_dragged_along_an_axis_in_the_plane_and_around(tab):
    before = values(tab)
    begin, end = handle(tab, (0.9, 0, 0)), handle(tab, (3.6, 0, 0))
    tab.mouse.move(*begin)
    expect(tab.locator("#meshcat-pane")).to_have_class("handle")
    tab.mouse.down()
    tab.mouse.move(*end, steps=6)
    quick(tab)
    moved = values(tab)
    assert moved["position"][0] > before["position"][0] + 50
    assert moved["position"][1:] == before["position"][1:]  # the arrow of x moves along x alone
    tab.mouse.up()
    certified(tab)
    assert values(tab) == moved
    answered = tab.evaluate("window.page.questions.number")

    tab.mouse.move(*handle(tab))
    tab.mouse.down()
    x, y = handle(tab)
    tab.mouse.move(x - 60, y - 40, steps=4)
    tab.mouse.up()
    certified(tab)
    shifted = values(tab)["position"]
    assert shifted[:2] != moved["position"][:2]
    assert shifted[2] == moved["position"][2]  # seen from above, the ball moves level

    tab.mouse.move(*handle(tab, (0, -0.62, 0)))
    tab.mouse.down()
    tab.mouse.move(*handle(tab, (0.44, -0.44, 0)), steps=4)
    tab.mouse.up()
    certified(tab)
    turned = values(tab)
    assert 35 <= turned["rpy_deg"][2] <= 55
    assert turned["rpy_deg"][:2] == [0, 0]
    assert tab.evaluate("window.page.questions.number") > answered
    # The middle of the surface stays where it is while the surface turns.
    centre = tab.evaluate("window.page.scene.handle.body.position.toArray()")
    yaw = np.radians(turned["rpy_deg"][2])
    middle = np.array([0.5 * np.cos(yaw), 0.5 * np.sin(yaw), 0.0])
    assert np.allclose(1e-3 * np.array(turned["position"]) + middle, centre, atol=2e-5)
    assert np.allclose(1e-3 * np.array(shifted) + [0.5, 0, 0], centre, atol=2e-5)


def test_keys_move_a_slider_by_steps(tab):
    tab.focus("#cone")
    tab.keyboard.press("ArrowRight")
    certified(tab)
    assert values(tab)["cone_deg"] == 20.5
    tab.keyboard.press("PageDown")
    certified(tab)
    assert values(tab)["cone_deg"] == 15.5
    tab.focus("#limit-2-high")
    tab.keyboard.press("Shift+ArrowLeft")
    certified(tab)
    low, high = values(tab)["limits"]["elbow_joint"]
    assert (low, high) == (
        tab.evaluate("window.page.described.controls.values")["limits"]["elbow_joint"][0],
        175,
    )


def test_what_makes_no_sense_is_said_and_the_page_goes_on(tab):
    tab.fill("#standoff-number", "-3")
    tab.keyboard.press("Enter")
    expect(tab.locator("#answer")).to_have_class(re.compile("^error"), timeout=PATIENCE_MS)
    assert "task.standoff: must be a finite number >= 0" in tab.inner_text("#verdict")
    tab.fill("#limit-2-low-number", "170")
    tab.fill("#limit-2-high-number", "160")
    tab.fill("#standoff-number", "15")
    tab.keyboard.press("Enter")
    expect(tab.locator("#verdict")).to_contain_text("the wrong way round", timeout=PATIENCE_MS)
    tab.click("#reset")
    certified(tab, "feasible")


def test_the_saved_case_is_what_is_shown(tab, served, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tab.fill("#position-x-number", "130.5")
    tab.fill("#rotation-yaw-number", "12")
    tab.fill("#standoff-number", "31")
    tab.keyboard.press("Enter")
    certified(tab)
    with tab.expect_download() as begun:
        tab.click("#save")
    assert begun.value.suggested_filename == "plate-live.toml"
    assert list(tmp_path.iterdir()) == []  # the browser keeps it; the program writes nothing
    begun.value.save_as(tmp_path / "saved.toml")
    saved = load_case(tmp_path / "saved.toml")
    assert saved.surface.position == (0.1305, 0.0, 0.1)
    assert saved.surface.rpy_deg == (0.0, 0.0, 12.0)
    assert saved.task.standoff == 0.031
    covered = check(*saved.build()).covered
    assert np.array_equal([colour == GREEN for colour in colours(tab)], covered)


def test_a_closed_page_is_forgotten(browser, served, tab):
    sessions = served._server.sessions
    others = len(sessions)
    other = opened(browser, served)
    assert len(sessions) == others + 1
    other.goto("about:blank")
    end = time.monotonic() + PATIENCE_MS / 1e3
    while len(sessions) > others and time.monotonic() < end:
        time.sleep(0.05)
    assert len(sessions) == others
    other.close()
    certified(tab, "feasible")


def test_a_question_that_nobody_heard_is_asked_again(tab):
    tab.context.set_offline(True)
    tab.fill("#cone-number", "25")
    tab.keyboard.press("Enter")
    expect(tab.locator("#trouble")).to_contain_text("nobody answers", timeout=PATIENCE_MS)
    assert tab.inner_text("#progress") == "not answered"
    tab.context.set_offline(False)
    certified(tab, "feasible")
    expect(tab.locator("#trouble")).to_be_hidden()
    assert values(tab)["cone_deg"] == 25


def test_a_notebook_shows_the_page_over_a_picture_that_outlives_it(browser):
    """The output stands on a page of another origin, as Jupyter's do."""
    live = Live(Case.from_toml(PLATE, name="plate"))
    try:
        with LiveView(live._repr_mimebundle_()["text/html"]) as notebook:
            page = browser.new_page(viewport={"width": 1000, "height": 700})
            page.goto(notebook.url)
            inner = page.frame_locator("iframe")
            expect(inner.locator("#answer")).to_have_class(
                re.compile("^feasible *$"), timeout=PATIENCE_MS
            )
            inner.locator("#cone-number").fill("5")
            inner.locator("#cone-number").press("Enter")
            expect(inner.locator("#undo")).to_be_enabled()
            expect(inner.locator("#answer")).to_have_class(
                re.compile("^(feasible|infeasible|undecided) *$"), timeout=PATIENCE_MS
            )
            live.close()
            inner.locator("#cone-number").fill("6")
            inner.locator("#cone-number").press("Enter")
            expect(inner.locator("#trouble")).to_contain_text("has ended", timeout=PATIENCE_MS)
            page.reload()
            page.wait_for_timeout(1000)
            assert page.locator("iframe").count() == 0
            assert page.evaluate("document.querySelector('img').naturalWidth") > 400
            page.close()
    finally:
        live.close()
