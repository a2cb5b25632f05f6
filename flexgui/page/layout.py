"""Who gets how much of the window: in a narrow one plots and stages leave the arm its room. Light
or dark: as the system is, or as a person has chosen, which their browser keeps.

The server is told the size of the 3-D picture only, in pixels of the screen; the window's is
written down by the browser when it is asked, in the pixels that panels are measured in.
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
"""px: what each wants, of a usual window."""
PLOTS_SHARE = 0.37
"""Of a wide window, for the plots."""
TWO_COLUMNS = 820.0
"""px of the plots from which they stand in two columns; `browser/page.css` says the same."""
BORDERS = 8.0
"""px of both panels' borders."""
LEAST_PLOTS, LEAST_CONTROLS = 320.0, 340.0
"""px below which figures cannot be read, and the stages' buttons not be pressed."""
PHONE = 576.0
"""px: viser puts all panels into one sheet, up to here."""
LINE_HEIGHT = 56.0
"""px of the time-line over the 3-D picture."""

STORED_AS, THEME_KEPT_AS = "flexgui-window", "flexgui-theme"
"""In the browser's storage: what browser/window.js measures, and the theme that was chosen."""
PATIENCE, CALM = 0.5, 0.3
"""s for an answer, and from the first change of a size to the question."""
LATER, LONG = 1.0, 4.0
"""s until a browser that was too busy for its first answer is asked again, and for that one: a page
that takes a phone for a wide window would hide the arm."""
TRIES = 5
"""Questions of that kind; a browser that has not answered until then writes nothing down."""
NOTICED = 0.005
"""Share by which the picture's shape changes when it counts."""
_ANSWER = re.compile(
    r"(\d{2,5}) (\d{2,5}) (\d{1,5})(?: (light|dark)(?: (light|dark))?)?( gpu)?", re.ASCII
)


@dataclass(frozen=True)
class Window:
    """A browser's window in px; `picture` is the width left for the arm, 0 where not known."""

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
        """Whether it is as narrow as a phone's."""
        return self.width <= PHONE


@dataclass(frozen=True)
class Widths:
    """px of what stands beside the 3-D picture."""

    plots: float
    controls: float

    @property
    def columns(self) -> int:
        """In which the plots stand."""
        return 2 if self.plots >= TWO_COLUMNS else 1


def window_of(text: str | None) -> Window | None:
    """Of what the browser wrote down; None where that makes no sense."""
    found = _ANSWER.fullmatch(text or "")
    if found is None:
        return None
    width, height, picture, system, theme, gpu = found.groups()
    sizes = float(width), float(height), float(picture)
    return Window(*sizes, system == "dark", theme or "", bool(gpu))


def widths(window: Window) -> Widths:
    """Plots and stages give what the arm misses, each in proportion to what it can spare."""
    wanted = max(PLOTS, PLOTS_SHARE * window.width)
    spare_plots, spare_controls = wanted - LEAST_PLOTS, CONTROLS - LEAST_CONTROLS
    missing = wanted + CONTROLS + BORDERS + ARM - window.width
    share = min(max(missing / (spare_plots + spare_controls), 0.0), 1.0)
    return Widths(round(wanted - share * spare_plots), round(CONTROLS - share * spare_controls))


def aspect(window: Window) -> float:
    """Width over height of what the panels leave of the window."""
    if window.phone:
        return window.width / window.height
    shares = widths(window)
    left = window.width - shares.plots - shares.controls - BORDERS
    return (window.picture or left) / window.height


def covered(window: Window) -> float:
    """Share of the picture's height that the time-line lies over, from below."""
    return min(2.0 * LINE_HEIGHT / window.height, 0.5)


Take = Callable[[Window, Widths], None]


class PageLayout:
    """Asks one browser at the start, and again when its picture has changed its shape."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._takers: list[Take] = []
        self._reporting = threading.RLock()
        self._answered, self._tries = False, 0
        self._shape = client.camera.aspect
        self.window = self._reported = Window()
        # Of several questions that wait, by the time at which each is due, the first is asked.
        self._questions = Inbox(
            self._again, lambda waiting, due: waiting or [due],
            lambda waiting: waiting[0] - time.monotonic(),
        )  # fmt: skip
        # Meanwhile the page is built.
        self._first = threading.Thread(target=self._ask, name="window", daemon=True)
        self._first.start()
        client.camera.on_update(self._moved)

    def begin(self, *takers: Take) -> None:
        """Tells them at once, and after each change."""
        self._first.join(2.0 * PATIENCE)
        # It was the whole window's: no panel stood there yet.
        self.window = replace(self.window, picture=0.0)
        self._takers += takers
        self._report()
        if not self._answered:
            self._questions.put(time.monotonic() + LATER)

    def close(self) -> None:
        """Asks and tells nothing more: what would take it will be removed."""
        self._questions.close()
        with self._reporting:
            self._takers.clear()

    async def _moved(self, camera: viser.CameraHandle) -> None:
        """On the event loop, with every turn of the view."""
        if abs(camera.aspect / self._shape - 1.0) >= NOTICED:
            self._questions.put(time.monotonic() + CALM)

    def _again(self, _: list[float]) -> None:
        self._shape = self._client.camera.aspect
        late = not self._answered
        self._ask(LONG if late else PATIENCE)
        if late:  # measured beside panels that still have the widths of a wide window
            self.window = replace(self.window, picture=0.0)
        # An answer that came too late for the beginning counts too.
        if self.window != self._reported:
            self._report()
        self._tries += 1
        if not self._answered and self._tries < TRIES:
            self._questions.put(time.monotonic() + LATER)

    def _ask(self, patience: float = PATIENCE) -> None:
        run_javascript(self._client, asset("window.js"))
        try:
            answer = window_of(self._client.local_storage.get_item(STORED_AS, patience))
        except (RuntimeError, TimeoutError) as error:
            log.debug("Client %d does not report its size: %s", self._client.client_id, error)
            return
        self._answered = answer is not None
        self.window = answer or self.window

    def _report(self) -> None:
        self._reported = self.window
        shares = widths(self.window)
        with self._reporting:
            for take in self._takers:
                take(self.window, shares)


AS_SYSTEM, LIGHT, DARK = "as the system", "light", "dark"
THEMES = (AS_SYSTEM, LIGHT, DARK)


class Theme:
    """Of one browser's page."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self.chosen, self.dark = AS_SYSTEM, False
        self._system_dark = False
        client.gui.configure_theme(show_share_button=False, show_logo=False)
        self.followers: list[Callable[[bool], None]] = []
        """Called with whether the page is dark, when that changes."""

    def fit(self, window: Window, shares: Widths) -> None:
        """As the browser says: how its system is, and what was chosen in it before."""
        self._system_dark = window.system_dark
        if window.theme in (LIGHT, DARK):
            self.chosen = window.theme
        self._apply()

    def choose(self, name: str) -> None:
        """One of `THEMES`; the browser keeps it."""
        self.chosen = name if name in THEMES else AS_SYSTEM
        self._client.local_storage.set_item(THEME_KEPT_AS, self.chosen)
        self._apply()

    def _apply(self) -> None:
        dark = self._system_dark if self.chosen == AS_SYSTEM else self.chosen == DARK
        if dark == self.dark:
            return
        self.dark = dark
        self._client.gui.configure_theme(dark_mode=dark, show_share_button=False, show_logo=False)
        for follower in self.followers:
            follower(dark)
