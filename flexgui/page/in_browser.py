"""What runs in the browser itself: the curtain that stands before a page until it is drawn, keys,
names for those who hear the page, figures to copy."""

from __future__ import annotations

import json
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
    run_javascript(client, _script())


LATE_CLICKS = """(() => {
  if (window.fxLate) return;
  window.fxLate = true;
  let typed = -1e9;
  document.addEventListener("input", () => { typed = performance.now(); }, true);
  document.addEventListener("click", event => {
    const button = event.target.closest("button");
    const rest = typed + 120 - performance.now();
    if (!button || rest <= 0) return;
    event.stopPropagation();
    event.preventDefault();
    setTimeout(() => button.click(), rest);
  }, true);
})();"""
"""viser keeps one message back for 50 ms, the newest of all inputs: the click would replace what
was typed, which then never arrives. Twice that and a little more is waited for."""


def let_typing_arrive(client: viser.ClientHandle) -> None:
    """For this browser's whole page."""
    run_javascript(client, LATE_CLICKS)


PURPOSE = "Find out what your robot model does not know."
"""What the page is for, in one line."""

CONNECTING = "Loading the page"
PREPARING = "Preparing the equations"
BUILDING = "Building the model and its responses"
DRAWING = "Drawing the arm and the plots"
"""What is prepared, in this order; the curtain ticks them off."""


def show_progress(client: viser.ClientHandle, text: str) -> None:
    """Say below the curtain's title what is waited for, where a curtain still stands."""
    run_javascript(
        client, f"window.fxTell && window.fxTell({json.dumps(text, ensure_ascii=False)})"
    )


def lift(client: viser.ClientHandle) -> None:
    """Show the page, which has been drawn; a second time it does nothing."""
    run_javascript(client, "window.fxLift && window.fxLift()")


def run_javascript(client: viser.ClientHandle, script: str) -> None:
    """Run a script in this browser, after what it was sent before."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(script))
