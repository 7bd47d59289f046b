"""A window of a live page without a browser: it speaks with viser as viser's page does."""

import threading
import time

import msgspec
import viser
from websockets.sync.client import connect

GUARD_S = 1800.0


def until(met, what="it came to pass"):
    """Wait for something that happens in another thread."""
    end = time.monotonic() + GUARD_S
    while not met():
        assert time.monotonic() < end, f"never {what}"
        time.sleep(0.01)


CAMERA = {"wxyz": (1, 0, 0, 0), "position": (3, 0, 1), "fov": 1.0, "near": 0.1, "far": 100.0,
          "image_height": 600, "image_width": 800, "look_at": (0, 0, 0),
          "up_direction": (0, 0, 1)}  # fmt: skip


def window(url):
    """The socket of a new window."""
    address, version = url.rstrip("/").replace("http:", "ws:"), f"viser-v{viser.__version__}"
    socket = connect(address, subprotocols=[version], max_size=None)
    socket.send(msgspec.msgpack.encode({"type": "ViewerCameraMessage", **CAMERA}))
    return socket


class Window:
    """One window of a page; `page` is what the program knows of it."""

    def __init__(self, live):
        known, self.socket = set(live.pages), window(live.url)
        threading.Thread(target=self._hear, daemon=True).start()
        until(lambda: set(live.pages) - known)
        self.page = live.pages[(set(live.pages) - known).pop()]

    def _hear(self):
        for _ in self.socket:
            pass

    def send(self, kind, **values):
        self.socket.send(msgspec.msgpack.encode({"type": kind, **values}))

    def slide(self, slider, value):
        """Move a slider, as a hand does; returns when the program has heard it."""
        self.send("GuiUpdateMessage", uuid=slider._impl.uuid, updates={"value": value})
        until(lambda: slider.value == value)

    def drag(self, wxyz, position):
        """Move the handle."""
        self.send("TransformControlsUpdateMessage", name="/handle", wxyz=wxyz,
                  position=position.tolist(), owner=self.page.client.scene._owner_id)  # fmt: skip

    def answered(self, *kinds):
        """The certified answer to what the page says now."""
        page = self.page
        wanted = kinds or ("feasible", "infeasible", "undecided", "error")
        until(lambda: page.answered == page.number and page.answer.kind in wanted)
        with page.changed:  # until all of it is drawn
            return page.answer

    def close(self):
        self.socket.close()
