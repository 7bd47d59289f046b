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
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler
from socketserver import ThreadingTCPServer
from typing import Any, Self
from urllib.parse import urlsplit

ADDRESS = "127.0.0.1"
PATIENCE = 30.0  # [s] for a browser to send its next request


class Handler(BaseHTTPRequestHandler):
    """One connection of a browser, which gets the page and nothing else."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    server_version, sys_version = "coverable", ""
    disable_nagle_algorithm = True
    server: LocalServer  # pyrefly: ignore[bad-override-mutable-attribute]

    def do_GET(self) -> None:
        """Send the page; nothing to strangers, nor behind a wrong token."""
        host, origin = self.headers.get("Host"), self.headers.get("Origin")
        stranger = host != self.server.host or origin not in (None, f"http://{host}")
        known = secrets.compare_digest(self.path.encode(), self.server.path.encode())
        if stranger or not known or self.server.closed:
            self.close_connection = True
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.server.page)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(self.server.page)

    def log_message(self, format: str, *args: object) -> None:
        """Requests are not logged: the console belongs to the program that shows the page."""


class LocalServer(ThreadingTCPServer):  # not HTTPServer, which looks up this machine's name
    """Serves one page until it is closed."""

    daemon_threads = True

    def __init__(self, page: bytes) -> None:
        """Start serving.

        Raises:
            OSError: the system gives no port.
        """
        self.page, self.closed = page, False
        self.path = f"/{secrets.token_urlsafe(16)}/"
        try:
            super().__init__((ADDRESS, 0), Handler)
        except OSError as error:
            raise OSError(f"the page cannot be served on {ADDRESS}: {error}") from error
        self.host = f"{ADDRESS}:{self.server_address[1]}"
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

    def __init__(self, url: str, stop: Callable[[], None]) -> None:
        """A page that is served by now.

        Args:
            url: the address to open in a browser on this machine.
            stop: ends that.
        """
        self.url, self._stop = url, stop
        self.port = urlsplit(url).port
        self._closed = threading.Event()

    def open(self) -> bool:
        """Open the page in the default browser; False where there is none."""
        import webbrowser

        return webbrowser.open(self.url)

    def wait(self) -> None:
        """Serve until `close` is called from elsewhere or the user interrupts."""
        while not self._closed.wait(0.2):
            pass

    def wait_in_script(self, block: bool | None) -> None:
        """Serve until interrupted, and close; by default (None) only in a script."""
        if block or (block is None and not hasattr(sys, "ps1")):
            try:
                self.wait()
            except KeyboardInterrupt:
                self.close()

    def close(self) -> None:
        """Stop serving and free the port; twice does no harm."""
        if not self._closed.is_set():
            self._closed.set()
            self._stop()

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
        server = LocalServer(page.encode())
        super().__init__(f"http://{server.host}{server.path}", server.close)
