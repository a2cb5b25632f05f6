"""Asks a browser which session is its own, and tells it which one is."""

from __future__ import annotations

import logging
import re

import viser

STORED_AS = "flexgui-session"
_KEY = re.compile(r"[\w-]{16,64}", re.ASCII)

log = logging.getLogger(__name__)


def stored_key(client: viser.ClientHandle, timeout: float) -> str | None:
    """What the browser kept; None where it kept nothing, keeps nothing, or does not answer."""
    try:
        key = client.local_storage.get_item(STORED_AS, timeout)
    except (RuntimeError, TimeoutError) as error:
        log.debug("Client %d has no key: %s", client.client_id, error)
        return None
    return key if key is not None and _KEY.fullmatch(key) else None


def store_key(client: viser.ClientHandle, key: str) -> None:
    """For the next time."""
    client.local_storage.set_item(STORED_AS, key)
