"""The picture: what it holds, that it moves like the arm, and that it is safe to open and serve."""

import base64
import gzip
import html
import itertools
import json
import re
import shutil
import socket
import subprocess
import sys
import urllib.request
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser

import networkx as nx
import numpy as np
import pinocchio as pin
import pytest
import umsgpack
from fabricated import DOME, STEPS, TASK, every_cause, verdict_on
from guards import GUARD_S
from scipy.spatial.transform import Rotation

from feasibility import CauseKind
from feasibility.viewer import cell_meshes as cell_shapes
from feasibility.viewer import playback as motion
from feasibility.viewer import scene, view
from feasibility.viewer.live_server import LiveView
from feasibility.viewer.robot import joint_paths, pose
from feasibility.viewer.viewer import show
from robots import Kinematics, load_robot
from surfaces import cylinder

MISSED = {5, 6, 13, 14, 15, 22, 29}
BROWSER = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "chrome"])), None)


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560", limits="set-1")


@pytest.fixture(scope="module")
def feasible(puma):
    return verdict_on(puma, DOME.cells(4, 5))


@pytest.fixture(scope="module")
def infeasible(puma):
    return verdict_on(puma, DOME.cells(5, 6), missed=MISSED, causes=every_cause(MISSED))


@pytest.fixture(scope="module")
def drawn(feasible):
    return view(feasible, "paper/4a")


def numbers(extension, dtype="<f4"):
    """The array inside a MessagePack extension."""
    return np.frombuffer(extension.data, dtype=dtype)


def objects(commands):
    """Path -> geometry data of every object that is set."""
    return {
        command["path"]: command["object"]["geometries"][0]["data"]
        for command in commands
        if command["type"] == "set_object"
    }


def vertices(geometry):
    return numbers(geometry["attributes"]["position"]["array"]).reshape(-1, 3)


def only(items):
    (item,) = items
    return item


def unpacked(page, identifier):
    """The bytes that the page unpacks from one of its data blocks."""
    block = re.search(rf'id="{identifier}">([^<]*)<', page)
    return gzip.decompress(base64.b64decode(block[1]))


class Tags(HTMLParser):
    """Counts tags, and collects attributes."""

    def __init__(self, text):
        super().__init__()
        self.tags = Counter()
        self.attributes = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        self.attributes += attrs


def test_every_edge_of_the_graph_is_drawn_from_target_to_target(feasible):
    lines = scene.edge_lines(feasible)
    points = TASK.targets(feasible.cells).points
    assert len(lines) == feasible.graph.number_of_edges() == 55
    for pair, line in zip(feasible.graph.edges, lines, strict=True):
        assert np.allclose(line[[0, -1]], points[list(pair)], atol=1e-9)
    height = feasible.cells.surface.closest(lines).height
    assert np.allclose(height, -TASK.standoff, atol=1e-6), "on the tool's side of the dome"
    tubes = only(d for p, d in objects(view(feasible).commands).items() if "edges of G" in p)
    bodies = nx.Graph(numbers(tubes["index"]["array"], "<u2").reshape(-1, 3)[:, :2].tolist())
    bodies.add_edges_from(numbers(tubes["index"]["array"], "<u2").reshape(-1, 3)[:, 1:].tolist())
    assert nx.number_connected_components(bodies) == 55


def test_a_graph_without_motions_and_tree_is_drawn_and_stands_still(feasible):
    graph = nx.Graph(feasible.graph.edges)
    graph.add_nodes_from(range(len(feasible.cells)))
    bare = view(replace(feasible, graph=graph, tree=None))
    assert bare.motion is None
    assert any("55 edges of G" in entry.label for entry in bare.legend.entries)


def test_cells_that_are_not_covered_are_coloured_by_their_cause(infeasible):
    drawn = view(infeasible)
    kinds = {cause.cell: cause.kind for cause in infeasible.causes}
    expected = {kind: {c for c in MISSED if kinds.get(c) == kind} for kind in [*CauseKind, None]}
    for kind, cells in expected.items():
        words = "not covered" if kind is None else f"not covered: {kind.replace('_', ' ')}"
        path = f"/cells/{words} ({len(cells)})"
        closest_point = infeasible.cells.surface.closest(vertices(objects(drawn.commands)[path]))
        assert np.allclose(closest_point.height, 0.0, atol=1e-4)
        rows = np.floor((closest_point.u - np.radians(10)) / np.radians(80) * 5)
        columns = np.floor((closest_point.v - np.radians(10)) / np.radians(170) * 6)
        assert set((rows * 6 + columns).astype(int)) == cells
        colour = scene.MISSED if kind is None else scene.CAUSES[kind]
        entry = only(e for e in drawn.legend.entries if e.path == path)
        assert entry.colour == colour
        assert entry.label == f"{words} ({len(cells)})"
    assert len(set(scene.CAUSES.values()) | {scene.MISSED, scene.EDGES, scene.START}) == 8


