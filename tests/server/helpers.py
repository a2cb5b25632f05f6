"""A browser without a screen, and a session and a page that do as little as they can."""

from __future__ import annotations

import itertools
import json
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import Any, TypeVar

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from flexgui.core.errors import InputError
from flexgui.server.app import PageServer

PATIENCE = 5.0
"""s for something that takes milliseconds, on a busy machine."""
SILENCE = 0.3
"""s in which something that is not to happen would have happened."""

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [0.0, 0.0, 1.0],
    "fov": 1.0, "near": 0.1, "far": 100.0, "image_height": 600, "image_width": 800,
    "look_at": [0.0, 0.0, 0.0], "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip


class FakeClock:
    """Seconds that pass when told."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


class Thing:
    """A session: what its widgets were set to, and what was uploaded."""

    def __init__(self, key: str, folder: Path) -> None:
        self.key, self.folder = key, folder
        self.values: dict[str, Any] = {}
        self.uploads: list[bytes] = []
        self.playback = SimpleNamespace(cursor=SimpleNamespace(playing=False))
        self.study = SimpleNamespace(stop=lambda: None)
        self.run = self
        self.stops = 0
        self.closed = False

    def stop(self) -> None:
        self.stops += 1

    def close(self) -> None:
        self.closed = True


class SlowDisk:
    """Makes sessions, but none while it stands still or is full."""

    def __init__(self) -> None:
        self.full = False
        self.reached, self._moves = threading.Event(), threading.Event()
        self._moves.set()

    def __call__(self, key: str, folder: Path) -> Thing:
        self.reached.set()
        assert self._moves.wait(PATIENCE)
        if self.full:
            raise InputError("The disk is full.")
        return Thing(key, folder)

    @contextmanager
    def stopped(self) -> Iterator[None]:
        self.reached.clear()
        self._moves.clear()
        try:
            yield
        finally:
            self._moves.set()


@dataclass
class Shown:
    """A page: its widgets by name."""

    client: viser.ClientHandle
    session: Thing
    read_only: bool
    widgets: dict[str, Any]
    closed: bool = False

    def close(self) -> None:
        self.closed = True


class Pages:
    """All pages that a server built."""

    def __init__(self) -> None:
        self.all: list[Shown] = []

    def __call__(self, client: viser.ClientHandle, session: Thing, read_only: bool) -> Shown:
        gui = client.gui
        widgets: dict[str, Any] = {
            "slider": gui.add_slider("slider", 0.0, 3.0, 0.1, 1.0),
            "whole": gui.add_slider("whole", 0, 10, 1, 2),
            "number": gui.add_number("number", 1.5, min=0.0),
            "check": gui.add_checkbox("check", False),
            "choice": gui.add_dropdown("choice", ("a", "b")),
            "text": gui.add_text("text", "x"),
            "vector": gui.add_vector2("vector", (0.0, 0.0), min=(-1.0, -1.0), max=(1.0, 1.0)),
            "colour": gui.add_rgb("colour", (1, 2, 3)),
            "range": gui.add_multi_slider("range", 0.0, 1.0, 0.1, (0.2, 0.8)),
            "button": gui.add_button("button"),
            "group": gui.add_button_group("group", ("left", "right")),
            "off": gui.add_slider("off", 0.0, 3.0, 0.1, 1.0, disabled=True),
            "upload": gui.add_upload_button("upload"),
        }
        for name in set(widgets) - {"upload"}:
            self._listen(session, name, widgets[name])
        widgets["upload"].on_upload(lambda e: session.uploads.append(e.target.value.content))
        self.all.append(Shown(client, session, read_only, widgets))
        return self.all[-1]

    def _listen(self, session: Thing, name: str, widget: Any) -> None:
        listen = getattr(widget, "on_update", None) or widget.on_click
        listen(lambda event: self._heard(session, name, event.target.value))

    @staticmethod
    def _heard(session: Thing, name: str, value: Any) -> None:
        if value == "explode":
            raise ValueError("an unexpected error of a panel")
        session.values[name] = value


R = TypeVar("R")


def apart(call: Callable[..., R], *values: Any) -> R:
    """What a call gives in a thread of its own: a browser that a test before drove keeps an event
    loop running in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call, *values).result()


class LostError(AssertionError):
    """The server is gone, or it has ended the connection: what is waited for cannot come."""


NUMBERS = itertools.count(1)


def action(name: str, value: str = "") -> str:
    """What the page's own HTML writes into the field "Action" when it is pressed."""
    return json.dumps([next(NUMBERS), name, value])


