"""Bad scenes, end to end: one message with every fault, or a verdict with its cause."""

import json

import numpy as np
import pinocchio as pin
import pytest
from mesh_writers import stl_of

from feasibility import check
from feasibility.cases import Case
from robots import load_robot

CASE = """
robot.name = "ur5"
surface = { kind = "plane", u = [0.4, 0.6], v = [-0.1, 0.1], cells = [2, 2], side = "outside" }
task = { standoff = 0.02, cone_deg = 30 }
[collision]
"""
PANDA = '<robot name="panda">{}</robot>'.format(
    '<disable_collisions link1="panda_link1" link2="panda_link2" reason="Adjacent"/>'
)
TRIANGLES = np.array([[[0.0, 0, 0], [1, 0, 0.1], [0, 1, 0]], [[1, 0, 0.1], [1, 1, 0], [0, 1, 0]]])


@pytest.fixture
def ask(ask, tmp_path, monkeypatch):
    """ask(command, lines of [collision], more) -> status, stdout, stderr, in an own folder."""
    monkeypatch.chdir(tmp_path)
    nan = TRIANGLES.copy()
    nan[1, 1, 1] = np.nan
    for name, triangles in (
        ("empty", TRIANGLES[:0]), ("line", TRIANGLES * [1, 0, 0]), ("nan", nan),
        ("huge", TRIANGLES * 1e9),
    ):  # fmt: skip
        (tmp_path / f"{name}.stl").write_bytes(stl_of(triangles))
    with (tmp_path / "many.stl").open("wb") as stream:
        stream.write(bytes(80) + (5_000_000).to_bytes(4, "little"))
        stream.truncate(84 + 50 * 5_000_000)  # takes no room on the disk
    (tmp_path / "panda.srdf").write_text(PANDA)

    def asked(command, lines, *more):
        (tmp_path / "case.toml").write_text(CASE + lines)
        return ask(command, "case.toml", *more)

    return asked


def mesh(name):
    return f'[[collision.scene]]\nname = "{name}"\nkind = "mesh"\nfile = "{name}.stl"\n'


MESHES = {
    "empty": "holds no faces",
    "line": "flat|no area|no face",
    "nan": "finite numbers",
    "huge": "m wide",
    "many": "5,000,000 faces, more than the 2,000,000",
    "nowhere": "there is no such file",
}


def test_all_meshes_and_numbers_are_named_at_once(ask):
    lines = 'clearance = -0.01\ntool_clearance = "a lot"\n' + "".join(map(mesh, MESHES))
    status, out, err = ask("check", lines)
    assert (status, out) == (2, "")
    faults = err.splitlines()[1:]
    assert len(faults) == len(MESHES) + 2
    assert "collision.clearance: must be a number in 0 .. 10" in err
    assert "collision.tool_clearance: " in err
    for number, (name, words) in enumerate(MESHES.items()):
        (line,) = [fault for fault in faults if f"'{name}.stl'" in fault]
        assert line.startswith(f"  collision.scene[{number}].file: ")
        assert any(word in line for word in words.split("|")), line


def test_an_srdf_of_another_robot_beside_other_faults(ask):
    """It is found once the arm is loaded, and so are pairs of what is not there."""
    srdf = 'srdf = "panda.srdf"\n'
    for lines, words in (
        (srdf + 'allow = [["elbow", "surface"]]\n', "collision.allow[0]: must be a link"),
        (srdf + mesh("nan"), "collision.scene[0].file: 'nan.stl'"),
    ):
        status, out, err = ask("check", lines)
        assert (status, out) == (2, "")
        assert words in err
        assert "collision.srdf: " in err
        assert "panda_link1, panda_link2; is it of another robot?" in err
        assert len(err.splitlines()) == 3


@pytest.mark.parametrize(
    ("lines", "pair", "told"),
    [
        ("tool_clearance = 0.05", "wrist_3_link and surface", "larger than the standoff (20 mm)"),
        (
            '[[collision.scene]]\nname = "rock"\nkind = "sphere"\nradius = 0.3',
            "shoulder_link and rock",
            "",
        ),
    ],
    ids=["more clearance than standoff", "the base swallowed"],
)
def test_what_leaves_no_room_is_a_verdict_with_its_cause(ask, lines, pair, told):
    status, out, err = ask("check", lines, "--json")
    answer = json.loads(out)
    assert (status, answer["verdict"]) in ((1, "infeasible"), (3, "undecided"))
    assert answer["covered"] == 0
    missed = answer["uncovered"]
    assert len(missed) == 4
    assert {cause["cause"] for cause in missed} == {"collision"}
    assert all(pair in cause["detail"] for cause in missed)
    assert told in err


BOX = """
self = false
surface = false
[[collision.tool]]
kind = "box"
size = [0.2, 0.02, 0.02]
position = [0.1, 0, -0.05]
[[collision.scene]]
name = "pin"
kind = "sphere"
radius = 0.01
"""


def test_a_motion_of_somebody_else_is_refused_where_it_collides_between_its_rows(ask, tmp_path):
    """The tool turns about its own axis: its point stays, and a bar at its side meets a pin."""
    robot = load_robot("ur5")
    one = "surface.cells=[1, 1]"
    q = check(*Case.from_toml(CASE).with_overrides([one]).build()).witness.q[0]
    rows = np.vstack([q, q - np.copysign(np.pi / 2.0, q[5]) * np.eye(6)[5]])
    table = [",".join(robot.joint_names), *(",".join(map(repr, row.tolist())) for row in rows)]
    (tmp_path / "foreign.csv").write_text("\n".join(table) + "\n")
    half = robot_frame(robot, rows.mean(axis=0))
    answers = []
    for along, status in ((0.25, 0), (0.15, 1)):  # beyond the end of the bar, and in its way
        place = half.act(np.array([along, 0.0, -0.05])).tolist()
        lines = f"{BOX}position = {place}\n"
        done, out, err = ask("verify", lines, "foreign.csv", "--json", "--set", one)
        assert (done, err) == (status, "")
        answers.append(json.loads(out))
    assert [answer["verdict"] for answer in answers] == ["holds", "does not hold"]
    (fault,) = answers[1]["refusals"]
    assert (fault["row"], fault["share"]) == (1, pytest.approx(0.5, abs=0.1))
    assert "tool and pin" in fault["text"]
    assert "overlap by 20 mm" in fault["text"]


def robot_frame(robot, q):
    """The tool frame by Pinocchio."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.tool_frame_id]
