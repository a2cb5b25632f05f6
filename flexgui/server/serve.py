"""`flexgui serve`: everything put together, until Ctrl-C, and then a clean end.

What is heavy to import is imported by the functions that need it: the address stands in the
terminal a second earlier, and the browser loads meanwhile.
"""

from __future__ import annotations

import contextlib
import ctypes
import logging
import os
import secrets
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from flexgui.jobs import JobPool
from flexgui.plain_words import INTERNAL, print_error
from flexgui.server.app import PageServer, Settings
from flexgui.server.options import ServeOptions, bind, port_of
from flexgui.server.services import Limits, Services
from flexgui.server.sessions import KeptWork, state_folder
from flexgui.server.warming import Warming

if TYPE_CHECKING:
    from flexgui.classroom.tickets import Tickets
    from flexgui.session.session import Session

log = logging.getLogger("flexgui")


def can_open() -> bool:
    """Whether there is a screen; a browser in a text terminal would be in the way."""
    if os.environ.get("CI") or os.environ.get("SSH_CONNECTION"):
        return False
    if sys.platform.startswith(("win", "darwin")):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_soon(address: str) -> None:
    """Without waiting for it."""
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


SWITCH = 5e-4
"""s that a thread may keep the interpreter while others want it: Python's own 5 ms are as long as
a whole answer, and the thread that talks to all browsers asks for it several times per answer."""

ARENAS, MAPPED, TRIMMED = (-8, 2), (-3, 2**18), (-1, 2**20)
"""Parameters of glibc's malloc (number in malloc.h, value): how many heaps threads have, from how
many bytes on a block is a mapping of its own, and how many free bytes stay at the end of a heap.
Each page is sent megabytes. By default, glibc takes ever more threads' heaps and larger blocks
for them and gives nothing back: 100 pages that came and went left 130 MB, with these 3 MB."""


def serve(options: ServeOptions, print_line: Callable[[str], None]) -> None:
    """Blocks until Ctrl-C; InputError where it cannot begin."""
    options.check()
    sys.setswitchinterval(SWITCH)
    _return_memory()
    _log_to_terminal()
    limits, pool = Limits(), JobPool(options.workers)
    services = Services(pool, options.data, limits.upload_bytes)
    make_session = _session_maker(options.scenario, services, print_line)
    listener = bind(options.address, options.port, limits.ports)
    port = port_of(listener)
    if options.port not in (0, port):
        print_line(f"Port {options.port} is busy; FlexGUI takes {port}.")
    tickets, more = tickets_of(options), options.more_origins(port)
    warming = Warming(pool, print_line)
    settings = Settings(
        make_session=make_session,
        warming=warming,
        origins=more,
        tickets=tickets,
        demo=options.demo,
        kept=_kept_work(),
        limits=limits,
    )
    with until_asked() as asked:
        server = PageServer(listener, settings)
        try:
            warming.start()
            if tickets is None:
                print_line(f"FlexGUI: {server.address}   (Ctrl-C ends it)")
            else:
                tickets.greet(server.address, more, server.origins, print_line)
            if options.browser and can_open():
                open_soon(
                    server.address if tickets is None else tickets.own_address(server.address)
                )
            while not asked.wait(POLL):
                pass
        finally:
            end_in_any_case()
            # At the same time: each may take seconds, and both together must not.
            workers = threading.Thread(target=pool.close, name="flexgui-closing")
            workers.start()
            server.close()
            workers.join()
    print_line("FlexGUI has ended.")


def tickets_of(options: ServeOptions) -> Tickets | None:
    """Asks a class for its code; None where the page stays on this machine."""
    if not options.lan:
        return None
    from flexgui.classroom.tickets import Tickets

    return Tickets(options.join_code, secrets.token_hex(12) if options.demo else None)


def _return_memory() -> None:
    """Memory of pages that left goes back to the system, where its C library can be told to."""
    with contextlib.suppress(OSError, AttributeError):
        set_option = ctypes.CDLL(None).mallopt
        for parameter in (ARENAS, MAPPED, TRIMMED):
            set_option(*parameter)


def _session_maker(
    scenario: Path | None, services: Services, print_line: Callable[[str], None]
) -> Callable[[str, Path], Session]:
    """The scenario is read before anything is opened, so that its errors end the command."""
    given, beside, data = None, Path(), services.data_folder
    if scenario is not None:
        from flexgui.core.scenario.data_folder import outside
        from flexgui.core.scenario.read import read_scenario

        given, beside = read_scenario(scenario), scenario.resolve().parent
        if far := outside(given, beside, data):
            print_line(far)

    def make(key: str, folder: Path) -> Session:
        from flexgui.session.session import Session
        from flexgui.stages.data.uploads import fetch_files

        session = Session(key, folder, services)
        if given is not None:
            session.open(fetch_files(given, beside, data, folder))
        session.store.begin()
        return session

    return make


def _kept_work() -> KeptWork | None:
    try:
        return KeptWork(state_folder() / "sessions")
    except OSError as error:
        log.warning("Work is not kept beyond the end of this server: %s", error)
        return None


def _log_to_terminal() -> None:
    if not log.handlers:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        log.addHandler(handler)
        log.setLevel(logging.WARNING)
        log.propagate = False


HARD_END = 4.5
"""s after Ctrl-C; a callback that hangs would otherwise hold the process for ever."""
POLL = 0.5
"""s; on Windows a wait without end hears no Ctrl-C."""

SIGNALS = [s for name in ("SIGINT", "SIGTERM", "SIGHUP") if (s := getattr(signal, name, None))]


@contextmanager
def until_asked() -> Iterator[threading.Event]:
    """An event that is set by Ctrl-C and its relatives; a second one ends everything at once."""
    asked = threading.Event()

    def hear(number: int, frame: FrameType | None) -> None:
        if asked.is_set():
            os._exit(130)
        asked.set()

    before = {number: signal.signal(number, hear) for number in SIGNALS}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_in_any_case(seconds: float = HARD_END) -> None:
    """A clean end is sooner; threads that do not end are left behind, which is said."""

    def end() -> None:
        print_error(f"something did not end within {seconds:g} s and was cut off.")
        sys.stdout.flush()
        os._exit(INTERNAL)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
