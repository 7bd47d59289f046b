"""Pages fetch nothing, and names make no markup; what commands write is in test_commands.py."""

import html
import re
from dataclasses import replace

import pytest
from page_outline import Page, fetched

import coverable
from coverable import Comparison, check, load_case, read_study, view, view_division, view_placements
from feasibility.collisions.words import UNCHECKED
from feasibility.reports import comparison, explanation, study
from feasibility.studies.robot_comparison import Arm
from feasibility.studies.store import Row
from feasibility.viewer.robot_visuals import joint_paths

EVIL = '</script><script>alert(1)</script><img src=x onerror="alert(2)">/__proto__'


@pytest.fixture(scope="module")
def pages():
    """Every kind of page, with a case, an arm and a joint whose names are markup."""
    setup = load_case("paper/4d", ["surface.cells=[3, 3]"]).build()
    names = (EVIL, *setup.robot.joint_names[1:])
    robot = replace(setup.robot, name=EVIL, joint_names=names)
    verdict = check(robot, *setup[1:])
    pose = coverable.Pose.of_surface(setup.cells.surface)
    region = coverable.Region.around(pose, {"x": (3.0, 3.1)})
    placed = coverable.place(robot, setup.cells, setup.task, region)
    asked = read_study('base.case = "paper/4a"\nvary."task.cone_deg" = [30]\n')
    result = {"verdict": "undecided", "evidence": "budget", "message": EVIL}
    rows = [Row({"task.cone_deg": EVIL}, "failed", result, 0.0)]
    arm = Arm(EVIL, 6, 1.0, "infeasible", "proof", EVIL, cause=EVIL)
    explained = coverable.explain(robot, *setup[1:])
    return {
        "view": view(verdict, EVIL).html(),
        "division": view_division(coverable.divide(robot, *setup[1:]),
                                  EVIL).html(),
        "placements": view_placements(placed, case=EVIL).html(),
        "explanation": explanation.as_html(explained, EVIL, view(verdict, EVIL)),
        "study": study.as_html(replace(asked, name=EVIL, description=EVIL), rows),
        "comparison": comparison.as_html(Comparison(EVIL, (arm,), critical=True)),
    }  # fmt: skip


@pytest.mark.parametrize("name", [
    "view", "division", "placements", "explanation", "study", "comparison"])  # fmt: skip
def test_names_make_no_markup(pages, name):
    text = pages[name]
    whole = Page(text)
    for page in (whole, *whole.frames):
        assert page.tags["script"] == (3 if 'id="commands"' in page.text else 0)
        assert not {"onerror"} & {name for name, _ in page.attributes}
        assert not [value for name, value in page.attributes if name == "src" and value == "x"]
    assert fetched(text) == []
    assert "alert" in html.unescape(text), "the name is there, as text"


def test_names_lead_nowhere_in_the_scene(pages):
    for command in Page(pages["view"]).commands:
        path = command["path"].replace("<object>", "")
        assert not re.search(r"[<>\"'&`]", path), path
        assert not {"__proto__", "constructor"} & set(path.split("/"))
    robot = load_case("paper/4a").build().robot
    names = (EVIL, *robot.joint_names[1:])
    assert len(joint_paths(replace(robot, joint_names=names))[1].split("/")) == 3


def test_the_same_answer_gives_the_same_page_and_a_notebook_keeps_it():
    case = load_case("paper/4a", ["surface.cells=[3, 3]"])
    drawn, again = (view(check(*case.build()), "paper/4a") for _ in range(2))
    assert drawn.html() == again.html()
    bundle = drawn._repr_mimebundle_()
    frame = bundle["text/html"]
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]) == drawn.html()
    assert frame.count(bundle["image/png"]) == 1
    assert frame.index("<img") < frame.index("<iframe")
    verdict = check(*case.build())
    page = verdict._repr_mimebundle_()
    assert page["text/plain"] == repr(verdict)
    assert "9 of 9 cells in one motion" in page["text/html"]
    assert UNCHECKED in page["text/html"].lower()


def test_the_page_of_the_motion_has_a_player():
    case = load_case("paper/4a", ["surface.cells=[2, 2]"])
    moving = view(check(*case.build()))
    still = view(check(*load_case("paper/4f", ["surface.cells=[2, 2]"]).build())).html()
    for part in ('type="range"', 'id="readout"', 'id="pause"'):
        assert part in moving.html()
        assert part not in still
    rows = (("</script><script>alert(1)</script>", "deg", [0.0, 1.0]),)
    shown = replace(moving.readout, rows=rows, times=(0.0, 1.0))
    assert rows[0][0] not in replace(moving, readout=shown).html()
