"""Prepares what the first page needs, while the browser still loads."""

from __future__ import annotations

import contextlib
import gc
import logging
import threading
from collections.abc import Callable

import viser

from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.jobs import JobPool
from flexgui.page.in_browser import BUILDING, show_progress

READY = "Ready."
NOTICE = (
    "Compiling for this machine, once",
    "{} of {} parts. Measurements and fits come after it.",
)
log = logging.getLogger(__name__)

FIRST_PAGE_WAIT = 6.0
"""s after which compilers and workers start even if no page was shown."""
LONGEST_WAIT = 120.0
"""s that a page waits for the arm's equations; then it derives them itself."""


class Warming(Silent):
    """Prepares in the background: first what a page shows, then what its jobs need.

    Compilers and workers start after the first page, so that they do not slow it down.
    """

    def __init__(self, pool: JobPool, print_line: Callable[[str], None]) -> None:
        self._pool, self._print_line = pool, print_line
        self._loaded, self._shown = threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._ended = False
        self._parts: tuple[int, int] | None = None
        """Compiled so far, of how many; None while nothing is compiled."""
        self._clients: list[viser.ClientHandle] = []
        """Browsers that wait for the compilers, or may have to."""
        self._notices: list[viser.NotificationHandle] = []

    def start(self) -> threading.Thread:
        """Returns at once."""
        thread = threading.Thread(target=self._run, name="flexgui-warming", daemon=True)
        thread.start()
        return thread

    def wait(self) -> None:
        """Waits until the equations are derived, so that a page does not derive them again."""
        self._loaded.wait(LONGEST_WAIT)

    def page_is_shown(self) -> None:
        """The first page is shown: the workers may start."""
        self._shown.set()

    def add_client(self, client: viser.ClientHandle) -> None:
        """Shows a browser, whose page is being built, the progress of compiling."""
        show_progress(client, BUILDING)
        with self._lock:
            if not self._ended:
                self._clients.append(client)
            if self._parts is not None:
                self._add_notice(client, *self._parts)

    def stage(self, title: str, total: int | None = None) -> None:
        """Compiling starts, with so many parts."""
        with self._lock:
            self._parts = 0, total or 0
            for client in self._clients:
                self._add_notice(client, *self._parts)

    def advance(self, n: int = 1, text: str = "") -> None:
        """So many more parts are compiled."""
        with self._lock:
            done, total = self._parts or (0, 0)
            self._parts = done + n, total
            for notice in self._notices:
                notice.body = NOTICE[1].format(*self._parts)

    def _add_notice(self, client: viser.ClientHandle, done: int, total: int) -> None:
        self._notices.append(
            client.add_notification(
                NOTICE[0], NOTICE[1].format(done, total), loading=True,
                with_close_button=False, auto_close_seconds=None,
            )
        )  # fmt: skip

    def _run(self) -> None:
        _attempt(_load)
        self._loaded.set()
        self._shown.wait(FIRST_PAGE_WAIT)
        _attempt(self._compile)
        with contextlib.suppress(InputError):  # it has been closed meanwhile
            self._pool.start()

    def _compile(self) -> None:
        from flexgui.core.precompile import TITLE, compile_kernels, kernels_compiled

        try:
            if not kernels_compiled():
                self._print_line(f"{TITLE} ...")
                with self._pool.warming:
                    compile_kernels(self)
                self._print_line(READY)
        finally:
            with self._lock:
                self._parts, self._ended = None, True
                self._clients.clear()
                for notice in self._notices:
                    notice.remove()


def _attempt(step: Callable[[], None]) -> None:
    """Nobody waits for ever because a step failed: whoever needs it does it."""
    try:
        step()
    except Exception:
        log.exception("Warming up failed; the first page does it")


def _load() -> None:
    import flexgui.page.page  # noqa: F401  (two seconds of imports)
    from flexgui.library.shipped import demo_scenario
    from flexgui.session.state import LiveSettings
    from flexgui.stages.arm.live import live_model, prepare

    live_model(prepare(demo_scenario(), None), LiveSettings())
    # Modules and equations stay for ever: the garbage collector can skip them.
    gc.collect()
    gc.freeze()
