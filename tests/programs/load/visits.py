"""`python -m tests.programs.load.visits`: a first visit on a bare machine, a later one, a slider's
move and playback, measured from the browser and printed beside what is asked.

The times are the machine's as much as the program's: nothing else should run on it.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.arm.cache import VARIABLE
from flexgui.server.warming import READY
from tests.conftest import headless_browser
from tests.page.helpers import SIZE, labelled, press
from tests.server.served import Served, served, until

LIFTED = "!document.getElementById('fx-curtain')"
"""The page is shown."""
PLOTTED = "!!document.querySelector('.js-plotly-plot')"
"""The plots have their final places: their library comes behind the page."""
ASKED = (15.0, 3.0, 150.0, 15.0)
"""s of a first and of a later visit, ms from a move to the picture, frames per second."""
SLIDERS = ("θ2 [deg]", "ε [GPa]", "d [mm]")
MOVES, WARM_MOVES = 30, 5
"""Per slider; before these, since the first drawings of a page are slower."""
PAUSE = 250.0
"""ms between two moves, as a person drags and looks."""
PLAYED = 10.0
"""s of playback."""
PATIENCE = 180_000
"""ms"""

WATCH = """() => {
  const isSeen = place => {
    const box = place.getBoundingClientRect();
    return box.top < innerHeight && box.bottom > 0;
  };
  const plots = [...document.querySelectorAll('.js-plotly-plot')].filter(isSeen);
  const charts = Object.values(window.__viserTestpoints.uplots).map(u => u.chart)
    .filter(chart => isSeen(chart.root));
  const seen = window.seen = {times: []};
  let start = 0, left = new Set();
  document.addEventListener('keydown', () => {
    start = performance.now();
    left = new Set([...plots, ...charts]);
  }, true);
  const drawn = one => {
    if (!start || !left.delete(one) || left.size) return;
    const begin = start;
    start = 0;
    requestAnimationFrame(() => seen.times.push(performance.now() - begin));
  };
  for (const plot of plots) plot.on('plotly_afterplot', () => drawn(plot));
  for (const chart of charts) (chart.hooks.draw ??= []).push(() => drawn(chart));
}"""
"""Notes the ms from a key to the frame after all plots that are seen were drawn anew; the arm's
message comes in one piece with theirs and is drawn with the same frame."""

FRAMES = """milliseconds => new Promise(resolve => {
  const begin = performance.now();
  let count = 0;
  const frame = now => {
    if (now - begin > milliseconds) return resolve(count);
    count++;
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
})"""
"""How many frames the browser draws in so many ms."""


def visited(folder: Path, cache: Path, more: Any) -> float:
    """s from the start of the program to a page that is shown, in a browser that is open already;
    `more(page, server)` follows."""
    os.environ[VARIABLE] = str(cache)
    folder.mkdir()
    with headless_browser() as browser:
        page = browser.new_context(viewport=SIZE).new_page()
        page.set_default_timeout(PATIENCE)
        began = time.monotonic()
        with served(folder, nice=True) as server:
            page.goto(server.address)
            page.wait_for_function(LIFTED)
            seconds = time.monotonic() - began
            more(page, server)
    return seconds


def until_compiled(page: Any, server: Served) -> None:
    """A later visit finds all that a first one compiles behind its page."""
    until(lambda: READY in server.terminal, PATIENCE / 1e3)


def moved(page: Any, label: str) -> list[float]:
    """ms from each arrow key on a slider to the frame that shows what it changes."""
    labelled(page, label).get_by_role("slider").focus()
    page.evaluate(WATCH)
    for k in range(WARM_MOVES + MOVES):
        page.keyboard.press("ArrowRight")
        page.wait_for_function(f"window.seen.times.length > {k}", polling=50)
        page.wait_for_timeout(PAUSE)
    found: list[float] = page.evaluate("window.seen.times")
    return found[WARM_MOVES:]


def frames(page: Any) -> float:
    """Frames per second in which the playing arm is drawn anew."""
    press(page, "Data")
    page.locator("#fx-line .play").wait_for()
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press(" ")
    page.wait_for_timeout(2000.0)
    page.locator('#fx-line button[aria-label="Pause"]').wait_for()
    found: int = page.evaluate(FRAMES, 1e3 * PLAYED)
    return found / PLAYED


def said(what: str, found: float, unit: str, asked: float, good: bool) -> None:
    print(f"{'yes' if good else 'NO ':3}  {what:<34} {found:8.1f} {unit:<9} {asked:g}", flush=True)


def main() -> None:
    """Prints one line per measurement."""
    first, later, move, rate = ASKED
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def work(page: Any, server: Served) -> None:
            page.wait_for_function(PLOTTED)
            for label in SLIDERS:
                took = float(np.median(moved(page, label)))
                said(f"from a move of {label} to its picture", took, "ms", move, took <= move)
            found = frames(page)
            said("playback", found, "frames/s", rate, found >= rate)

        seconds = visited(folder / "first", folder / "cache", until_compiled)
        said("first visit", seconds, "s", first, seconds <= first)
        seconds = visited(folder / "later", folder / "cache", work)
        said("later visit", seconds, "s", later, seconds <= later)


if __name__ == "__main__":
    main()
