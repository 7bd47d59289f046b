"""A page in a browser window, served on the loopback address by a thread that ends with us.

meshcat's own server listens on every interface and lives in a process of its own, which survives
its owner. This one listens on 127.0.0.1 alone, answers only under an address that holds a random
token, and is gone when the program is, however that ends.
"""

from __future__ import annotations

import secrets
import sys
import threading
from http.server import BaseHTTPRequestHandler
from socketserver import ThreadingTCPServer
from typing import Any

ADDRESS = "127.0.0.1"
PATIENCE = 10.0  # [s] for a browser to send its request


class LiveView:
    """One page served to browsers on this machine.

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
        path = f"/{secrets.token_urlsafe(16)}/"
        try:
            self._server = _Server((ADDRESS, 0), _handler(path, page.encode()))
        except OSError as error:
            raise OSError(f"the view cannot be served on {ADDRESS}: {error}") from error
        self.port: int = self._server.server_address[1]
        self.url = f"http://{ADDRESS}:{self.port}{path}"
        """The address to open in a browser on this machine."""
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.1,), name="coverable-view", daemon=True
        )
        self._thread.start()

    def open(self) -> bool:
        """Open the page in the default browser; False where there is none."""
        import webbrowser

        return webbrowser.open(self.url)

    def wait(self) -> None:
        """Serve until `close` is called from elsewhere or the user interrupts."""
        while self._thread.is_alive():
            self._thread.join(0.2)

    def close(self) -> None:
        """Stop serving and free the port."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> LiveView:
        """Serve inside a `with` block."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop serving."""
        self.close()


class _Server(ThreadingTCPServer):  # not HTTPServer, which looks up this machine's name
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report faults of ours, not a browser that has gone away."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


def _handler(path: str, page: bytes) -> type[BaseHTTPRequestHandler]:
    """What answers requests: the page at `path`, and nothing else."""

    class Handler(BaseHTTPRequestHandler):
        timeout = PATIENCE
        server_version, sys_version = "coverable", ""

        def do_GET(self) -> None:
            host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
            # Other host names get nothing: a page elsewhere cannot reach in by rebinding its name.
            stranger = host.partition(":")[0] != ADDRESS or origin not in (None, f"http://{host}")
            if stranger or self.path != path:
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(page)))
            self.send_header("Cache-Control", "no-store")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, format: str, *args: object) -> None:
            """Requests are not logged: the console belongs to the program that shows the page."""

    return Handler