def test_a_covered_surface_shows_no_missed_cells_and_marks_the_start(feasible, drawn):
    paths = objects(drawn.commands)
    assert not any(path.startswith("/cells/") for path in paths)
    ball = vertices(only(data for path, data in paths.items() if "/start" in path))
    target = TASK.targets(feasible.cells).points[feasible.start]
    assert np.allclose(ball.mean(axis=0), target, atol=1e-4)
    assert {"/ground", "/root frame", "/surface/patch"} <= set(paths)


def test_the_surface_is_smooth_and_its_normals_are_the_surfaces(feasible):
    points, faces, normals = cell_shapes.patch(feasible.cells, np.arange(20))
    closest_point = feasible.cells.surface.closest(points)
    assert np.allclose(closest_point.height, 0.0, atol=1e-12)
    assert np.allclose(closest_point.normal, normals, atol=1e-9)
    corners = points[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1).sum() / 2.0
    assert area == pytest.approx(feasible.cells.areas.sum(), rel=2e-3)


def test_components_are_not_listed(infeasible):
    """The cells that another motion reaches are in the colour of their cause."""
    parts = tuple(np.array([k]) for k in range(12))
    drawn = view(replace(infeasible, components=parts))
    assert not any("component" in entry.label for entry in drawn.legend.entries)


def test_key_frames_place_every_joint_where_pinocchio_does(feasible, drawn):
    robot = feasible.robot
    animation = only(c for c in drawn.commands if c["type"] == "set_animation")
    rest = {c["path"]: c["matrix"] for c in drawn.commands if c["type"] == "set_transform"}
    played = drawn.motion
    times = motion.key_times(played)
    assert len(times) <= motion.KEY_FRAMES
    chains = np.tile(np.eye(4), (len(times), robot.n, 1, 1))
    paths = joint_paths(robot)[1:]
    for joint, (path, clip) in enumerate(zip(paths, animation["animations"], strict=True)):
        track = only(clip["clip"]["tracks"])
        assert (clip["path"], track["name"]) == (path, ".quaternion")
        assert np.allclose(numbers(track["times"]), times, atol=1e-5)
        turns = numbers(track["values"]).reshape(-1, 4)
        assert ((turns[1:] * turns[:-1]).sum(axis=1) > 0).all()
        chains[:, joint, :3, :3] = Rotation.from_quat(turns).as_matrix()
        chains[:, joint, :3, 3] = np.reshape(rest[path], (4, 4)).T[:3, 3]
    data = robot.model.createData()
    for row, q in enumerate(played.at(times)):
        pin.forwardKinematics(robot.model, data, q)
        place = np.eye(4)
        for joint in range(robot.n):
            place = place @ chains[row, joint]
            assert np.allclose(place, data.oMi[joint + 1].homogeneous, atol=1e-5)


def test_a_line_leads_from_the_flange_to_the_tool_point():
    robot = load_robot("ur5", tcp=((0.03, 0, 0.15), (0, 0, 0)))
    nothing = verdict_on(robot, DOME.cells(2, 2), missed=range(4))
    path = f"{joint_paths(robot)[robot.n]}/flange to TCP"
    rod = vertices(objects(view(nothing).commands)[path])
    frames = [robot.model.frames[k] for k in (robot.tool_link_id, robot.tool_frame_id)]
    ends = np.array([frame.placement.translation for frame in frames])
    assert np.allclose(rod.reshape(2, -1, 3).mean(axis=1), ends, atol=1e-5)


