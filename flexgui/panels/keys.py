"""Arrow keys on a slider move the slider only; viser would turn the view with them as well."""

from __future__ import annotations

import viser
from viser import _messages

SCRIPT = """(() => {
  if (window.fxKeys) return;
  window.fxKeys = true;
  document.body.addEventListener("keydown", event => {
    if (event.key.startsWith("Arrow") && event.target.closest('[role="slider"]'))
      event.stopPropagation();
  });
})();"""
"""The slider has heard the key before the body; viser's camera listens on the document."""


def keep_view_still(client: viser.ClientHandle) -> None:
    """For this browser; each picture that is drawn for nothing also delays the next one."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(SCRIPT))
