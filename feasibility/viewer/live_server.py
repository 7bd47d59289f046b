"""Pages in a browser window, served on the loopback address by a thread that ends with us.

meshcat's own server listens on every interface and lives in a process of its own, which survives
its owner. This one listens on 127.0.0.1 alone and is gone when the program is, however that ends.
It answers only under an address that holds a random token, and no other host names and origins: a
page elsewhere cannot reach in by rebinding its name.
"""

from __future__ import annotations

import secrets
import sys
import threading
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler
from socketserver import ThreadingTCPServer
from typing import Any, NamedTuple, Self

ADDRESS = "127.0.0.1"
PATIENCE = 30.0  # [s] for a browser to send its next request
HTML = "text/html; charset=utf-8"


class File(NamedTuple):
    """What is sent as it is."""

    kind: str
    """Its media type."""
    content: bytes


class Handler(BaseHTTPRequestHandler):
    """One connection of a browser, which gets the files of its server and nothing else."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    server_version, sys_version = "coverable", ""
    disable_nagle_algorithm = True
    server: LocalServer
    policy = ""
    """The Content-Security-Policy of all that is sent, if any."""

    def do_GET(self) -> None:
        """Send a file."""
        name = self.requested()
        if name is None or name not in self.server.files:
            self.refuse()
        else:
            self.send(*self.server.files[name])

    def requested(self) -> str | None:
        """The name behind the token; None for strangers, a wrong token, or a closed server."""
        host, origin = self.headers.get("Host"), self.headers.get("Origin")
        stranger = host != self.server.host or origin not in (None, f"http://{host}")
        given, _, name = self.path.rpartition("/")
        known = secrets.compare_digest(f"{given}/".encode(), self.server.path.encode())
        return None if stranger or not known or self.server.closed else name

    def refuse(self) -> None:
        """Nothing is here."""
        self.close_connection = True
        self.send_error(404)

    def send(self, kind: str, content: bytes) -> None:
        """Send bytes, which nobody is to keep or to embed a guess about."""
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        if self.policy:
            self.send_header("Content-Security-Policy", self.policy)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:
        """Requests are not logged: the console belongs to the program that shows the page."""


class LocalServer(ThreadingTCPServer):  # not HTTPServer, which looks up this machine's name
    """Serves the files of a page until it is closed."""

    daemon_threads = True

    def __init__(self, files: Mapping[str, File], handler: type[Handler] = Handler) -> None:
        """Start serving.

        Args:
            files: by name; the page itself has the empty one.
            handler: answers the requests of one connection.

        Raises:
            OSError: the system gives no port.
        """
        self.files = files
        self.path = f"/{secrets.token_urlsafe(16)}/"
        self.closed = False
        try:
            super().__init__((ADDRESS, 0), handler)
        except OSError as error:
            raise OSError(f"the page cannot be served on {ADDRESS}: {error}") from error
        self.port: int = self.server_address[1]
        self.host = f"{ADDRESS}:{self.port}"
        self.url = f"http://{self.host}{self.path}"
        self.thread = threading.Thread(
            target=self.serve_forever, args=(0.1,), name="coverable-page", daemon=True
        )
        self.thread.start()

    def close(self) -> None:
        """Stop serving and free the port.

        Connections that browsers keep open end with their next request.
        """
        self.closed = True
        self.shutdown()
        self.server_close()
        self.thread.join()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report faults of ours, not a browser that has gone away."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class Served:
    """A page that is served to browsers on this machine, until it is closed."""

    def __init__(self, server: LocalServer) -> None:
        """Hold on to the server of the page."""
        self._server = server
        self.port = server.port
        self.url = server.url
        """The address to open in a browser on this machine."""

    def open(self) -> bool:
        """Open the page in the default browser; False where there is none."""
        import webbrowser

        return webbrowser.open(self.url)

    def wait(self) -> None:
        """Serve until `close` is called from elsewhere or the user interrupts."""
        while self._server.thread.is_alive():
            self._server.thread.join(0.2)

    def wait_in_script(self, block: bool | None) -> None:
        """Serve until interrupted, and close; by default (None) only in a script."""
        if block or (block is None and not hasattr(sys, "ps1")):
            try:
                self.wait()
            except KeyboardInterrupt:
                self.close()

    def close(self) -> None:
        """Stop serving and free the port."""
        self._server.close()

    def __enter__(self) -> Self:
        """Serve inside a `with` block."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop serving."""
        self.close()


class LiveView(Served):
    """The page of a view.

    Example:
        >>> with LiveView("<p>scene</p>") as live:
        ...     live.url.startswith("http://127.0.0.1:")
        True
    """

    def __init__(self, page: str) -> None:
        """Start serving the HTML text `page`.

        Raises:
            OSError: the system gives no port.
        """
        super().__init__(LocalServer({"": File(HTML, page.encode())}))
