"""A button that is pressed right after a key waits until what was typed is on its way."""

from __future__ import annotations

import viser
from viser import _messages

SCRIPT = """(() => {
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
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(SCRIPT))