def test_a_sliding_joint_slides(tmp_path):
    rail = tmp_path / "rail.urdf"
    rail.write_text(
        '<robot name="rail"><link name="a"/><link name="b"/><link name="c"/>'
        '<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/>'
        '<axis xyz="1 0 0"/><limit lower="0" upper="2" effort="1" velocity="1"/></joint>'
        '<joint name="turn" type="revolute"><parent link="b"/><child link="c"/>'
        '<origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    robot = load_robot(str(rail))
    played = motion.paced(robot, np.array([[0.0, 0.0], [2.0, 1.0]]), False, "test")
    command = motion.animate(robot, played, play=True)
    slide, turn = (only(part["clip"]["tracks"]) for part in command["animations"])
    assert (slide["name"], turn["name"]) == (".position", ".quaternion")
    where = numbers(slide["values"]).reshape(-1, 3)
    assert np.allclose(where[:, 0], played.at(numbers(slide["times"]))[:, 0], atol=1e-5)
    assert np.allclose(where[:, 1:], 0.0)


def test_the_longest_path_of_the_tree_is_one_continuous_motion(feasible):
    cells = motion.longest_path(feasible.tree, feasible.cells.centres)
    assert cells[0] == feasible.start
    assert all(feasible.tree.has_edge(a, b) for a, b in itertools.pairwise(cells))
    assert feasible.tree.out_degree(cells[-1]) == 0
    walk = motion.walk_along(feasible.graph, cells)
    assert len(walk) == (len(cells) - 1) * (STEPS - 1) + 1
    for number, cell in enumerate(cells):
        assert np.array_equal(walk[number * (STEPS - 1)], feasible.graph.nodes[cell]["q"])
    assert motion.motion_of(feasible).there_and_back


def test_a_longer_branch_wins_over_a_nearer_one():
    tree = nx.DiGraph([(0, 1), (0, 5), (5, 6), (6, 7)])
    centres = np.arange(8.0)[:, None] * [1.0, 0.0, 0.0]
    centres[1] = [3.0, 0.0, 0.0]
    assert motion.longest_path(tree, centres) == [0, 5, 6, 7]
    centres[1] = [9.0, 0.0, 0.0]
    assert motion.longest_path(tree, centres) == [0, 1]
    assert motion.longest_path(None, centres) == []


def test_motions_that_do_not_join_are_refused(feasible):
    graph = feasible.graph.copy()
    a, b = motion.longest_path(feasible.tree, feasible.cells.centres)[1:3]
    graph.edges[a, b]["motion"] = graph.edges[a, b]["motion"] + 0.1
    with pytest.raises(ValueError, match=f"from cell {a} to cell {b} starts 0.1 rad"):
        view(replace(feasible, graph=graph))


def test_the_witness_is_what_moves_where_there_is_one(puma):
    verdict = verdict_on(puma, DOME.cells(3, 3), witness=True)
    played = view(verdict).motion
    assert played.label == "covering motion"
    assert not played.there_and_back
    assert np.array_equal(played.walk, verdict.witness.q)
    expected = [Kinematics(puma).tool(q)[0] for q in verdict.witness.q]
    assert np.array_equal(played.points, expected)


def test_the_pace_is_even(feasible):
    played = motion.motion_of(feasible)
    assert played.seconds[0] == 0.0
    assert motion.SHORTEST <= played.seconds[-1] <= motion.LONGEST
    kinematics = Kinematics(feasible.robot)
    even = played.at(np.linspace(0, played.seconds[-1], 200))
    steps = np.diff([kinematics.tool(q)[0] for q in even], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    assert lengths.max() < 1.5 * lengths.mean()


def test_an_arm_that_only_turns_its_wrist_does_not_jump(puma):
    walk = np.zeros((3, 6))
    walk[1:, 5] = [1.0, 3.0]  # the tool point stays where it is
    played = motion.paced(puma, walk, False, "test")
    assert np.allclose(played.seconds / played.seconds[-1], [0.0, 1 / 3, 1.0])


def test_nothing_to_cover_and_nothing_covered_are_drawn_too(puma):
    empty = verdict_on(puma, DOME.cells(0, 5))
    lost = verdict_on(puma, DOME.cells(2, 2), missed=set(range(4)))
    one = verdict_on(puma, DOME.cells(1, 1))
    closed = verdict_on(
        puma, cylinder(0.5, angle_deg=(0, 360), height=(0, 0.4)).cells(6, 2), missed={3}
    )
    for verdict in (empty, lost, one):
        assert view(verdict).motion is None
    for verdict in (empty, lost, one, closed):
        assert "data-path" in view(verdict).html()


def test_the_arm_rests_where_it_is_asked_to(feasible):
    waiting = view(feasible, play=False, at=0.5)
    middle = waiting.motion.at(np.array([waiting.motion.seconds[-1] / 2]))[0]
    assert list(waiting.commands[-6:]) == pose(feasible.robot, middle)
    animation = only(c for c in waiting.commands if c["type"] == "set_animation")
    assert animation["options"]["play"] is False
    assert animation["options"]["repetitions"] == float("inf")


def test_the_page_holds_the_scene_and_fetches_nothing(drawn):
    page = drawn.html()
    tags = Tags(page)
    assert not {name for name, _ in tags.attributes} & {"src", "href", "srcset", "action", "data"}
    assert tags.tags["script"] == 3
    assert not {"link", "img", "iframe", "object", "base"} & set(tags.tags)
    assert "://" not in re.sub(r'id="(program|commands)">[^<]*<', "", page).replace('"ws://"', "")
    program = unpacked(page, "program").decode()
    assert set(re.findall(r"https?://[\w./]+", program)) <= {"http://www.w3.org/1999/xhtml"}
    data = unpacked(page, "commands")
    commands, at = [], 0
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "little")
        commands.append(umsgpack.unpackb(data[at + 4 : at + 4 + length]))
        at += 4 + length
    assert commands == list(drawn.commands)
    assert len(page) < 2_000_000


def test_the_same_verdict_gives_the_same_page(feasible, drawn):
    assert view(feasible, "paper/4a").html() == drawn.html()


def test_a_notebook_keeps_the_page(drawn):
    frame = drawn._repr_mimebundle_()["text/html"]
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]) == drawn.html()


