"""A live page: who is served, that answers are those of `check`, that what is saved is shown."""

import base64
import http.client
import itertools
import math
import re
import socket

import numpy as np
import pinocchio as pin
import psutil
import pytest
from command_table import FILES
from live_windows import GUARD_S, Window, until

from coverable import Case, Live, View, check, live
from coverable.errors import CoverableError
from feasibility.live import serving
from feasibility.live.answers import Watch, quick_look
from feasibility.live.controls import BASE, LIMITS, SURFACE, TASK, TCP
from feasibility.live.page import Page
from feasibility.reports import verdict as report
from feasibility.viewer.live_server import LiveView
from robots.kinematics import Kinematics

PLATE = Case.from_toml(FILES["plate.toml"], name="plate")


@pytest.fixture(scope="module")
def served():
    with Live(PLATE) as one:
        yield one


@pytest.fixture
def window(served):
    one = Window(served)
    one.answered()
    yield one
    one.close()
    until(lambda: one.page.closed)


def status(port, path, **headers):
    """What a request for a file, and one for viser's socket, are answered with."""
    socket_too = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                  "Sec-WebSocket-Key": base64.b64encode(bytes(16)).decode()}  # fmt: skip
    found = []
    for more in ({}, socket_too):
        line = http.client.HTTPConnection("127.0.0.1", port, timeout=GUARD_S)
        line.putrequest("GET", path, skip_host="Host" in headers)
        for name, value in (headers | more).items():
            line.putheader(name, value)
        line.endheaders()
        found.append(line.getresponse().status)
        line.close()
    return found


def test_strangers_get_nothing(served):
    with LiveView("<p>a view</p>") as view:
        for page, own in ((served, [200, 101]), (view, [200, 200])):
            port, path = page.port, page.url.removeprefix(f"http://127.0.0.1:{page.port}")
            listening = [
                connection.laddr.ip
                for connection in psutil.Process().net_connections("tcp")
                if connection.status == psutil.CONN_LISTEN and connection.laddr.port == port
            ]
            assert listening == ["127.0.0.1"]
            assert re.fullmatch(r"/[\w-]{20,}/", path)
            assert status(port, path) == own
            for wrong in ("/", "/index.html", f"/{'x' * 22}/", path[:-2] + "/"):
                assert status(port, wrong) == [404, 404], wrong
            for host in ("evil.example", f"evil.example:{port}", f"localhost:{port}"):
                assert status(port, path, Host=host) == [404, 404], host
            for origin in ("http://evil.example", "null", f"http://127.0.0.1:{port + 1}"):
                assert status(port, path, Origin=origin) == [404, 404], origin
            assert status(port, path, Origin=f"http://127.0.0.1:{port}") == own
            for file in ("../../etc/passwd", "%2e%2e/%2e%2e/etc/passwd", "no-such-file"):
                assert status(port, path + file)[0] == 404, file


def test_the_answer_is_that_of_check_in_its_words(window):
    page = window.page
    for values in (
        {},
        {(SURFACE, "x"): 700.0, (SURFACE, "z"): 300.0, (TASK, "cone"): 22.0},
        {(LIMITS, "elbow_joint"): (-30.0, 30.0)},
    ):
        page.press("reset")
        page.set(values)
        answer, changed = window.answered(), page.controls.changed(page.values)
        verdict = check(*changed.build())
        text = report.as_text(verdict, changed)
        assert (answer.kind, answer.head) == (verdict.answer, text.splitlines()[0])
        assert f"{verdict.n_covered} of 6 cells · evidence: {verdict.evidence}" in answer.state
        rows = dict(answer.rows)
        assert rows["found"] == verdict.message
        assert rows["collisions"] == "collisions are not checked"
        for line in answer.causes:
            assert line in text
        # The cells that are covered have one colour, each cause one of its own.
        counts = [int(re.search(r"\((\d+)", layer.entry.label)[1]) for layer in answer.paint]
        assert sum(counts) == 6
        assert (counts[0] if verdict.covered.any() else 0) == verdict.n_covered
        for cause in verdict.causes:
            assert any(cause.kind.replace("_", " ") in one.entry.label for one in answer.paint)
        drawn = [path for path in page.scene.nodes if path.startswith("/cells/")]
        assert sorted(drawn) == sorted(layer.entry.path for layer in answer.paint)
    assert not verdict.feasible  # the last one has something to say


