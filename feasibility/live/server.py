"""The web server of a live page: its files, and the answers to its questions.

Every question is a request of its own, and its answer the reply to it: nothing is pushed, so a slow
page cannot have a queue of old answers. Nothing is written.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from coverable.errors import CoverableError
from feasibility.live.controls import Controls
from feasibility.live.sessions import MOST, Gone, Sessions, TooManyPages
from feasibility.viewer.live_server import File, Handler, LocalServer

LONGEST_WAIT = 2.0  # [s] for an answer; then the page hears how far it is, and asks again
LARGEST_REQUEST = 64 * 1024  # bytes
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
TOO_MANY = f"{MOST} pages of this case are open already; close one of them, and load this one again"


class PageServer(LocalServer):
    """Serves the files of a page and answers its questions, until it is closed."""

    def __init__(self, files: Mapping[str, File], sessions: Sessions, controls: Controls) -> None:
        """Start serving.

        Args:
            files: by name; the page itself has the empty one.
            sessions: of the pages that are open.
            controls: make the case that is saved.

        Raises:
            OSError: the system gives no port.
        """
        self.sessions, self.controls = sessions, controls
        super().__init__(files, _Handler)

    def close(self) -> None:
        """Give up all questions, stop serving, and free the port."""
        self.closed = True
        self.sessions.close_all()
        super().close()

    def reply(self, name: str, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The reply to one question of a page.

        Args:
            name: what is wanted: `open`, `ask`, `beat`, `close` or `save`.
            asked: the rest.

        Raises:
            KeyError: there is nothing of that name.
        """
        replies = {
            "open": self._open,
            "ask": self._ask,
            "beat": self._beat,
            "close": self._close,
            "save": self._save,
        }
        return replies[name](asked)

    def _open(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """A page wants a session."""
        try:
            return {"session": self.sessions.open()}
        except TooManyPages:
            return {"refused": TOO_MANY}

    def _beat(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """A page is still there."""
        try:
            self.sessions.beat(str(asked.get("session")))
        except Gone:
            return {"status": "gone"}
        return {"status": "there"}

    def _close(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """A page is left."""
        self.sessions.close(str(asked.get("session")))
        return {"status": "closed"}

    def _ask(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """A page wants the answer for its values, or to hear how far it is."""
        number = asked.get("number")
        if not isinstance(number, int):
            return {"status": "superseded"}
        try:
            job = self.sessions.ask(
                str(asked.get("session")), number, asked.get("final") is True, asked.get("values")
            )
        except Gone:
            return {"status": "gone"}
        if not job.wait(LONGEST_WAIT):
            return {"status": "deciding", "said": job.said}
        if job.answer is None or job.dropped:
            return {"status": "superseded"}
        return {"status": "answered", "number": number, "answer": job.answer}

    def _save(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The case with the values of a page as text, for the browser to keep."""
        try:
            case = self.controls.changed(asked.get("values"))
            text, of = case.as_written(), f"# As `coverable live` showed {case.name}"
            if case.source is not None and not text.startswith(of):
                text = f"{of}; its paths are relative to the folder of that file.\n{text}"
            return {"toml": text}
        except CoverableError as error:
            return {"error": str(error)}


class _Handler(Handler):
    """One connection of a browser, which may ask questions too."""

    server: PageServer
    policy = POLICY

    def do_POST(self) -> None:
        """Answer a question."""
        name, length = self.requested(), self.headers.get("Content-Length", "")
        fits = length.isdecimal() and len(length) < 9 and int(length) <= LARGEST_REQUEST
        # A page elsewhere cannot send JSON without asking first, which is refused, too.
        is_json = self.headers.get("Content-Type", "").partition(";")[0] == "application/json"
        if name is None or not fits or not is_json:
            self.refuse()
            return
        try:
            asked = json.loads(self.rfile.read(int(length)))
            if not isinstance(asked, dict):
                raise TypeError
            answer = self.server.reply(name, asked)
        except (KeyError, TypeError, ValueError, RecursionError):
            self.refuse()
            return
        text = json.dumps(answer, allow_nan=False, separators=(",", ":"))
        self.send("application/json", text.encode())