def test_the_page_is_saved(drawn, tmp_path):
    file = drawn.save_html(tmp_path / "view.html")
    assert file.read_text(encoding="utf-8") == drawn.html()


def test_names_from_files_stay_text(puma, feasible):
    evil = '</script><script>alert(1)</script><img src=x onerror="alert(2)">/__proto__'
    names = (evil, *puma.joint_names[1:])
    verdict = replace(feasible, robot=replace(puma, name=evil, joint_names=names))
    drawn = view(verdict, case=evil)
    page = drawn.html()
    assert Tags(page).tags["script"] == 3
    assert "img" not in Tags(page).tags
    assert "alert" in html.unescape(page)
    for command in drawn.commands:
        path = command["path"].replace("<object>", "")
        assert not re.search(r"[<>\"'&`]", path), path
        assert not {"__proto__", "constructor"} & set(path.split("/"))
    assert len(joint_paths(verdict.robot)[1].split("/")) == 3, "a slash makes no level of its own"


def test_show_serves_the_view_and_opens_a_window(feasible, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    live = show(feasible, block=False)
    with live, urllib.request.urlopen(only(opened)) as answer:
        assert answer.read().decode() == view(feasible).html()


def test_show_in_a_notebook_is_the_view_itself(feasible, monkeypatch):
    class Shell:
        kernel = object()

    class IPython:
        get_ipython = staticmethod(Shell)

    monkeypatch.setitem(sys.modules, "IPython", IPython)
    monkeypatch.setattr("webbrowser.open", pytest.fail)
    assert "<iframe srcdoc=" in show(feasible)._repr_mimebundle_()["text/html"]


def test_a_script_waits_until_it_is_interrupted(feasible, monkeypatch):
    def interrupt(live):
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", lambda url: True)
    monkeypatch.setattr(LiveView, "wait", interrupt)
    monkeypatch.delattr(sys, "ps1", raising=False)
    live = show(feasible)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S)


def test_the_title_says_the_verdict_and_what_is_covered(feasible, infeasible):
    assert view(feasible, "a").legend.title == "a: feasible (witness), 20 of 20 cells"
    assert view(infeasible).legend.title == "infeasible (exhausted), 23 of 30 cells"


def test_the_readout_is_what_pinocchio_says(feasible, drawn):
    """Joint values, and distance and angle of the tool, at any time of the motion."""
    shown, robot, surface = drawn.readout, feasible.robot, feasible.cells.surface
    assert [row[0] for row in shown.rows] == [*robot.joint_names, "distance", "angle"]
    assert [row[1] for row in shown.rows] == ["deg"] * 6 + ["mm", "deg"]
    columns = np.array([row[2] for row in shown.rows])
    data = robot.model.createData()
    for k in range(0, len(shown.times), 7):
        q = drawn.motion.at(np.array([shown.times[k]]))[0]
        assert np.allclose(columns[:6, k], np.degrees(q), atol=0.06)
        pin.framesForwardKinematics(robot.model, data, q)
        tool = data.oMf[robot.tool_frame_id]
        distance = 1.0 - np.linalg.norm(tool.translation - surface.position)  # a dome of 1 m
        outward = (tool.translation - surface.position) / (1.0 - distance)
        angle = np.degrees(np.arccos(tool.rotation @ robot.approach_axis @ outward))
        assert np.allclose(columns[6:, k], [1e3 * distance, angle], atol=0.1)


