"""The page before its first message: viser's client behind a curtain that says what is coming.

viser's own client shows an empty panel, its scene tree and an empty picture until the server has
built the page. The curtain covers these, in the colours of the system's theme or of the one that
was chosen, and is lifted by `flexgui.page.in_browser`.
"""

from __future__ import annotations

import html
import json
import re
from functools import cache

import viser
from plotly.offline import get_plotlyjs

from flexgui.page.in_browser import (
    BUILDING,
    CONNECTING,
    DRAWING,
    PREPARING,
    PURPOSE,
    run_javascript,
)
from flexgui.page.layout import THEME_KEPT_AS

LONGEST = 150_000
"""ms after which the curtain goes from a page whose stages stand: longer than a first start
compiles. An empty page stays covered, and its curtain says so."""
SLOW = (
    "This takes longer than usual. The page comes by itself; if it does not, look for a message "
    "where FlexGUI was started."
)
SOON = 4_000
"""ms that the first picture may take once the page says that it is drawn."""

STEPS = "".join(f"<li>{text}</li>" for text in (CONNECTING, PREPARING, BUILDING, DRAWING))
AHEAD = (
    "What you can do in five minutes",
    "Watch an arm whose model lacks something, see where the model fails, let every known effect "
    "be tried on what is left, add the one that fits, and watch the error fall.",
)
"""Something to read meanwhile: on a busy machine it takes half a minute."""

CURTAIN = f"""
<style>
#fx-curtain {{ position: fixed; inset: 0; z-index: 9000; display: flex; flex-direction: column;
  align-items: center; justify-content: center; gap: .6rem; padding: 1rem; text-align: center;
  font: 1rem/1.4 system-ui, sans-serif; background: #fff; color: #1c2127;
  transition: opacity .25s; }}
#fx-curtain h1 {{ margin: 0; font-size: 2.2rem; }} #fx-curtain p {{ margin: 0; }}
#fx-curtain .purpose {{ font-size: 1.2rem; }} #fx-curtain .state {{ color: #59616b; }}
#fx-curtain .bar {{ width: min(20rem, 70vw); height: 6px; border-radius: 3px; overflow: hidden;
  background: #dde2e7; margin-top: .6rem; }}
#fx-curtain .bar i {{ display: block; height: 100%; width: 8%; background: #1971c2;
  transition: width .6s; }}
#fx-curtain ol {{ list-style: none; margin: 0; padding: 0; text-align: left; }}
#fx-curtain li {{ color: #59616b; }} #fx-curtain li::before {{ content: "○"; display: inline-block;
  width: 1.4em; }}
#fx-curtain li.now {{ color: inherit; font-weight: 600; }}
#fx-curtain li.now::before {{ content: "●"; color: #1971c2; }}
#fx-curtain li.done::before {{ content: "✓"; color: #157356; }}
#fx-curtain .first {{ max-width: 34rem; margin-top: 1.2rem; text-align: left; }}
#fx-curtain .first b {{ display: block; }}
#fx-curtain.dark li, #fx-curtain.dark .first {{ color: #b3bbc4; }}
#fx-curtain.dark li.now {{ color: #eceff2; }}
#fx-curtain.dark {{ background: #141414; color: #eceff2; }}
#fx-curtain.dark .state {{ color: #b3bbc4; }} #fx-curtain.dark .bar {{ background: #3a4149; }}
</style>
<div id="fx-curtain" role="status" aria-live="polite"><h1>FlexGUI</h1>
<p class="purpose">{html.escape(PURPOSE)}</p>
<div class="bar"><i></i></div><ol>{STEPS}</ol><p class="state"></p>
<div class="first"><b>{AHEAD[0]}</b>{AHEAD[1]}</div></div>
<script>(() => {{
  const curtain = document.getElementById("fx-curtain"), began = Date.now();
  let chosen = null;
  try {{ chosen = localStorage.getItem("viser-user:{THEME_KEPT_AS}"); }} catch (error) {{}}
  const dark = chosen === "dark"
    || (chosen !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  curtain.classList.toggle("dark", dark);
  const state = curtain.querySelector(".state"), bar = curtain.querySelector("i");
  const items = [...curtain.querySelectorAll("li")], shares = [8, 30, 50, 80];
  // How far it is follows from what stands in the page behind the curtain, and from the server.
  const steps = [["canvas", 1], [".fx-bar", 3]];
  let at = -1;
  const reach = place => {{
    if (place <= at) return;
    at = place;
    bar.style.width = shares[at] + "%";
    items.forEach((item, k) => {{ item.className = k < at ? "done" : k === at ? "now" : ""; }});
  }};
  reach(0);
  const look = setInterval(() => {{
    for (const [what, place] of steps) if (document.querySelector(what)) reach(place);
    if (document.querySelector(".uplot, .js-plotly-plot")) bar.style.width = "92%";
    if (Date.now() - began > {LONGEST}) {{
      if (document.querySelector(".fx-bar")) away();
      else state.textContent = {json.dumps(SLOW)};
    }}
  }}, 100);
  const away = () => {{
    clearInterval(look);
    curtain.style.opacity = 0;
    setTimeout(() => curtain.remove(), 250);
  }};
  window.fxTell = text => {{
    const place = items.findIndex(item => item.textContent === text);
    state.textContent = place < 0 ? text : "";
    if (place >= 0) reach(place);
  }};
  window.fxLift = () => {{
    window.fxLift = null;
    const since = Date.now();
    const wait = setInterval(() => {{
      const drawn = !document.querySelector(".fx-bar")
        || document.querySelector(".u-over, .js-plotly-plot .main-svg, .fx .tour");
      if (!drawn && Date.now() - since < {SOON}) return;
      clearInterval(wait);
      bar.style.width = "100%";
      requestAnimationFrame(() => requestAnimationFrame(away));
    }}, 50);
  }};
}})();</script>
"""


