"""What stands before a page until it is drawn: nobody sees a half-built one."""

from __future__ import annotations

import json

import viser
from viser import _messages

PURPOSE = "Find out what your robot model does not know."
"""What the page is for, in one line."""

CONNECTING = "Loading the page"
PREPARING = "Preparing the equations and the integrator"
BUILDING = "Building the model and its responses"
DRAWING = "Drawing the arm and the plots"
"""What is prepared, in this order; the curtain ticks them off."""


def show_progress(client: viser.ClientHandle, text: str) -> None:
    """Say below the curtain's title what is waited for, where a curtain still stands."""
    _run(client, f"window.fxTell && window.fxTell({json.dumps(text, ensure_ascii=False)})")


def lift(client: viser.ClientHandle) -> None:
    """Show the page, which has been drawn; a second time it does nothing."""
    _run(client, "window.fxLift && window.fxLift()")


def _run(client: viser.ClientHandle, script: str) -> None:
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(script))
