"""The server of a live page: who is answered, with what, and that a saved case is what is shown."""

import base64
import http.client
import json
import re
import socket
import urllib.error
import urllib.request

import numpy as np
import psutil
import pytest
from command_table import FILES
from page_outline import unpacked

from coverable import Case, Live, View, check, live
from feasibility.live import showing
from feasibility.live.answers import Answers
from feasibility.live.controls import Controls
from feasibility.live.jobs import Job, Superseded
from feasibility.live.server import LARGEST_REQUEST
from feasibility.live.workbench import Workbench
from feasibility.reports import verdict as report

GUARD_S = 1800.0
PLATE = Case.from_toml(FILES["plate.toml"], name="plate")


class Client:
    def __init__(self, page):
        self.page, self.number = page, 0
        self.session = self.post("open")["session"]

    def post(self, name, **asked):
        request = urllib.request.Request(
            self.page.url + name,
            data=json.dumps(asked).encode(),
            headers={"Content-Type": "application/json"},
        )
        with urllib.request.urlopen(request, timeout=GUARD_S) as reply:
            return json.loads(reply.read())

    def ask(self, final, **values):
        self.number += 1
        asked = {"session": self.session, "number": self.number, "final": final}
        while True:
            reply = self.post("ask", **asked, values=values)
            if reply["status"] != "deciding":
                return reply["answer"]


@pytest.fixture(scope="module")
def page():
    with Live(PLATE) as served:
        yield served


@pytest.fixture
def client(page):
    one = Client(page)
    yield one
    one.post("close", session=one.session)


def refused(url, data=None, **headers):
    request = urllib.request.Request(url, data=data, headers=headers)
    with pytest.raises(urllib.error.HTTPError, match="404") as error:
        urllib.request.urlopen(request, timeout=GUARD_S)
    error.value.close()


def test_strangers_get_nothing(page, client):
    listening = [
        connection.laddr.ip
        for connection in psutil.Process().net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN and connection.laddr.port == page.port
    ]
    assert listening == ["127.0.0.1"]
    assert re.fullmatch(rf"http://127\.0\.0\.1:{page.port}/[\w-]{{20,}}/", page.url)
    json_type, here = {"Content-Type": "application/json"}, f"http://127.0.0.1:{page.port}/"
    foreign = [{"Host": host} for host in
               ("evil.example", f"evil.example:{page.port}", f"localhost:{page.port}")]  # fmt: skip
    foreign += [{"Origin": origin} for origin in
                ("http://evil.example", "null", f"http://127.0.0.1:{page.port + 1}")]  # fmt: skip
    for name, data in (("", None), ("case.json", None), ("open", b"{}"), ("save", b"{}")):
        kind = {} if data is None else json_type
        refused(here + name, data, **kind)
        refused(f"{here}{'x' * 22}/{name}", data, **kind)
        for headers in foreign:
            refused(page.url + name, data, **headers, **kind)
    refused(page.url + "../../etc/passwd")
    refused(page.url + "live.py")
    # What a form of a page elsewhere can send without asking first.
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        refused(page.url + "open", b"{}", **{"Content-Type": kind})
    for body in (b"", b"[]", b"{", b"\xff", b"[" * 50_000, b"x" * (LARGEST_REQUEST + 1)):
        refused(page.url + "ask", body, **json_type)
    refused(page.url + "nothing", b"{}", **json_type)
    assert client.post("beat", session=client.session) == {"status": "there"}
    assert client.post("beat", session="another") == {"status": "gone"}
    assert client.post("ask", session="another", number=1, values={}) == {"status": "gone"}


def test_odd_questions_are_refused_and_the_next_one_is_answered(client, monkeypatch):
    for number in (None, "1", 1.5, [1]):
        reply = client.post("ask", session=client.session, number=number, values={})
        assert reply == {"status": "superseded"}
    for values in ({"standoff": -3}, {"standoff": "far"}, {"robot": {"urdf": "x"}}):
        said = client.ask(True, **values)
        assert said["kind"] == "error"
        assert said["head"].startswith("plate: ")
    monkeypatch.setattr("feasibility.live.answers.check", lambda *_, **__: 1 / 0)
    assert "ZeroDivisionError" in client.ask(True)["head"]
    monkeypatch.undo()
    assert client.ask(True)["kind"] == "feasible"


def test_the_answer_is_that_of_check_in_its_words(client):
    case = PLATE
    for values in (
        {}, {"position": [700.0, 0.0, 300.0], "cone_deg": 22.0},
        {"limits": {"elbow_joint": [-30, 30]}},
    ):  # fmt: skip
        answer = client.ask(True, **values)
        changed = Case.from_toml(client.post("save", values=values)["toml"], name=case.name)
        verdict = check(*changed.build())
        text = report.as_text(verdict, changed)
        assert answer["head"] == text.splitlines()[0]
        assert answer["kind"] == verdict.answer
        assert (answer["evidence"], answer["covered"]) == (verdict.evidence, verdict.n_covered)
        assert dict(map(tuple, answer["rows"]))["found"] == verdict.message
        for line in answer["groups"]:
            assert line in text
        assert answer["note"] == "collisions are not checked"
        # Cells that are covered have the first colour, each cause one of its own.
        classes = np.array(answer["paint"]["classes"])
        assert np.array_equal(classes == 0, verdict.covered)
        labels = [entry["label"] for entry in answer["paint"]["entries"]]
        kinds = {cause.cell: cause.kind.replace("_", " ") for cause in verdict.causes}
        for cell, kind in kinds.items():
            assert kind in labels[classes[cell]]
    assert not verdict.feasible  # the last one has something to say


