"""The live view: on the loopback address alone, and gone with its owner."""

import asyncio
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import psutil
import pytest
import umsgpack
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from feasibility.viewer import threejs
from feasibility.viewer.live_server import LiveView


def test_the_server_listens_on_the_loopback_address_alone():
    with LiveView(lambda path: f"page {path}") as live:
        listening = [
            connection.laddr
            for connection in psutil.Process().net_connections("tcp")
            if connection.status == psutil.CONN_LISTEN and connection.laddr.port == live.port
        ]
        assert [address.ip for address in listening] == ["127.0.0.1"]
        with urllib.request.urlopen(live.url) as answer:
            assert answer.read().decode().startswith("page /")
        for url, host in [
            (f"http://127.0.0.1:{live.port}/", "127.0.0.1"),
            (live.url + "../../etc/passwd", "127.0.0.1"),
            (live.url, "evil.example"),
        ]:
            request = urllib.request.Request(url, headers={"Host": host})
            with pytest.raises(urllib.error.HTTPError, match="404") as refused:
                urllib.request.urlopen(request)
            refused.value.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", live.port), timeout=5)
    live.close()


def test_the_server_dies_with_its_owner_even_when_that_is_killed():
    program = (
        "from feasibility.viewer.live_server import LiveView\n"
        "live = LiveView(lambda path: 'page')\n"
        "import sys; sys.stdout.write(f'{live.port}\\n'); sys.stdout.flush(); live.wait()\n"
    )
    root = Path(__file__).parents[3]
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, cwd=root, text=True
    ) as owner:
        port = int(owner.stdout.readline())
        assert psutil.Process(owner.pid).children(recursive=True) == []
        socket.create_connection(("127.0.0.1", port), timeout=5).close()
        owner.send_signal(signal.SIGKILL)
        owner.wait(timeout=10)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=5)


def test_windows_follow_what_is_sent_and_strangers_are_refused():
    live = LiveView(lambda path: f"page {path}")
    address = live.url.replace("http:", "ws:") + "socket"
    commands = [threejs.transform("/a", np.eye(4)), threejs.set_property("/a", "visible", False)]

    async def window():
        connection = await websocket_connect(address)
        live.send(commands)
        received = [umsgpack.unpackb(await connection.read_message()) for _ in commands]
        connection.close()
        stranger = HTTPRequest(address, headers={"Origin": "http://evil.example"})
        with pytest.raises(HTTPClientError, match="403"):
            await websocket_connect(stranger)
        return received

    with live:
        assert asyncio.run(window()) == commands
        with urllib.request.urlopen(live.url) as answer:
            assert answer.read().decode() == f"page {address.split(str(live.port))[1]}"
