"""A client of viser's protocol, which takes what a browser would and moves what one could."""

import re
import time

import msgspec
import viser
import zstandard
from websockets.sync.client import connect

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 300,
    "image_width": 300,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class Client:
    """A browser's part of viser's protocol, for an explorer or its address."""

    def __init__(self, explorer, **options):
        url = getattr(explorer, "url", explorer).replace("http", "ws")
        options = {"max_size": None, **options}
        self.line = connect(url, subprotocols=[f"viser-v{viser.__version__}"], **options)
        self.gui = {}
        self.bytes = 0
        self.send(CAMERA)

    def send(self, message):
        self.line.send(msgspec.msgpack.encode(message))

    def slide(self, label, value):
        uuid = next(u for u, m in self.gui.items() if m["props"].get("label") == label)
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def until(self, what, seconds=20.0):
        """Take messages until the panel's words fit a pattern; the match."""
        end = time.monotonic() + seconds
        while True:
            found = re.search(what, self.words, re.DOTALL)
            if found:
                return found
            raw = self.line.recv(timeout=max(end - time.monotonic(), 0.01))
            self.bytes += len(raw)
            size = int.from_bytes(raw[8:16], "little")
            inner = zstandard.ZstdDecompressor().decompress(
                raw[16 : 16 + size], max_output_size=int.from_bytes(raw[:8], "little")
            )
            for message in msgspec.msgpack.decode(inner)["messages"]:
                if message["type"].startswith("Gui") and "props" in message:
                    self.gui[message["uuid"]] = message
                elif message["type"] == "GuiUpdateMessage" and message["uuid"] in self.gui:
                    known = self.gui[message["uuid"]]
                    known["props"].update(message["updates"])

    @property
    def words(self):
        return " ".join(str(m["props"].get("content", "")) for m in self.gui.values())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()
