"""plotly.js for each browser from one text: viser would read and keep 10 MB of its own for each."""

from __future__ import annotations

import re
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


AFTER_DRAWING = re.compile(
    r"(function \w+\((\w+)\)\{var (\w+)=\2\._fullLayout;)(?=\3\._redrawFromAutoMarginCount\?)"
)
"""The last step of a drawing, which fails where the plot was taken from the page meanwhile."""
AFTER_REACTING = re.compile(r"(\w+)(?=\.emit\(\"plotly_react\")")
"""So does this one."""


@cache
def _script() -> str:
    path = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
    text = AFTER_DRAWING.sub(r"\1if(!\3||!\2.emit)return;", path.read_text(encoding="utf-8"))
    return AFTER_REACTING.sub(r"\1.emit&&\1", text)
