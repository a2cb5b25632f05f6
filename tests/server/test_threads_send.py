"""Many threads draw for one browser while the event loop sends."""

from __future__ import annotations

import asyncio
from typing import Any

from flexgui.server.guarded import NewsEvent
from tests.server.conftest import Place
from tests.server.helpers import Browser, apart


class Waiter:
    """Of the event loop, which alone may look at it."""

    def done(self) -> bool:
        raise RuntimeError("deque mutated during iteration")


def test_a_thread_that_sends_leaves_the_loops_waiters_alone() -> None:
    event: Any = NewsEvent()
    event._waiters.append(Waiter())
    apart(event.set)
    assert event.is_set()


def test_who_waits_wakes_by_a_set_on_the_loop_even_after_one_of_a_thread() -> None:
    async def wake() -> bool:
        event = NewsEvent()
        waiting = asyncio.create_task(event.wait())
        await asyncio.sleep(0.0)
        await asyncio.to_thread(event.set)
        assert event.is_set() and not waiting.done()
        event.set()
        return await waiting

    assert apart(asyncio.run, wake())


def test_every_browsers_messages_are_announced_so(place: Place) -> None:
    inside = place.server.viser._websock_server
    with Browser(place.server) as browser:
        place.page(browser)
        buffers = [inside._broadcast_buffer]
        buffers += [state.message_buffer for state in inside._client_state_from_id.values()]
        assert len(buffers) == 2
        assert all(isinstance(buffer.message_event, NewsEvent) for buffer in buffers)
