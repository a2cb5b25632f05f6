"""A websocket connection that hands on only what its guard admits."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

from flexgui.server.guard import Guard
from flexgui.server.limits import Limits


class Pace:
    """A bucket that leaks: nothing is thrown away, who talks too fast is heard later."""

    def __init__(self, per_second: float, burst: int, clock: Callable[[], float]) -> None:
        self._rate, self._burst, self._clock = per_second, burst, clock
        self._level, self._seen = 0.0, clock()

    def delay(self) -> float:
        """s to wait before the message that has just come is heard."""
        now = self._clock()
        self._level = max(self._level - (now - self._seen) * self._rate, 0.0) + 1.0
        self._seen = now
        return max(self._level - self._burst, 0.0) / self._rate


AHEAD = 64
"""Messages looked ahead: a hand sends 20 a second, so three seconds of a server that stood."""


class GuardedConnection(ServerConnection):
    """`recv` is the one place where viser gets messages from."""

    def __init__(
        self,
        *arguments: Any,
        make_guard: Callable[[GuardedConnection], Guard],
        limits: Limits,
        **options: Any,
    ) -> None:
        super().__init__(*arguments, **options)
        self._make_guard = make_guard
        self._guard: Guard | None = None
        self._talk = Pace(limits.messages_per_second, limits.burst, time.monotonic)
        self._ahead: deque[Any] = deque()

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that may change something, as bytes."""
        while True:
            raw = await self._newest(decode)
            assert self._guard is not None
            await asyncio.sleep(0.0)  # viser first does what the message before asked for
            admitted = self._guard.admit(raw)
            if admitted is not None:
                return admitted

    async def _newest(self, decode: bool | None) -> Any:
        """The message that waits longest, but no position of a slider that has moved on since:
        who drags on a busy server would otherwise be answered later and later."""
        while True:
            if not self._ahead:
                self._ahead.append(await self._read(decode))
            while len(self.recv_messages.frames) and len(self._ahead) < AHEAD:
                try:
                    self._ahead.append(await self._read(decode))
                except ConnectionClosed:  # what came before counts; the next call hears of it
                    break
            raw = self._ahead.popleft()
            if not self._ahead or not self._has_moved_on(raw):
                return raw

    def _has_moved_on(self, raw: Any) -> bool:
        """Whether the next messages move the same slider again, and do nothing but move sliders."""
        assert self._guard is not None
        mine = self._guard.moves(raw)
        if not mine:
            return False
        for later in self._ahead:
            theirs = self._guard.moves(later)
            if theirs is None or theirs == mine:
                return theirs == mine
        return False

    async def _read(self, decode: bool | None) -> Any:
        raw = await super().recv(decode)
        if self._guard is None:
            self._guard = self._make_guard(self)
        # At least one turn for the others: refused messages may come without a pause.
        delay = self._talk.delay()
        await asyncio.sleep(delay if self.state is State.OPEN else 0.0)
        return raw
