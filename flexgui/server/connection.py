"""A websocket connection that hands on only what its guard admits."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

from flexgui.server.guard import Guard
from flexgui.server.limits import Limits
from flexgui.server.pace import Pace


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

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that may change something, as bytes."""
        while True:
            raw = await super().recv(decode)
            if self._guard is None:
                self._guard = self._make_guard(self)
            # At least one turn for the others: refused messages may come without a pause.
            delay = self._talk.delay()
            await asyncio.sleep(delay if self.state is State.OPEN else 0.0)
            admitted = self._guard.admit(raw)
            if admitted is not None:
                return admitted
