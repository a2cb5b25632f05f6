"""What the first page needs, made while the browser still loads its own part."""

from __future__ import annotations

import contextlib
import gc
import logging
import threading

import viser

from core.errors import InputError
from flexgui.jobs import JobPool
from flexgui.panels.in_browser import BUILDING, show_progress
from flexgui.server.options import PrintLine

PREPARING = "Preparing for this machine, once: up to a minute."
READY = "Ready."
LONGEST = 120.0
"""s that a page waits; then it compiles for itself what it needs."""


class Warming:
    """In the background; the workers start last, since they would take the first page's time.

    On a machine where nothing was compiled yet, who comes meanwhile reads what is waited for.
    """

    def __init__(self, pool: JobPool, log: logging.Logger, print_line: PrintLine) -> None:
        self._pool, self._log, self._show = pool, log, print_line
        self._compiled = threading.Event()
        self._compiled.set()

    def start(self) -> threading.Thread:
        """Returns at once."""
        thread = threading.Thread(target=self._run, name="flexgui-warming", daemon=True)
        thread.start()
        return thread

    def receive(self, client: viser.ClientHandle) -> None:
        """Tells a browser that its page will take a while, where it will."""
        if not self._compiled.is_set():
            show_progress(client, f"{PREPARING} The page comes by itself.")

    def wait(self) -> None:
        """A page that compiles at the same time would do the same work once more."""
        self._compiled.wait(LONGEST)

    def admit(self, client: viser.ClientHandle) -> None:
        """Its page is being built."""
        show_progress(client, BUILDING)

    def _run(self) -> None:
        try:
            self._compile()
            _load()
        except Exception:
            self._log.exception("Warming up failed; the first page does it")
        with contextlib.suppress(InputError):  # it has been closed meanwhile
            self._pool.start()

    def _compile(self) -> None:
        from core.progress import Silent
        from core.warm import is_warm, warm_up

        if is_warm():
            return
        self._compiled.clear()
        self._show(PREPARING)
        try:
            warm_up(Silent())
        finally:
            self._compiled.set()
        self._show(READY)


def _load() -> None:
    import flexgui.page  # noqa: F401  (two seconds of imports)
    from flexgui.session.demo import demo_scenario
    from flexgui.session.live import live_model, prepare
    from flexgui.session.state import Live

    live_model(prepare(demo_scenario(), None), Live())
    # Modules and equations stay for ever: the collector need not look at them every time.
    gc.collect()
    gc.freeze()
