"""The web server of a live page: on the loopback address alone, under an address with a secret.

Every question is a request of its own, and its answer the reply to it: nothing is pushed, so a slow
page cannot have a queue of old answers. Other host names and origins get nothing: a page elsewhere
can neither reach in by rebinding its name nor send questions. Nothing is written.
"""

from __future__ import annotations

import json
import secrets
import sys
import threading
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler
from socketserver import ThreadingTCPServer
from typing import Any, NamedTuple

from coverable_errors import CoverableError
from feasibility.live.controls import Controls
from feasibility.live.sessions import MOST, Gone, Sessions, TooManyPages

ADDRESS = "127.0.0.1"
PATIENCE = 30.0  # [s] for a browser to send its next request
LONGEST_WAIT = 2.0  # [s] for an answer; then the page hears how far it is, and asks again
LARGEST_REQUEST = 64 * 1024  # bytes
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
TOO_MANY = f"{MOST} pages of this case are open already; close one of them, and load this one again"


class File(NamedTuple):
    """What is sent as it is."""

    kind: str
    """Its media type."""
    content: bytes


class PageServer(ThreadingTCPServer):  # not HTTPServer, which looks up this machine's name
    """Serves the files of a page and answers its questions, until it is closed."""

    daemon_threads = True

    def __init__(self, files: Mapping[str, File], sessions: Sessions, controls: Controls) -> None:
        """Begin to serve.

        Args:
            files: by name; the page itself has the empty one.
            sessions: of the pages that are open.
            controls: make the case that is saved.

        Raises:
            OSError: the system gives no port.
        """
        self.files, self.sessions, self.controls = files, sessions, controls
        self.path = f"/{secrets.token_urlsafe(16)}/"
        self.closed = False
        try:
            super().__init__((ADDRESS, 0), _Handler)
        except OSError as error:
            raise OSError(f"the page cannot be served on {ADDRESS}: {error}") from error
        self.port: int = self.server_address[1]
        self.host = f"{ADDRESS}:{self.port}"
        self.url = f"http://{self.host}{self.path}"
        self.thread = threading.Thread(
            target=self.serve_forever, args=(0.1,), name="coverable-live", daemon=True
        )
        self.thread.start()

    def close(self) -> None:
        """Stop serving, give up all questions, and free the port.

        Connections that browsers keep open end with their next request.
        """
        self.closed = True
        self.sessions.close_all()
        self.shutdown()
        self.server_close()
        self.thread.join()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report faults of ours, not a browser that has gone away."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

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
            return {"toml": self.controls.changed(asked.get("values")).to_toml()}
        except CoverableError as error:
            return {"error": str(error)}


class _Handler(BaseHTTPRequestHandler):
    """One connection of a browser."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    server_version, sys_version = "coverable", ""
    disable_nagle_algorithm = True
    server: PageServer

    def do_GET(self) -> None:
        """Send a file."""
        name = self._name()
        if name is None or name not in self.server.files:
            self._refuse()
            return
        self._send(*self.server.files[name])

    def do_POST(self) -> None:
        """Answer a question."""
        name, length = self._name(), self.headers.get("Content-Length", "")
        fits = length.isdecimal() and len(length) < 9 and int(length) <= LARGEST_REQUEST
        # A page elsewhere cannot send JSON without asking first, which is refused, too.
        is_json = self.headers.get("Content-Type", "").partition(";")[0] == "application/json"
        if name is None or not fits or not is_json:
            self._refuse()
            return
        try:
            asked = json.loads(self.rfile.read(int(length)))
            if not isinstance(asked, dict):
                raise TypeError
            answer = self.server.reply(name, asked)
        except (KeyError, TypeError, ValueError, RecursionError):
            self._refuse()
            return
        text = json.dumps(answer, allow_nan=False, separators=(",", ":"))
        self._send("application/json", text.encode())

    def _name(self) -> str | None:
        """What is asked for; None where a stranger asks, the secret is another, or all is over."""
        host, origin = self.headers.get("Host"), self.headers.get("Origin")
        stranger = host != self.server.host or origin not in (None, f"http://{host}")
        given, _, name = self.path.rpartition("/")
        known = secrets.compare_digest(f"{given}/".encode(), self.server.path.encode())
        return None if stranger or not known or self.server.closed else name

    def _refuse(self) -> None:
        """Nothing is here."""
        self.close_connection = True
        self.send_error(404)

    def _send(self, kind: str, content: bytes) -> None:
        """Send bytes, which nobody is to keep or to embed a guess about."""
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:
        """Requests are not logged: the console belongs to the program that shows the page."""