def test_quick_looks_come_first_say_so_and_call_nothing_feasible(window, monkeypatch):
    shown, show = [], Page._show
    monkeypatch.setattr(Page, "_show", lambda *all: (shown.append(all[1]), show(*all)))
    page = window.page
    window.slide(page.sliders[SURFACE, "x"], 10.0)
    until(lambda: page.values[SURFACE, "x"] == 10.0)
    assert window.answered("feasible").state.startswith("certified")
    quick, full = shown
    assert (quick.kind, quick.head) == ("quick", "quick look: one motion reaches 6 of 6 cells")
    assert quick.parts == ()
    assert quick.motion is None
    at, clock = full.motion.at, page.time
    window.slide(page.playing, True)
    until(lambda: clock.value > 0.2 and np.allclose(page.arm.q, at([clock.value])))
    page.set({(SURFACE, "x"): 900.0, (SURFACE, "z"): 300.0})
    window.answered()
    assert shown[2].head.endswith("of 6 cells so far")


def test_a_quick_look_ends_after_its_steps_and_goes_by_the_method_of_the_case():
    for file, steps, reached in (("plate", 0, 0), ("plate", 1, 6), ("greedy", 60, 6)):
        setup = Case.from_toml(FILES[f"{file}.toml"]).build()
        look = quick_look(setup, Watch(lambda: True, str, steps=steps))
        assert f"one motion reaches {reached} of 6 cells" in look.head
        assert (look.q is not None) == (reached > 0)


def test_a_certificate_that_nobody_waits_for_is_given_up(window, monkeypatch):
    begun, given_up = [], []

    def slow(robot, cells, task, search, clock):
        begun.append(cells.surface.position[0])
        try:
            for k in itertools.count():
                clock.tick(k, None, "still looking")
        except BaseException as error:
            given_up.append(type(error).__name__)
            raise

    monkeypatch.setattr("feasibility.live.answers.check", slow)
    window.page.set({(SURFACE, "x"): 20.0})
    until(lambda: begun)
    monkeypatch.undo()
    window.page.set({(SURFACE, "x"): 30.0})
    window.answered("feasible")
    assert (begun, given_up) == ([0.02], ["Superseded"])


def test_faults_are_said_and_the_page_goes_on(window, monkeypatch):
    page = window.page
    page.set({(LIMITS, "elbow_joint"): (20.0, -20.0)})
    assert "the wrong way round" in window.answered("error").head
    monkeypatch.setattr("feasibility.live.answers.check", lambda *_, **__: 1 / 0)
    page.press("reset")
    until(lambda: "ZeroDivisionError" in page.answer.head)
    monkeypatch.undo()
    page.set({(TASK, "cone"): 31.0})
    window.answered("feasible")


def test_what_was_done_is_undone_step_by_step(window):
    page, x = window.page, (SURFACE, "x")
    for value in (10.0, 20.0, 30.0):  # one drag
        page.change({x: value})
    window.answered()
    page.change({x: 40.0})
    window.answered()
    seen = []
    for button in ("undo", "undo", "undo", "redo", "redo", "redo", "undo", "reset", "undo"):
        page.press(button)
        seen.append(page.values[x])
        assert page.sliders[x].value == page.values[x]
    assert seen == [30.0, 0.0, 0.0, 30.0, 40.0, 40.0, 30.0, 0.0, 30.0]


def test_the_saved_case_is_what_is_shown(window, monkeypatch):
    saved, page = [], window.page
    keep = lambda name, content, **_: saved.append((name, content.decode()))  # noqa: E731
    monkeypatch.setattr(page.client, "send_file_download", keep)
    values = {(SURFACE, "x"): 20.0, (SURFACE, "yaw"): 10.0, (TASK, "standoff"): 15.5,
              (LIMITS, "wrist_1_joint"): (-200.0, 100.0)}  # fmt: skip
    page.set(values)
    page.press("save as case")
    ((name, text),) = saved
    assert name == "plate-live.toml"
    case = Case.from_toml(text)
    assert case.surface.position[0] == 0.02
    assert case == page.controls.changed(page.values)
    page.set({(TASK, "standoff"): -1.0})
    window.answered("error")
    page.press("save as case")
    assert "task.standoff" in page.head.content
    assert len(saved) == 1


def place_of(page, path):
    """Where a node is: the places of all groups above it, one in the other."""
    place, names = pin.SE3.Identity(), path.strip("/").split("/")
    for k in range(len(names)):
        node = page.scene.nodes.get("/" + "/".join(names[: k + 1]))
        if node is not None:
            w, *xyz = node.wxyz
            place = place * pin.SE3(pin.Quaternion(w, *xyz), np.array(node.position))
    return place


