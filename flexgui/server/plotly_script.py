"""plotly.js for each browser from one text: viser would read and keep 10 MB of its own for each."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import plotly
import viser
from viser import _messages


def send_plotly(client: viser.ClientHandle) -> None:
    """Before the first plot of a page; viser then finds that it has been done."""
    gui = client.gui
    if not gui._setup_plotly_js:
        gui._setup_plotly_js = True
        client._websock_connection.queue_message(_messages.RunJavascriptMessage(_script()))


@cache
def _script() -> str:
    path = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
    return path.read_text(encoding="utf-8")
