"""A saved view in a real browser: it paints the scene, and its slider moves arm and read-out."""

import numpy as np
import pinocchio as pin
import pytest
from live_pages import PATIENCE_MS, chromium, painted
from scipy.spatial.transform import Rotation

from coverable import check, load_case, view

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


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


def test_the_slider_moves_the_arm_and_the_readout(browser, tmp_path):
    verdict = check(*load_case("paper/4a", ["surface.cells=[4, 5]"]).build())
    drawn = view(verdict, play=False)
    page = browser.new_page(viewport={"width": 900, "height": 640})
    page.goto(drawn.save_html(tmp_path / "view.html").as_uri())
    page.wait_for_function("window.viewer !== undefined", timeout=PATIENCE_MS)
    assert painted(page) > 10, "the start"
    end = drawn.readout.times[-1]
    for time in (0.0, 1.3, 4.7):
        share, values, quaternion = page.evaluate(ASK, time)
        q = drawn.motion.at(np.array([time]))[0]
        assert np.allclose(values[:6], np.degrees(q), atol=0.6)
        assert share == f"{100 * time / end:.0f} %"
        data = verdict.robot.model.createData()
        pin.forwardKinematics(verdict.robot.model, data, q)
        turn = Rotation.from_quat(quaternion).as_matrix()
        assert np.allclose(turn, data.liMi[1].rotation, atol=0.02)
    page.close()
