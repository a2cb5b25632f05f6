"""The widths of the page's panels for the size of a browser's window, and its light or dark theme.

viser reports only the size of the 3-D picture, in pixels of the screen. A script in the browser
stores the window's size in the pixels of the panels, and the server reads it from there.
"""

from __future__ import annotations

import logging
import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import viser

from flexgui.jobs.inbox import Inbox
from flexgui.page.in_browser import asset, run_javascript

log = logging.getLogger(__name__)

PLOTS, CONTROLS, ARM = 560.0, 400.0, 420.0
"""px: preferred widths in a usual window."""
PLOTS_SHARE = 0.37
"""Share of a wide window for the plots."""
TWO_COLUMNS = 820.0
"""px of the plots from which they stand in two columns; the same as in `browser/page.css`."""
BORDERS = 8.0
"""px of both panels' borders."""
LEAST_PLOTS, LEAST_CONTROLS = 320.0, 340.0
"""px: narrower figures cannot be read and narrower buttons cannot be pressed."""
PHONE = 576.0
"""px: up to this width viser puts all panels into one sheet."""
LINE_HEIGHT = 56.0
"""px of the time-line over the 3-D picture."""

STORED_AS, THEME_KEPT_AS = "flexgui-window", "flexgui-theme"
"""Keys of the browser's storage: what browser/window.js measures, and the chosen theme."""
ANSWER_TIMEOUT, RESIZE_DELAY = 0.5, 0.3
"""s for an answer, and from the first change of a size to the question."""
RETRY_DELAY, LATE_TIMEOUT = 1.0, 4.0
"""s until a browser that did not answer is asked again, and for that answer: on a phone the layout
of a wide window would hide the arm."""
MOST_RETRIES = 5
"""Later questions; a browser that has not answered by then never will."""
LEAST_CHANGE = 0.005
"""Relative change of the picture's aspect from which the browser is asked again."""
_ANSWER = re.compile(
    r"(\d{2,5}) (\d{2,5}) (\d{1,5})(?: (light|dark)(?: (light|dark))?)?( gpu)?", re.ASCII
)


@dataclass(frozen=True)
class Window:
    """A browser's window in px; `picture` is the width left for the arm, 0 if not known."""

    width: float = 1600.0
    height: float = 900.0
    picture: float = 0.0
    system_dark: bool = False
    theme: str = ""
    """ "light" or "dark" where one was chosen in this browser before."""
    gpu: bool = False
    """Whether a graphics card draws the arm, or a person wants it as fine as with one."""

    @property
    def phone(self) -> bool:
        """Whether the window is as narrow as a phone's."""
        return self.width <= PHONE


@dataclass(frozen=True)
class Widths:
    """px of the two panels beside the 3-D picture."""

    plots: float
    controls: float

    @property
    def columns(self) -> int:
        """The number of columns of the plots."""
        return 2 if self.plots >= TWO_COLUMNS else 1


def window_of(text: str | None) -> Window | None:
    """The window from the browser's stored text; None if it is not valid."""
    match = _ANSWER.fullmatch(text or "")
    if match is None:
        return None
    width, height, picture, system, theme, gpu = match.groups()
    sizes = float(width), float(height), float(picture)
    return Window(*sizes, system == "dark", theme or "", bool(gpu))


def widths(window: Window) -> Widths:
    """Both panels shrink until the arm has enough width, each in proportion to its spare width."""
    plots = max(PLOTS, PLOTS_SHARE * window.width)
    spare_plots, spare_controls = plots - LEAST_PLOTS, CONTROLS - LEAST_CONTROLS
    lacking = plots + CONTROLS + BORDERS + ARM - window.width
    share = min(max(lacking / (spare_plots + spare_controls), 0.0), 1.0)
    return Widths(round(plots - share * spare_plots), round(CONTROLS - share * spare_controls))


def aspect(window: Window) -> float:
    """Ratio of width to height of the 3-D picture."""
    if window.phone:
        return window.width / window.height
    shares = widths(window)
    width = window.width - shares.plots - shares.controls - BORDERS
    return (window.picture or width) / window.height


def covered(window: Window) -> float:
    """Share of the picture's height that the time-line covers at the bottom."""
    return min(2.0 * LINE_HEIGHT / window.height, 0.5)


