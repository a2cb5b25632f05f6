"""One of many browsers without a screen, light enough that thirty fit beside their server."""

from __future__ import annotations

import asyncio
import contextlib
import re
import time
from collections import deque
from typing import Any

import msgspec
import viser
from websockets.asyncio.client import ClientConnection, connect

from tests.server.helpers import CAMERA, _messages, action

THETA2, EPSILON = "θ2 [deg]", "ε [GPa]"
ANGLE = re.compile(r"θ₂ = ([\d.]+)°")
GRID = 0.1
"""deg: as fine as the label beside the joint tells."""
LOWEST, HIGHEST = 10.0, 170.0
EVERY = 5
"""Each fifth move is one of ε, the others of θ2."""
POPULATION, GENERATIONS = 300, 10_000
"""The longest search that the page offers. It ends by itself once all members of the population
cost the same, to the last digit: on a quiet core after a minute."""
AWAY = 1.0
"""s until the page has drawn another stage, and until it stands again."""
START = "Start identification"
RUNS, RESTS = "Identifying ", "recordings to fit; parameters:"
"""Words of the page while a search runs, and while it would begin one."""


class LateError(Exception):
    """A wait has run out; its words say which."""


class Member:
    """Moves to values that no other one moves to, and notes when it sees which."""

    def __init__(self, number: int, of: int, port: int) -> None:
        self.number, self._of, self._port = number, of, port
        self.answers: dict[str, list[float]] = {THETA2: [], EPSILON: []}
        """s from each move to the arm and the plots that show it."""
        self.foreign: list[float] = []
        """Angles that it never asked for."""
        self.superseded = 0
        self.last_moved = self.last_shown = 0.0
        self._search = ""
        """Which of these words the page said last, since the last press."""
        self._widgets: dict[str, str] = {}
        self._plots: set[str] = set()
        self._waiting: deque[tuple[str, float, float]] = deque()
        self._mine: set[float] = set()
        self._start = 0.0
        self.searches = 0
        """That it has started."""
        self._watches = True
        """Another stage than the first draws a recording's angles, which nobody asked for."""
        self._socket: ClientConnection | None = None
        self._reader: asyncio.Task[None] | None = None
        self._moves = 0

    async def arrive(self, patience: float) -> None:
        """Until the page stands; LateError after `patience` s."""
        self._socket = await connect(
            f"ws://127.0.0.1:{self._port}/",
            origin=f"http://127.0.0.1:{self._port}",  # type: ignore[arg-type]
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            max_size=None,
            compression=None,
            open_timeout=patience,
        )
        await self._send(CAMERA)
        self._reader = asyncio.create_task(self._read())
        try:
            async with asyncio.timeout(patience):
                while self.last_shown == 0.0:
                    await asyncio.sleep(0.05)
        except TimeoutError:
            raise LateError(f"browser {self.number} saw no page in {patience:g} s") from None
        self._start = self.last_shown

    async def identify(self) -> None:
        """Starts a long search."""
        await self.set("Population", POPULATION)
        await self.set("Generations", GENERATIONS)
        await asyncio.sleep(0.3)
        await self._press()

    async def working(self, patience: float) -> bool:
        """Whether the page says within `patience` s that its search runs."""
        self._search, self._watches = "", False
        await self.set("Action", action("stage", "Identify"))
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(patience):
                while self._search != RUNS:
                    await asyncio.sleep(0.05)
        await self._back()
        return self._search == RUNS

    async def identify_again(self) -> None:
        """Another search, where the page says that none runs."""
        self._watches = False
        await self.set("Action", action("stage", "Identify"))
        await asyncio.sleep(AWAY)
        if self._search == RESTS:
            await self._press()
        await self._back()

    async def stop(self, patience: float) -> None:
        """Ends its search, which the next one would wait for; it is not waited for any longer."""
        self._watches = False
        await self.set("Action", action("stage", "Identify"))
        await self.set("Stop", True)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(patience):
                while self._search != RESTS:
                    await asyncio.sleep(0.05)

    async def _press(self) -> None:
        self._search = ""
        await self.set(START, True)
        self.searches += 1

    async def _back(self) -> None:
        await self.set("Action", action("stage", "Arm"))
        await asyncio.sleep(AWAY)
        self._watches = True

    async def set(self, label: str, value: Any) -> None:
        update = {"uuid": self._widgets[label], "updates": {"value": value}}
        await self._send({"type": "GuiUpdateMessage", **update})

    async def move(self, seconds: float, every: float, delay: float) -> None:
        """Sliders, at a steady pace whatever the answers do; none while it is at another stage."""
        await asyncio.sleep(delay)
        begin = time.monotonic()
        for k in range(1, int(seconds / every) + 1):
            if self._watches:
                await self._next_move()
            await asyncio.sleep(max(begin + k * every - time.monotonic(), 0.0))

    async def leave(self) -> None:
        assert self._socket is not None and self._reader is not None
        await self._socket.close()
        self._reader.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._reader

    async def _next_move(self) -> None:
        self._moves += 1
        if self._moves % EVERY == 0:
            value = round(0.9 + 0.01 * (self._moves // EVERY % 20), 2)
            self._waiting.append((EPSILON, value, time.monotonic()))
            await self.set(EPSILON, value)
            return
        own = int((HIGHEST - LOWEST) / GRID / self._of)
        value = round(LOWEST + GRID * (self.number + self._of * (self._moves * 7 % own)), 1)
        if value == self._start:
            return
        self._mine.add(value)
        self.last_moved = value
        self._waiting.append((THETA2, value, time.monotonic()))
        await self.set(THETA2, value)

    async def _send(self, message: dict[str, Any]) -> None:
        assert self._socket is not None
        await self._socket.send(msgspec.msgpack.encode(message))

    async def _read(self) -> None:
        assert self._socket is not None
        async for data in self._socket:
            await self._take(_messages(data), time.monotonic())

    async def _take(self, messages: list[dict[str, Any]], now: float) -> None:
        angle, plotted = None, False
        for message in messages:
            label = message.get("props", {}).get("label")
            if label is not None and "uuid" in message:
                self._widgets.setdefault(label, message["uuid"])
            if message["type"] == "LocalStorageGetItemRequestMessage":
                await self._send(no_key(message))
            updates = message.get("updates", {})
            plotted = plotted or "_plotly_json_str" in updates
            said = str(updates.get("content"))
            self._search = next((words for words in (RUNS, RESTS) if words in said), self._search)
            text = updates.get("text") or message.get("props", {}).get("text") or ""
            if found := ANGLE.fullmatch(text):
                angle = float(found[1])
        if angle is not None and self._watches:
            self._shown(angle, now)
        elif plotted and self._watches:
            self._answered(EPSILON, now)

    def _shown(self, angle: float, now: float) -> None:
        """The newest move to this angle is answered; earlier ones never will be."""
        self.last_shown = angle
        if angle not in self._mine and angle != self._start and self._start:
            self.foreign.append(angle)
        if not any(kind == THETA2 and value == angle for kind, value, _ in self._waiting):
            return
        while True:
            kind, value, at = self._waiting.popleft()
            done = kind == THETA2 and value == angle
            if done or kind == EPSILON:
                self.answers[kind].append(now - at)
            else:
                self.superseded += 1
            if done:
                return

    def _answered(self, kind: str, now: float) -> None:
        """Arm and plots without a new angle: the move of ε that waits at the front."""
        if self._waiting and self._waiting[0][0] == kind:
            self.answers[kind].append(now - self._waiting.popleft()[2])


def no_key(request: dict[str, Any]) -> dict[str, Any]:
    """The answer of a browser that was never here."""
    answer = {"request_uuid": request["request_uuid"], "value": None, "error": None}
    return {"type": "LocalStorageGetItemResponseMessage", **answer}
