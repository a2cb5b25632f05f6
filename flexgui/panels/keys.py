"""What the browser does by itself: keys, names for those who hear the page, figures to copy."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import viser
from viser import _messages


@cache
def _script() -> str:
    folder = Path(__file__).parent / "browser"
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.js")))


def help_hands(client: viser.ClientHandle) -> None:
    """For this browser; a second time it does nothing."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(_script()))
