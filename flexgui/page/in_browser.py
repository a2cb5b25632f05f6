"""Loads the scripts and styles of `browser/` into the page: the curtain, buttons in HTML, the
time-line, names for screen readers, figures to copy."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import viser
from viser import _messages

PURPOSE = "Find the physics your model lacks."
"""The page's purpose, in one line."""

CONNECTING = "Loading the page"
PREPARING = "Preparing the equations"
BUILDING = "Building the model and its responses"
DRAWING = "Drawing the arm and the plots"
"""The steps of loading, in this order; the curtain ticks them off."""

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
    """The text of a file in `browser/`."""
    return (Path(__file__).parent / "browser" / name).read_text(encoding="utf-8")


@cache
def _scripts() -> str:
    return "\n".join([STYLE % json.dumps(asset("page.css")), *map(asset, SCRIPTS)])


def install_scripts(client: viser.ClientHandle) -> None:
    """Runs all scripts in this browser, before its page is built; a second call does nothing."""
    run_javascript(client, _scripts())


def watch_connection(client: viser.ClientHandle) -> None:
    """Makes the browser check repeatedly whether the server answers."""
    run_javascript(client, asset("watch.js"))


def show_progress(client: viser.ClientHandle, text: str) -> None:
    """Shows a step of loading on the curtain, if it is still there."""
    run_javascript(
        client, f"window.fxShowStep && window.fxShowStep({json.dumps(text, ensure_ascii=False)})"
    )


def remove_curtain(client: viser.ClientHandle) -> None:
    """Removes the curtain from the drawn page; a second call does nothing."""
    run_javascript(client, "window.fxRemoveCurtain && window.fxRemoveCurtain()")


def run_javascript(client: viser.ClientHandle, script: str) -> None:
    """Runs a script in this browser, after all messages sent before."""
    client._websock_connection.queue_message(_messages.RunJavascriptMessage(script))


AFTER_DRAWING = re.compile(
    r"(function \w+\((\w+)\)\{var (\w+)=\2\._fullLayout;)(?=\3\._redrawFromAutoMarginCount\?)"
)
"""The last step of a drawing, which fails if the plot was removed from the page meanwhile."""
AFTER_REACTING = re.compile(r"\.emit(?=\(\"plotly_react\")")
"""This step fails in the same case."""


@cache
def plotly_script() -> str:
    """plotly.js 7.1.0 with two faults corrected."""
    from plotly.offline import get_plotlyjs

    text = AFTER_DRAWING.sub(r"\1if(!\3||!\2.emit)return;", get_plotlyjs())
    return AFTER_REACTING.sub(".emit?.", text)
