"""The websocket of one browser, which passes only admitted messages to viser."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from typing import Any, NamedTuple

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

from flexgui.server.guard import Guard
from flexgui.server.messages import Message, Passive, decoded
from flexgui.server.services import Limits

log = logging.getLogger(__name__)

AHEAD = 64
"""Messages that are read ahead: a dragged slider sends 20 a second, so 3 s of a blocked server."""


class Frame(NamedTuple):
    """The bytes of a message, and the message."""

    raw: bytes
    message: Message


class RateLimit:
    """A leaky bucket: delays messages that come too fast, and drops none."""

    def __init__(self, limits: Limits) -> None:
        self._rate, self._burst = limits.messages_per_second, limits.burst
        self._level, self._seen = 0.0, time.monotonic()

    def delay(self) -> float:
        """s to wait before the newest message is handled."""
        now = time.monotonic()
        self._level = max(self._level - (now - self._seen) * self._rate, 0.0) + 1.0
        self._seen = now
        return max(self._level - self._burst, 0.0) / self._rate


class GuardedConnection(ServerConnection):
    """Checks messages in `recv`, the only place where viser reads them."""

    guard: Guard
    """Set when viser announces the connection, before its first message is read."""

    def __init__(self, *arguments: Any, limits: Limits, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._rate_limit = RateLimit(limits)
        self._ahead: deque[Frame] = deque()

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that may change something, as bytes."""
        while True:
            await self._look_ahead()
            await asyncio.sleep(0.0)  # viser first handles the message before
            for frame in self._with_newer_moves(self._ahead.popleft()):
                admitted = await self.guard.admit(*frame)
                if admitted is not None:
                    return admitted

    def _with_newer_moves(self, frame: Frame) -> list[Frame]:
        """The message, and before it later moves of the same slider, the newest first: on a busy
        server a dragged slider would otherwise lag more and more.

        Only moves of sliders and passive messages may lie in between.
        """
        slider = self.guard.slider(frame.message)
        moves, others = [frame], deque[Frame]()
        while slider is not None and self._ahead:
            other_slider = self.guard.slider(self._ahead[0].message)
            if other_slider is None and not isinstance(self._ahead[0].message, Passive):
                break
            (moves if other_slider == slider else others).append(self._ahead.popleft())
        self._ahead.extendleft(reversed(others))
        return moves[::-1]

    async def _look_ahead(self) -> None:
        """Waits for a message, then reads all that have arrived."""
        while not self._ahead or (self.recv_messages.frames and len(self._ahead) < AHEAD):
            try:
                raw = await super().recv(decode=False)
            except ConnectionClosed:
                if self._ahead:  # earlier messages count; the next call raises it
                    return
                raise
            # At least one turn for other tasks: refused messages may come without a pause.
            delay = self._rate_limit.delay()
            await asyncio.sleep(delay if self.state is State.OPEN else 0.0)
            try:
                self._ahead.append(Frame(raw, decoded(raw)))
            except ValueError as fault:
                log.debug("A message that no page sends: %s", fault)
