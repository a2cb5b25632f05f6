"""What runs in the browser itself, in `browser/`: the page's style, the curtain that stands before
it until it is drawn, what is pressed in its own HTML, the
time-line, names for those who hear the page, figures to copy."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import viser
from viser import _messages

PURPOSE = "Find the physics your model lacks."
"""What the page is for, in one line."""

CONNECTING = "Loading the page"
PREPARING = "Preparing the equations"
BUILDING = "Building the model and its responses"
DRAWING = "Drawing the arm and the plots"
"""What is prepared, in this order; the curtain ticks them off."""

STYLE = """(() => {
  if (document.getElementById("fx-style")) return;
  const style = document.createElement("style");
  style.id = "fx-style";
  style.textContent = %s;
  document.head.append(style);
})();"""
SCRIPTS = ("page.js", "actions.js", "timeline.js", "plots.js", "files.js")


@cache
def asset(name: str) -> str:
    """The text of a file that browsers get."""
    return (Path(__file__).parent / "browser" / name).read_text(encoding="utf-8")


@cache
def _scripts() -> str:
    return "\n".join([STYLE % json.dumps(asset("page.css")), *map(asset, SCRIPTS)])


def install_scripts(client: viser.ClientHandle) -> None:
    """For this browser, before its page is built; a second time it does nothing."""
    run_javascript(client, _scripts())


def watch_connection(client: viser.ClientHandle) -> None:
    """From now on the browser looks by itself whether the server is there."""
    run_javascript(client, asset("watch.js"))


def show_progress(client: viser.ClientHandle, text: str) -> None:
    """Say below the curtain's title what is waited for, where a curtain still stands."""
    run_javascript(
        client, f"window.fxTell && window.fxTell({json.dumps(text, ensure_ascii=False)})"
    )


def remove_curtain(client: viser.ClientHandle) -> None:
    """Show the page, which has been drawn; a second time it does nothing."""
    run_javascript(client, "window.fxLift && window.fxLift()")


def run_javascript(client: viser.ClientHandle, script: str) -> None:
    """Run a script in this browser, after what it was sent before."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(script))


AFTER_DRAWING = re.compile(
    r"(function \w+\((\w+)\)\{var (\w+)=\2\._fullLayout;)(?=\3\._redrawFromAutoMarginCount\?)"
)
"""The last step of a drawing, which fails where the plot was taken from the page meanwhile."""
AFTER_REACTING = re.compile(r"\.emit(?=\(\"plotly_react\")")
"""So does this one."""


@cache
def plotly_script() -> str:
    """plotly.js 7.1.0 without two of its faults."""
    from plotly.offline import get_plotlyjs

    text = AFTER_DRAWING.sub(r"\1if(!\3||!\2.emit)return;", get_plotlyjs())
    return AFTER_REACTING.sub(".emit?.", text)