def test_the_page_has_a_player_where_the_arm_moves(feasible, drawn):
    graph = nx.Graph(feasible.graph.edges)
    graph.add_nodes_from(range(len(feasible.cells)))
    still = view(replace(feasible, graph=graph, tree=None)).html()
    moving = drawn.html()
    for part in ('type="range"', 'id="readout"', 'id="pause"'):
        assert part in moving
        assert part not in still
    assert ".dg { display: none !important; }" in moving
    assert drawn.readout.duration is None, "its pace is the view's own"


def test_names_in_the_readout_close_no_script(drawn):
    hostile = "</script><script>alert(1)</script>"
    rows = ((hostile, "deg", [0.0, 1.0]),)
    shown = replace(drawn.readout, rows=rows, times=(0.0, 1.0))
    assert hostile not in replace(drawn, readout=shown).html()


if BROWSER is not None:  # the data of the scene is tested above, with and without one

    def test_a_browser_paints_the_scene(feasible, tmp_path):
        from PIL import Image

        page = view(feasible, "paper/4a", play=False).save_html(tmp_path / "view.html")
        picture = tmp_path / "view.png"
        subprocess.run(
            [
                BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu",
                "--disable-dev-shm-usage", "--virtual-time-budget=15000",
                f"--user-data-dir={tmp_path / 'profile'}", "--window-size=700,500",
                f"--screenshot={picture}", page.as_uri(),
            ],
            check=True, capture_output=True, timeout=GUARD_S,
        )  # fmt: skip
        with Image.open(picture) as image:
            pixels = np.asarray(image.convert("RGB"), dtype=int)[:, 250:]  # beside the legend
        red, green, blue = np.moveaxis(pixels, -1, 0)
        assert pixels.std() > 10
        assert ((blue > 180) & (red < 90) & (green < 120)).sum() > 300, "edges of G"
        assert ((green > 1.5 * red) & (green > 1.5 * blue)).sum() > 10, "the start"
        assert ((red > 200) & (green > 200) & (blue < red - 5)).sum() > 300, "the arm's body"

    def test_the_slider_moves_the_arm_and_the_readout(feasible, tmp_path):
        """The page is asked what it shows at some moments; the arm stands as the read-out says."""
        drawn = view(feasible, play=False)
        asked = [0.0, 1.3, 4.7]
        page = drawn.html() + PROBE.replace("ASKED", str(asked))
        file = tmp_path / "probe.html"
        file.write_text(page, encoding="utf-8")
        done = subprocess.run(
            [
                BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu",
                "--disable-dev-shm-usage", "--virtual-time-budget=15000",
                f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", file.as_uri(),
            ],
            check=True, capture_output=True, timeout=GUARD_S, text=True,
        )  # fmt: skip
        answers = json.loads(
            html.unescape(re.search(r'<pre id="said">(.*?)</pre>', done.stdout)[1])
        )
        for time, answer in zip(asked, answers, strict=True):
            q = drawn.motion.at(np.array([time]))[0]
            assert np.allclose([float(x) for x in answer["values"][:6]], np.degrees(q), atol=0.6)
            end = drawn.readout.times[-1]
            assert answer["share"] == f"{100 * time / end:.0f} %"
            turn = Rotation.from_quat(answer["quaternion"]).as_matrix()
            joint = feasible.robot.model.createData()
            pin.forwardKinematics(feasible.robot.model, joint, q)
            assert np.allclose(turn, joint.liMi[1].rotation, atol=0.02)


PROBE = """<script>
const wait = setInterval(() => {
  if (!window.viewer) return;
  clearInterval(wait);
  const slider = document.getElementById("time"), said = [];
  for (const time of ASKED) {
    slider.value = time;
    slider.dispatchEvent(new Event("input"));
    const share = document.getElementById("seconds").textContent;
    const values = [...document.querySelectorAll("#readout tr")].map((r) => r.cells[1].textContent);
    const joint = viewer.scene_tree.find(["robot", "joint joint1"]).object.quaternion;
    said.push({ share, values, quaternion: [joint.x, joint.y, joint.z, joint.w] });
  }
  const note = document.createElement("pre");
  note.id = "said";
  note.textContent = JSON.stringify(said);
  document.body.appendChild(note);
}, 50);
</script>"""
