"""What the first page needs, made while the browser still loads its own part."""

from __future__ import annotations

import contextlib
import gc
import logging
import threading

from core.errors import InputError
from flexgui.jobs import JobPool


def warm_up(pool: JobPool, log: logging.Logger) -> threading.Thread:
    """In the background; the workers start last, since they would take the first page's time."""

    def run() -> None:
        try:
            _load()
        except Exception:
            log.exception("Warming up failed; the first page does it")
        with contextlib.suppress(InputError):  # it has been closed meanwhile
            pool.start()

    thread = threading.Thread(target=run, name="flexgui-warming", daemon=True)
    thread.start()
    return thread


def _load() -> None:
    import flexgui.page  # noqa: F401  (two seconds of imports)
    from flexgui.session.demo import demo_scenario
    from flexgui.session.live import live_model, prepare
    from flexgui.session.state import Live

    live_model(prepare(demo_scenario(), None), Live())
    # Modules and equations stay for ever: the collector need not look at them every time.
    gc.collect()
    gc.freeze()
