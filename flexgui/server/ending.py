"""Ctrl-C: a clean end, and an end in any case."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

HARD_END = 4.5
"""s after Ctrl-C; a callback that hangs would otherwise hold the process for ever."""
POLL = 0.5
"""s; on Windows a wait without end hears no Ctrl-C."""

SIGNALS = [s for name in ("SIGINT", "SIGTERM", "SIGHUP") if (s := getattr(signal, name, None))]


@contextmanager
def until_asked() -> Iterator[threading.Event]:
    """An event that is set by Ctrl-C and its relatives; a second one ends everything at once."""
    asked = threading.Event()

    def hear(number: int, frame: FrameType | None) -> None:
        if asked.is_set():
            os._exit(130)
        asked.set()

    before = {number: signal.signal(number, hear) for number in SIGNALS}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def wait(asked: threading.Event) -> None:
    """Until then."""
    while not asked.wait(POLL):
        pass


def end_in_any_case(seconds: float = HARD_END) -> None:
    """A clean end is sooner; threads that do not end are left behind."""

    def end() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
