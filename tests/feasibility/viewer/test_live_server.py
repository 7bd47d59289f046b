"""The live view: on the loopback address alone, and gone with its owner."""

import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import psutil
import pytest
from guards import GUARD_S

from feasibility.viewer.live_server import LiveView


def test_the_server_listens_on_the_loopback_address_alone():
    with LiveView("<p>caf\u00e9</p>") as live:
        listening = [
            connection.laddr
            for connection in psutil.Process().net_connections("tcp")
            if connection.status == psutil.CONN_LISTEN and connection.laddr.port == live.port
        ]
        assert [address.ip for address in listening] == ["127.0.0.1"]
        with urllib.request.urlopen(live.url) as answer:
            assert answer.read().decode() == "<p>caf\u00e9</p>"
            assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
        for url, headers in [
            (f"http://127.0.0.1:{live.port}/", {}),
            (live.url + "../../etc/passwd", {}),
            (live.url, {"Host": "evil.example"}),
            (live.url, {"Host": "127.0.0.1.evil.example:80"}),
            (live.url, {"Origin": "http://evil.example"}),
        ]:
            request = urllib.request.Request(url, headers=headers)
            with pytest.raises(urllib.error.HTTPError, match="404") as refused:
                urllib.request.urlopen(request)
            refused.value.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S)
    live.close()


def test_the_server_dies_with_its_owner_even_when_that_is_killed():
    program = (
        "from feasibility.viewer.live_server import LiveView\n"
        "live = LiveView('page')\n"
        "import sys; sys.stdout.write(f'{live.port}\\n'); sys.stdout.flush(); live.wait()\n"
    )
    root = Path(__file__).parents[3]
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, cwd=root, text=True
    ) as owner:
        port = int(owner.stdout.readline())
        assert psutil.Process(owner.pid).children(recursive=True) == []
        socket.create_connection(("127.0.0.1", port), timeout=GUARD_S).close()
        owner.send_signal(signal.SIGKILL)
        owner.wait(timeout=GUARD_S)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=GUARD_S)


def test_a_browser_that_goes_away_is_no_fault(capfd):
    with LiveView("page" * 10_000_000) as live:
        with socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S) as browser:
            browser.sendall(f"GET {live.url} HTTP/1.1\r\n".encode())
        with socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S) as browser:
            path = live.url.split(str(live.port))[1]
            host = f"127.0.0.1:{live.port}"
            browser.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            assert browser.recv(15) == b"HTTP/1.1 200 OK"
        with urllib.request.urlopen(live.url) as answer:
            assert len(answer.read()) == 40_000_000
    assert capfd.readouterr().err == ""
