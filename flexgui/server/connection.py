"""The websocket of one browser, which hands on to viser only what its guard admits."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

from flexgui.server.guard import Guard
from flexgui.server.messages import decoded
from flexgui.server.services import Limits

log = logging.getLogger(__name__)


class Pace:
    """A bucket that leaks: nothing is thrown away, who talks too fast is heard later."""

    def __init__(self, limits: Limits) -> None:
        self._rate, self._burst = limits.messages_per_second, limits.burst
        self._level, self._seen = 0.0, time.monotonic()

    def delay(self) -> float:
        """s to wait before the message that has just come is heard."""
        now = time.monotonic()
        self._level = max(self._level - (now - self._seen) * self._rate, 0.0) + 1.0
        self._seen = now
        return max(self._level - self._burst, 0.0) / self._rate


class GuardedConnection(ServerConnection):
    """`recv` is the one place where viser gets messages from."""

    guard: Guard
    """Set by whoever announces the connection, before its first message is read."""

    def __init__(self, *arguments: Any, limits: Limits, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._pace = Pace(limits)

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that may change something, as bytes."""
        while True:
            raw = await super().recv(decode=False)
            # At least one turn for the others: refused messages may come without a pause, and viser
            # first does what the message before asked for.
            delay = self._pace.delay()
            await asyncio.sleep(delay if self.state is State.OPEN else 0.0)
            try:
                message = decoded(raw)
            except ValueError as fault:
                log.debug("A message that no page sends: %s", fault)
                continue
            admitted = await self.guard.admit(raw, message)
            if admitted is not None:
                return admitted