def test_base_tool_and_scene_are_drawn_where_they_are_moved_and_joints_are_moved_by_hand():
    post = "task.footprint = 0.2\n[robot.base]\nposition = [0.1, 0, 0]\n[[collision.scene]]\n"
    post += 'name = "post"\nkind = "box"\nsize = [0.1, 0.1, 0.5]\nposition = [0, 0.5, 0]\n'
    with Live(Case.from_toml(FILES["plate.toml"] + post, name="plate")) as live:
        window = Window(live)
        page = window.page
        assert "treated once" in [part.entry.label for part in window.answered().parts]
        first = page.arm.setup.robot
        before = page.scene.nodes["/scene/0 post/body"].vertices.copy()
        page.set(
            {(BASE, "z"): 150.0, (BASE, "yaw"): 20.0, (TCP, "z"): 80.0, ("object post", "y"): 700.0}
        )
        window.answered()
        robot, kinematics = page.arm.setup.robot, Kinematics(page.arm.setup.robot)
        window.slide(page.arm.sliders[1], -70.0)
        until(lambda: page.arm.said() in page.arm.words.content)
        q = page.arm.q
        assert np.degrees(q[1]) == pytest.approx(-70.0)
        data = robot.model.createData()
        pin.framesForwardKinematics(robot.model, data, kinematics.configuration(q))
        drawn = {path.rpartition("/part")[0] for path in page.scene.nodes if "/part" in path}
        assert len(drawn) == 7
        for path in drawn:  # meshes are in the frame of their joint, where the link was at first
            link = path.rpartition("link ")[2]
            at = first.model.frames[first.model.getFrameId(link)].placement
            shown = place_of(page, path) * at
            number = robot.model.getFrameId(link, pin.FrameType.BODY)
            assert np.allclose(shown.homogeneous, data.oMf[number].homogeneous, atol=1e-9), link
        assert np.allclose(
            page.scene.nodes["/scene/0 post/body"].vertices - before, [0, 0.2, 0], atol=1e-4
        )
        point = 1e3 * kinematics.tools(q[None])[0][0]
        assert page.arm.said().startswith("tool at ({:.1f}, {:.1f}, {:.1f}) mm".format(*point))
        assert "nearest: " in page.arm.said()
        window.close()


def test_the_handle_moves_what_is_chosen(window):
    page = window.page
    assert page.arm.said().endswith(" deg from its normal")  # there are no bodies
    handle, turn = page.handle, (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))
    middle = np.array(handle.gizmo.position)
    window.drag(turn, middle + np.array([0.1, 0.0, 0.0]))
    until(lambda: page.values[SURFACE, "yaw"] == 45.0)
    case = page.controls.changed(page.values)
    assert np.allclose(
        case.build().cells.centres.mean(axis=0), middle + np.array([0.1, 0, 0]), atol=2e-4
    )
    assert [page.values[SURFACE, name] for name in ("z", "roll", "pitch")] == [
        page.controls.values[SURFACE, name] for name in ("z", "roll", "pitch")
    ]
    handle.choose(BASE)
    assert np.allclose(handle.gizmo.position, 0.0)
    window.drag((1.0, 0.0, 0.0, 0.0), np.array([0.0, 0.0, 0.2]))
    until(lambda: page.values[BASE, "z"] == 200.0)


def test_a_window_that_is_closed_frees_its_place_and_there_are_not_too_many(served, monkeypatch):
    monkeypatch.setattr(serving, "MOST_PAGES", 1)
    first = Window(served)
    told = list[str]()
    monkeypatch.setattr("viser.GuiApi.add_markdown", lambda gui, text: told.append(text))
    monkeypatch.setattr("live_windows.GUARD_S", 1.0)
    with pytest.raises(AssertionError):  # it gets no page
        Window(served)
    monkeypatch.undo()
    assert told == [serving.TOO_MANY]
    first.close()
    until(lambda: first.page.closed and not served.pages)


def test_cells_are_not_too_many_and_the_library_is_there(monkeypatch):
    monkeypatch.setattr(serving, "MOST_CELLS", 5)
    with pytest.raises(CoverableError, match="plate: has 6 cells; a live page takes at most 5"):
        Live(PLATE)
    monkeypatch.setitem(__import__("sys").modules, "viser", None)
    with pytest.raises(CoverableError, match=r"pip install 'coverable\[live\]'"):
        Live(PLATE)


def test_python_gets_the_page_of_a_name_and_a_notebook_a_frame_over_a_picture(monkeypatch, capsys):
    opened = []
    monkeypatch.setattr(Live, "open", lambda page: opened.append(page.url))
    monkeypatch.setattr(View, "png", lambda drawn: b"\x89PNG")
    page = live("paper/4a", block=False)
    try:
        assert opened == [page.url]
        bundle = page._repr_mimebundle_()
        assert bundle["text/plain"] == f"Live('paper/4a': {page.url})"
        assert base64.b64decode(bundle["image/png"]) == b"\x89PNG"
        assert f'data-url="{page.url}"' in bundle["text/html"]
        assert bundle["image/png"] in bundle["text/html"]
    finally:
        page.close()
        page.close()  # twice does no harm
    assert capsys.readouterr().out == "", "stdout is the program's"
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", page.port))