@dataclass
class Browser:
    """Speaks viser's protocol; keeps what the server stored in its local storage."""

    server: PageServer
    origin: str | None = None
    """None: the right one."""
    storage: dict[str, str] = field(default_factory=dict)
    headers: dict[str, str] = field(default_factory=dict)
    path: str = "/"
    answers: bool = True
    """Whether it answers questions about its storage."""
    heard: list[dict[str, Any]] = field(default_factory=list)
    socket: ClientConnection | None = None

    def __enter__(self) -> Browser:
        origin = f"http://127.0.0.1:{self.server.port}" if self.origin is None else self.origin
        self.socket = connect(
            f"ws://127.0.0.1:{self.server.port}{self.path}",
            origin=origin or None,  # type: ignore[arg-type]
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            additional_headers=self.headers,
            max_size=None,
            compression=None,
            open_timeout=PATIENCE,
            ping_interval=None,  # a browser asks for no sign of life, it only answers
        )
        self.send(CAMERA)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self.socket is not None
        self.socket.close()

    def send(self, message: dict[str, Any]) -> None:
        self.send_raw(msgspec.msgpack.encode(message))

    def send_raw(self, data: bytes | str) -> None:
        assert self.socket is not None
        self.socket.send(data)

    def set(self, uuid: str, value: Any, **more: Any) -> None:
        updates = {"value": value, **more}
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates})

    def listen(self, seconds: float = 0.05) -> list[dict[str, Any]]:
        """Reads what comes within a time, and answers questions.

        LostError where the connection is lost, once what came before has been heard: whoever
        waits for more would wait in vain, and take it for something that is slow.
        """
        assert self.socket is not None
        end, heard = time.monotonic() + seconds, len(self.heard)
        try:
            while True:
                data = self.socket.recv(max(end - time.monotonic(), 0.001))
                for message in _messages(data):
                    self._take(message)
        except TimeoutError:
            pass
        except ConnectionClosed as closed:
            if len(self.heard) == heard:
                said = f"after {heard} messages: {closed}"
                raise LostError(f"the server ended the connection {said}") from closed
        return self.heard

    def await_message(self, kind: str, **fields: Any) -> dict[str, Any]:
        return self.until(
            lambda: next(
                (
                    m
                    for m in self.heard
                    if m["type"] == kind and all(m[k] == v for k, v in fields.items())
                ),
                None,
            ),
            kind,
        )

    def until(self, found: Callable[[], Any], what: str = "it") -> Any:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.listen()
            if value := found():
                return value
        raise AssertionError(f"{what} did not come")

    @property
    def notes(self) -> list[str]:
        return [
            m["props"]["body"]
            for m in self.heard
            if m["type"] in ("NotificationShowMessage", "NotificationUpdateMessage")
        ]

    def _take(self, message: dict[str, Any]) -> None:
        self.heard.append(message)
        if message["type"] == "LocalStorageSetItemMessage":
            self.storage[message["key"]] = message["value"]
        if message["type"] == "LocalStorageGetItemRequestMessage" and self.answers:
            self.send(
                {
                    "type": "LocalStorageGetItemResponseMessage",
                    "value": self.storage.get(message["key"]),
                    "error": None,
                    "request_uuid": message["request_uuid"],
                }
            )


def _messages(data: str | bytes) -> list[dict[str, Any]]:
    assert isinstance(data, bytes)
    size, packed = (int.from_bytes(data[k : k + 8], "little") for k in (0, 8))
    inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], max_output_size=size)
    found: list[dict[str, Any]] = msgspec.msgpack.decode(inner)["messages"]
    return found


def get(server: PageServer, path: str, **headers: str) -> HTTPResponse:
    """A page over plain HTTP."""
    connection = HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request("GET", path, headers=names)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def wait_for(found: Callable[[], Any]) -> Any:
    """The first true answer."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if value := found():
            return value
        time.sleep(0.01)
    raise AssertionError("it did not happen")


_number = itertools.count()


def announcement(uuid: str, size: int, parts: int, name: str = "th1.csv") -> dict[str, Any]:
    """The start of an upload."""
    return {
        "type": "FileTransferStartUpload", "source_component_uuid": uuid,
        "transfer_uuid": f"transfer{next(_number)}", "filename": name, "mime_type": "text/csv",
        "part_count": parts, "size_bytes": size,
    }  # fmt: skip


def part(start: dict[str, Any], index: int, content: bytes) -> dict[str, Any]:
    """One piece of it."""
    return {
        "type": "FileTransferPart", "source_component_uuid": start["source_component_uuid"],
        "transfer_uuid": start["transfer_uuid"], "part_index": index, "content": content,
    }  # fmt: skip