def test_a_quick_look_says_so_and_calls_nothing_feasible(client):
    quick, full = client.ask(False), client.ask(True)
    assert quick["kind"] == "quick"
    assert quick["head"] == "quick look: one motion reaches 6 of 6 cells"
    assert "evidence" not in quick
    assert quick["rows"] == []
    assert (full["kind"], full["covered"]) == ("feasible", 6)
    drawn = unpacked(base64.b64decode(full["commands"]))  # graph, motion and posture
    assert [one["type"] for one in drawn].count("set_animation") == 1
    paths = {one["path"] for one in drawn if one["type"] == "set_object"}
    assert all(any(path.startswith(part) for part in full["parts"]["paths"]) for path in paths)
    assert any(path.startswith("/graph/edges of G") for path in paths)
    far = client.ask(False, position=[900.0, 0.0, 300.0])
    assert far["head"].endswith("cells so far")
    assert 0 < far["paint"]["classes"].count(1) == 6 - far["covered"]


def test_what_is_saved_is_what_is_shown_and_nothing_is_written(client, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = {
        "position": [20.0, -15.0, 290.0], "rpy_deg": [0.0, 4.0, 10.0], "standoff": 15.5,
        "cone_deg": 22.0, "limits": {"wrist_1_joint": [-200.0, 100.0]},
    }  # fmt: skip
    text = client.post("save", values=values)["toml"]
    assert list(tmp_path.iterdir()) == []
    saved = Case.from_toml(text)
    again = Controls(saved, saved.robot.build()).values
    assert again == {**values, "limits": {**again["limits"], **values["limits"]}}
    assert client.post("save", values={"cone_deg": -1})["error"].startswith("plate: task.cone_deg")


def test_the_page_is_whole_and_fetches_nothing_from_elsewhere(page):
    paths = (*showing.FILES.iterdir(), *showing.SHARED)
    names = [path.name for path in paths if path.suffix != ".html"]
    texts = {}
    for name in ("", *names, "meshcat.js", "scene", "case.json"):
        with urllib.request.urlopen(page.url + name, timeout=GUARD_S) as reply:
            assert "default-src 'none'" in reply.headers["Content-Security-Policy"]
            assert reply.headers["Cache-Control"] == "no-store"
            texts[name] = reply.read()
    for name in ("", *names):
        assert not re.search(rb"https?://", texts[name]), name
    for wanted in re.findall(r'(?:src|href)="([^":]+)"', texts[""].decode()):
        assert wanted in texts
    told = json.loads(texts["case.json"])
    owners = np.frombuffer(base64.b64decode(told["cells"]["owners"]), "<u4")
    assert sorted(set(owners.tolist())) == list(range(6))
    corners = np.frombuffer(base64.b64decode(told["cells"]["corners"]), "<u4").reshape(-1, 3)
    assert (owners[corners] == owners[corners][:, :1]).all()  # a triangle is of one cell


def test_a_browser_that_keeps_its_connection_hears_that_all_is_over():
    kind, live = {"Content-Type": "application/json"}, Live(PLATE)
    host, _, path = live.url.removeprefix("http://").partition("/")
    connection = http.client.HTTPConnection(host, timeout=GUARD_S)
    connection.request("POST", f"/{path}open", b"{}", kind)
    assert json.loads(connection.getresponse().read())["session"]
    live.close()
    connection.request("POST", f"/{path}open", b"{}", kind)
    assert connection.getresponse().status == 404
    connection.close()


def test_a_search_ends_where_nobody_waits_for_it_any_more():
    case = PLATE
    bench = Workbench(case)
    answers = Answers(Controls(case, bench.setup.robot), bench)
    bodies = PLATE.with_overrides(["collision.surface=false", "surface.cells=[1, 1]"])
    clear = Answers(Controls(bodies, Workbench(bodies).setup.robot), Workbench(bodies))
    for final in (False, True):
        assert clear(Job("page", 1, final, {}))["note"] != "collisions are not checked"
        left = Job("page", 1, final, {})
        left.drop()
        with pytest.raises(Superseded):
            answers(left)


def test_python_gets_the_page_of_a_name_and_a_notebook_a_frame_over_a_picture(monkeypatch):
    monkeypatch.setattr(Live, "open", lambda page: opened.append(page.url))
    monkeypatch.setattr(View, "png", lambda drawn: b"\x89PNG")
    opened = []
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
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", page.port), timeout=GUARD_S)
