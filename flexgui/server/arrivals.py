"""Asks a browser which session is its own, and tells it which one is."""

from __future__ import annotations

import contextlib
import logging
import re
import threading

import viser

STORED_AS = "flexgui-session"
_KEY = re.compile(r"[\w-]{16,64}", re.ASCII)

log = logging.getLogger(__name__)


def stored_key(client: viser.ClientHandle, timeout: float) -> str | None:
    """What the browser kept; None where it kept nothing, TimeoutError where it does not answer."""
    try:
        key = client.local_storage.get_item(STORED_AS, timeout)
    except RuntimeError as error:
        log.debug("Client %d has no key: %s", client.client_id, error)
        return None
    return key if key is not None and _KEY.fullmatch(key) else None


class Asking:
    """Waits longer for a browser that does not answer at once, but for a few of them only: on a
    busy machine an answer takes its time, and whoever never answers must not keep others out."""

    def __init__(self, at_once: float, longer: float, most: int) -> None:
        """Times in s; `most` browsers are waited for longer."""
        self._at_once, self._longer = at_once, longer
        self._patience = threading.BoundedSemaphore(most)

    def key_of(self, client: viser.ClientHandle) -> tuple[str | None, bool]:
        """Its key, if any, and whether it has answered: who has not may have one all the same."""
        with contextlib.suppress(TimeoutError):
            return stored_key(client, self._at_once), True
        if not self._patience.acquire(blocking=False):
            return None, False
        try:
            return stored_key(client, self._longer), True
        except TimeoutError:
            return None, False
        finally:
            self._patience.release()


def store_key(client: viser.ClientHandle, key: str) -> None:
    """For the next time."""
    client.local_storage.set_item(STORED_AS, key)
