"""`flexgui serve`: starts all parts of the server, waits for Ctrl-C, and ends them.

Heavy modules are imported by the functions that need them: the address is printed a second earlier,
and the browser loads meanwhile.
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
import time
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
from flexgui.server.tickets import Tickets
from flexgui.server.warming import Warming
from flexgui.server.work_folders import SavedWorkFolders, state_folder

if TYPE_CHECKING:
    from flexgui.session.session import Session

log = logging.getLogger("flexgui")


def has_screen() -> bool:
    """Whether there is a screen to open a browser on."""
    if os.environ.get("CI") or os.environ.get("SSH_CONNECTION"):
        return False
    if sys.platform.startswith(("win", "darwin")):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_browser(address: str) -> None:
    """Opens the address in the browser, without waiting."""
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


SWITCH_INTERVAL = 5e-4
"""s that a thread may keep the interpreter while others wait: Python's default of 5 ms is as long
as a whole reply, and the thread of all browsers needs the interpreter several times per reply."""

ARENAS, MAPPED, TRIMMED = (-8, 2), (-3, 2**18), (-1, 2**20)
"""Parameters of glibc's malloc (number in malloc.h, value): how many heaps threads have, from how
many bytes on a block is a mapping of its own, and how many free bytes stay at the end of a heap.
Each page gets megabytes. With the defaults, glibc keeps more and larger heaps and frees nothing:
100 closed pages left 130 MB, with these values 3 MB."""


def serve(options: ServeOptions, print_line: Callable[[str], None]) -> None:
    """Blocks until Ctrl-C; InputError if the server cannot start."""
    options.check()
    sys.setswitchinterval(SWITCH_INTERVAL)
    _return_memory()
    _log_to_terminal()
    limits, pool = Limits(), JobPool(options.workers)
    services = Services(pool, options.data, limits.upload_bytes)
    make_session = _session_maker(options.scenario, services, print_line)
    listener = bind(options.address, options.port, limits.ports)
    port = port_of(listener)
    if options.port not in (0, port):
        print_line(f"Port {options.port} is busy; FlexGUI uses {port}.")
    tickets, more = tickets_of(options), options.network_origins(port)
    warming = Warming(pool, print_line)
    settings = Settings(
        make_session=make_session,
        warming=warming,
        origins=more,
        tickets=tickets,
        demo=options.demo,
        kept=_saved_folders(),
        limits=limits,
    )
    with stop_on_signal() as stopped:
        server = PageServer(listener, settings)
        try:
            warming.start()
            if tickets is None:
                print_line(f"FlexGUI: {server.address}   (Ctrl-C ends it)")
            else:
                tickets.greet(server.address, more, server.origins, print_line)
            if options.browser and has_screen():
                open_browser(
                    server.address if tickets is None else tickets.own_address(server.address)
                )
            while not stopped(POLL):
                pass
        finally:
            force_exit_after()
            # At the same time: each may take seconds.
            workers = threading.Thread(target=pool.close, name="flexgui-closing")
            workers.start()
            server.close()
            workers.join()
    print_line("FlexGUI has ended.")


def tickets_of(options: ServeOptions) -> Tickets | None:
    """The tickets of a class; None if only this machine may connect."""
    if not options.lan:
        return None
    return Tickets(options.join_code, secrets.token_hex(12) if options.demo else None)


def _return_memory() -> None:
    """Makes the C library return the memory of closed pages to the system (glibc only)."""
    with contextlib.suppress(OSError, AttributeError):
        set_option = ctypes.CDLL(None).mallopt
        for parameter in (ARENAS, MAPPED, TRIMMED):
            set_option(*parameter)


def _session_maker(
    scenario: Path | None, services: Services, print_line: Callable[[str], None]
) -> Callable[[str, Path], Session]:
    """Reads the scenario, or a saved run, at once, so that its errors end the command; returns a
    session's maker."""
    begin = None if scenario is None else beginning(scenario, services.data_folder, print_line)

    def make(key: str, folder: Path) -> Session:
        from flexgui.session.session import Session

        session = Session(key, folder, services)
        if begin is not None:
            begin(session)
        session.store.begin()
        return session

    return make


def beginning(
    path: Path, data: Path | None, print_line: Callable[[str], None]
) -> Callable[[Session], None]:
    """What puts a scenario, or a saved run, into a new session."""
    from flexgui.core.scenario.data_folder import outside
    from flexgui.core.scenario.read import read_scenario
    from flexgui.export.saved_run import read_run
    from flexgui.stages.data.uploads import fetch_files

    run = read_run(path) if path.is_dir() else None
    scenario = read_scenario(path) if run is None else run.scenario
    home, further = (path.resolve().parent, None) if run is None else run.places(path)
    if warning := outside(scenario, home, data or further):
        print_line(warning)

    def begin(session: Session) -> None:
        fetched = fetch_files(scenario, home, data or further, session.folder)
        if run is None:
            session.open(fetched)
        else:
            from flexgui.stages.diagnose.saved_diagnosis import show_run

            show_run(session, fetched, run.outcome)

    return begin


def _saved_folders() -> SavedWorkFolders | None:
    try:
        return SavedWorkFolders(state_folder() / "sessions")
    except OSError as error:
        log.warning("Work cannot be saved on disk; export it before this server stops. %s", error)
        return None


def _log_to_terminal() -> None:
    if not log.handlers:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        log.addHandler(handler)
        log.setLevel(logging.WARNING)
        log.propagate = False


HARD_END = 4.5
"""s after Ctrl-C; a hanging callback would otherwise keep the process for ever."""
POLL = 0.1
"""s at most from Ctrl-C until the end begins."""

SIGNALS = [s for name in ("SIGINT", "SIGTERM", "SIGHUP") if (s := getattr(signal, name, None))]


@contextmanager
def stop_on_signal() -> Iterator[Callable[[float], bool]]:
    """A function that sleeps for so many seconds and returns whether Ctrl-C or another end signal
    has arrived; a second signal ends the process at once.

    A handler runs between any two steps of the main thread, also while that holds the lock of an
    event or a queue that it waits for; to take it again would be to wait for ever. A list has none.
    """
    arrived: list[int] = []

    def handle(number: int, frame: FrameType | None) -> None:
        if arrived:
            os._exit(130)
        arrived.append(number)

    def stopped(seconds: float) -> bool:
        if not arrived:
            time.sleep(seconds)
        return bool(arrived)

    before = {number: signal.signal(number, handle) for number in SIGNALS}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def force_exit_after(seconds: float = HARD_END) -> None:
    """Ends the process with a message after `seconds`, if it has not ended by itself."""

    def end() -> None:
        print_error(f"a task did not end within {seconds:g} s and was stopped.")
        sys.stdout.flush()
        os._exit(INTERNAL)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