WindowCallback = Callable[[Window, Widths], None]


class PageLayout:
    """Asks one browser for its window, at the start and when its picture has changed its shape."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._callbacks: list[WindowCallback] = []
        self._reporting = threading.RLock()
        self._answered, self._tries = False, 0  # ever; questions since an answer
        self._shape = client.camera.aspect
        self.window = self._reported = Window()
        # Items are the times at which a question is due; of several the first is kept.
        self._questions = Inbox(
            self._again, lambda waiting, due: waiting or [due],
            lambda waiting: waiting[0] - time.monotonic(),
        )  # fmt: skip
        # Meanwhile the page is built.
        self._first = threading.Thread(target=self._ask, name="window", daemon=True)
        self._first.start()
        client.camera.on_update(self._moved)

    def begin(self, *callbacks: WindowCallback) -> None:
        """Calls the callbacks at once, and after each change."""
        self._first.join(2.0 * ANSWER_TIMEOUT)
        # It was the whole window's width: there was no panel yet.
        self.window = replace(self.window, picture=0.0)
        self._callbacks += callbacks
        self._report()
        if not self._answered:
            self._questions.put(time.monotonic() + RETRY_DELAY)

    def close(self) -> None:
        """Asks nothing more and calls no callback any more."""
        self._questions.close()
        with self._reporting:
            self._callbacks.clear()

    async def _moved(self, camera: viser.CameraHandle) -> None:
        """On the event loop, at every turn of the view."""
        if abs(camera.aspect / self._shape - 1.0) >= LEAST_CHANGE:
            self._questions.put(time.monotonic() + RESIZE_DELAY)

    def _again(self, _: list[float]) -> None:
        self._shape = self._client.camera.aspect
        is_late = not self._answered
        self._tries += 1
        self._ask(LATE_TIMEOUT if is_late or self._tries > 1 else ANSWER_TIMEOUT)
        if is_late:  # measured beside panels that still have the widths of a wide window
            self.window = replace(self.window, picture=0.0)
        # An answer that came too late for the beginning counts too.
        if self.window != self._reported:
            self._report()
        if 0 < self._tries < MOST_RETRIES:
            self._questions.put(time.monotonic() + RETRY_DELAY)

    def _ask(self, patience: float = ANSWER_TIMEOUT) -> None:
        run_javascript(self._client, asset("window.js"))
        try:
            answer = window_of(self._client.local_storage.get_item(STORED_AS, patience))
        except (RuntimeError, TimeoutError) as error:
            log.debug("Client %d does not report its size: %s", self._client.client_id, error)
            return
        if answer is not None:
            self._answered, self._tries, self.window = True, 0, answer

    def _report(self) -> None:
        self._reported = self.window
        shares = widths(self.window)
        with self._reporting:
            for take in self._callbacks:
                take(self.window, shares)


AS_SYSTEM, LIGHT, DARK = "as the system", "light", "dark"
THEMES = (AS_SYSTEM, LIGHT, DARK)


class Theme:
    """The theme of one browser's page."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self.chosen, self.dark = AS_SYSTEM, False
        self._system_dark = False
        client.gui.configure_theme(show_share_button=False, show_logo=False)
        self.callbacks: list[Callable[[bool], None]] = []
        """Called with whether the page is dark, when that changes."""

    def fit(self, window: Window, shares: Widths) -> None:
        """Takes the system's theme and the stored choice from the browser."""
        self._system_dark = window.system_dark
        if window.theme in (LIGHT, DARK):
            self.chosen = window.theme
        self._apply()

    def choose(self, name: str) -> None:
        """Sets one of `THEMES`; the browser stores it."""
        self.chosen = name if name in THEMES else AS_SYSTEM
        self._client.local_storage.set_item(THEME_KEPT_AS, self.chosen)
        self._apply()

    def _apply(self) -> None:
        dark = self._system_dark if self.chosen == AS_SYSTEM else self.chosen == DARK
        if dark == self.dark:
            return
        self.dark = dark
        self._client.gui.configure_theme(dark_mode=dark, show_share_button=False, show_logo=False)
        for callback in self.callbacks:
            callback(dark)
