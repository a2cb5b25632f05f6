"""Opens the page where a person sits."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser


def can_open() -> bool:
    """Whether there is a screen; a browser in a text terminal would be in the way."""
    if os.environ.get("CI") or os.environ.get("SSH_CONNECTION"):
        return False
    if sys.platform.startswith(("win", "darwin")):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_soon(address: str) -> None:
    """Without waiting for it."""
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