def behind_curtain(page: bytes, title: str) -> bytes:
    """viser's client with our title, and the curtain as the first thing of its body."""
    page = page.replace(b"<title>Viser</title>", f"<title>{title}</title>".encode())
    return page.replace(b"<body>", b"<body>" + CURTAIN.encode(), 1)


ALIVE = "/alive"
"""What the page asks for; answered without a word."""

LOST = "The connection is lost. Your work is kept; this page comes back by itself."
JOIN = "The server was restarted and needs its join code: reload this page."

WATCH = f"""(() => {{
  if (window.flexguiWatch) return;
  window.flexguiWatch = true;
  const banner = document.createElement("div");
  banner.setAttribute("role", "alert");
  banner.style.cssText = "position:fixed;top:0;left:0;right:0;z-index:10000;padding:.6rem 1rem;"
    + "text-align:center;font:600 1rem system-ui,sans-serif;color:#fff;background:#b3261e";
  banner.hidden = true;
  document.body.append(banner);
  let failed = 0;
  const show = (text) => {{ banner.textContent = text; banner.hidden = !text; }};
  const ask = async () => {{
    try {{
      const options = {{cache: "no-store", signal: AbortSignal.timeout(5000)}};
      const answer = await fetch("{ALIVE}", options);
      failed = 0;
      show(answer.status === 401 ? "{JOIN}" : "");
    }} catch (error) {{
      failed += 1;
      if (failed > 1) show("{LOST}");
    }}
    setTimeout(ask, failed ? 1000 : 3000);
  }};
  ask();
}})();"""


def watch_connection(client: viser.ClientHandle) -> None:
    """From now on the browser looks by itself."""
    run_javascript(client, WATCH)


def send_plotly(client: viser.ClientHandle) -> None:
    """Before the first plot of a page; viser then finds that it has been done."""
    gui = client.gui
    if not gui._setup_plotly_js:
        gui._setup_plotly_js = True
        run_javascript(client, _plotly_script())


AFTER_DRAWING = re.compile(
    r"(function \w+\((\w+)\)\{var (\w+)=\2\._fullLayout;)(?=\3\._redrawFromAutoMarginCount\?)"
)
"""The last step of a drawing, which fails where the plot was taken from the page meanwhile."""
AFTER_REACTING = re.compile(r"(\w+)(?=\.emit\(\"plotly_react\")")
"""So does this one."""


@cache
def _plotly_script() -> str:
    text = AFTER_DRAWING.sub(r"\1if(!\3||!\2.emit)return;", get_plotlyjs())
    return AFTER_REACTING.sub(r"\1.emit&&\1", text)
