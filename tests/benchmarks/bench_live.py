"""What a live page gets: quick looks and certified answers over HTTP, without a browser."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from feasibility.cases import load_case
from feasibility.live import Live

CASES = (
    ("paper/4a", ()),
    ("paper/5c", ()),
    ("paper/4d", ()),
    ("paper/4f", ()),
    ("paper/4a", ("collision.clearance=0.005",)),
)
LOOKS = 40


class Page:
    """A page that moves the surface by a millimetre with each question."""

    def __init__(self, live: Live, z: float) -> None:
        """Open a session; the surface stands at a height of z mm."""
        self.host, _, path = live.url.removeprefix("http://").partition("/")
        self.path, self.z, self.number = f"/{path}", z, 0
        self.connection = http.client.HTTPConnection(self.host, timeout=600)
        self.session = self.post("open", {})["session"]

    def post(self, name: str, asked: dict[str, Any]) -> dict[str, Any]:
        """One question and its reply, on the connection that stays open."""
        kind = {"Content-Type": "application/json"}
        self.connection.request("POST", self.path + name, json.dumps(asked), kind)
        reply: dict[str, Any] = json.loads(self.connection.getresponse().read())
        return reply

    def ask(self, final: bool) -> dict[str, Any]:
        """The answer for the surface a little further along x."""
        self.number += 1
        values = {"position": [float(self.number), 0.0, self.z]}
        asked = {"session": self.session, "number": self.number, "final": final, "values": values}
        while (reply := self.post("ask", asked))["status"] == "deciding":
            pass
        answer: dict[str, Any] = reply["answer"]
        return answer


@contextmanager
def opened(name: str, settings: tuple[str, ...]) -> Iterator[Page]:
    """A page of a case that is centred on the world's z axis or near it."""
    case = load_case(name, settings)
    with Live(case) as live:
        yield Page(live, 1e3 * case.surface.position[2])


def row(name: str, settings: tuple[str, ...]) -> dict[str, object]:
    """One case."""
    with opened(name, settings) as page:
        page.ask(False)
        page.ask(True)  # what is compiled or loaded once is there
        wall, cpu = time.perf_counter(), time.process_time()
        looks = [page.ask(False) for _ in range(LOOKS)]
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        begun = time.perf_counter()
        answer = page.ask(True)
        certified = time.perf_counter() - begun
    return {
        "case": " ".join((name, *settings)),
        "quick look ms (goal 100)": 1e3 * wall / LOOKS,
        "quick look CPU ms": 1e3 * cpu / LOOKS,
        "reached": f"{looks[-1]['covered']} of {looks[-1]['cells']}",
        "certified ms": 1e3 * certified,
        "answer": answer["kind"],
        "covered": answer["covered"],
    }


def rows() -> tuple[str, list[dict[str, object]]]:
    """The table; 10 quick looks a second are wanted for 90 cells of a feasible case."""
    return "Live pages, over HTTP", [row(*case) for case in CASES]
