"""What `flexgui serve` was asked for, checked together, what it says in the terminal, and a free
port, bound before anything starts."""

from __future__ import annotations

import errno
import io
import ipaddress
import os
import secrets
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from flexgui.core.errors import InputError
from flexgui.server.access import CODE, TEACHER
from flexgui.server.entry import Word, checked_code, lan_address, new_code, origin_of

EVERYWHERE = ("0.0.0.0", "::")


@dataclass(frozen=True)
class ServeOptions:
    """As they stand on the command line."""

    host: str | None = None
    port: int = 8080
    data: Path | None = None
    scenario: Path | None = None
    demo: bool = False
    lan: bool = False
    join_code: str | None = None
    origins: tuple[str, ...] = ()
    workers: int = 2
    browser: bool = True

    def check(self) -> None:
        """InputError where two of them do not go together."""
        if not self.lan and self.join_code is not None:
            raise InputError("--join-code goes with --lan, which opens the page to the network.")
        if not self.lan and not is_loopback(self.address):
            raise InputError(
                f"--host {self.host} would open the page to the network; add --lan if you want "
                "that (everybody then needs a join code)."
            )
        if not 0 <= self.port <= 65535:
            raise InputError(f"--port {self.port} is no port; choose one from 1024 to 65535.")
        if not 1 <= self.workers <= 64:
            raise InputError(f"--workers {self.workers} is out of range; choose 1 to 64.")
        if self.data is not None and not self.data.is_dir():
            raise InputError(f"--data {self.data} is no folder.")

    @property
    def address(self) -> str:
        """Where to listen."""
        if self.host is not None:
            return self.host
        return EVERYWHERE[0] if self.lan else "127.0.0.1"

    def join_word(self) -> Word | None:
        """The class's code; None where the page stays on this machine."""
        if not self.lan:
            return None
        return Word(new_code() if self.join_code is None else checked_code(self.join_code))

    def teacher_word(self) -> Word | None:
        """The teacher's token; None where everybody is their own teacher."""
        return Word(secrets.token_hex(12)) if self.demo and self.lan else None

    def more_origins(self, port: int) -> tuple[str, ...]:
        """Besides this machine's own: the network's address first."""
        named = tuple(origin_of(url) for url in self.origins)
        return (*self._lan_origins(port), *named)

    def _lan_origins(self, port: int) -> tuple[str, ...]:
        if not self.lan:
            return ()
        name = lan_address() if self.address in EVERYWHERE else self.address
        if name is None or is_loopback(name):
            return ()
        bracketed = f"[{name}]" if ":" in name else name
        return (origin_of(f"http://{bracketed}:{port}"),)


WAITING = 100
"""Connections that may wait for the server to be ready."""

_BUSY = {errno.EADDRINUSE} | ({errno.EACCES} if os.name == "nt" else set())


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def bind(host: str, port: int, tries: int) -> socket.socket:
    """Listens on the port, or on the next one that is free; InputError where there is none."""
    last = min(port + tries - 1, 65535) if port else 0
    for candidate in range(port, last + 1):
        try:
            return _bound_socket(host, candidate)
        except OSError as error:
            if error.errno not in _BUSY:
                raise InputError(_sentence(host, candidate, error)) from error
    raise InputError(f"The ports {port} to {last} are all busy; choose another with --port.")


def port_of(listener: socket.socket) -> int:
    """The number that it got."""
    return int(listener.getsockname()[1])


def own_name(listener: socket.socket) -> str:
    """The host of an address that a browser on this machine can use."""
    host = ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
    if host.is_unspecified:
        return "127.0.0.1"
    return f"[{host}]" if host.version == 6 else str(host)


def _bound_socket(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, port), family=family, backlog=WAITING)


def _sentence(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EACCES:
        return f"Port {port} is reserved for the system; choose one above 1023 with --port."
    return f"The address {host} does not belong to this machine ({error}); check --host."


def qr_text(address: str) -> str:
    """A QR code of half blocks, light on dark, for a terminal that can show them."""
    import segno

    out = io.StringIO()
    segno.make(address, error="m", micro=False).terminal(out, compact=True, border=2)
    return out.getvalue().rstrip("\n")


PrintLine = Callable[[str], None]


def teacher_address(home: str, join: Word | None, teacher: Word | None) -> str:
    """What the own browser opens."""
    if teacher is not None:
        return f"{home}?{TEACHER}={quote(teacher.word)}"
    return home if join is None else f"{home}?{CODE}={quote(join.word)}"


def greet_alone(home: str, print_line: PrintLine) -> None:
    """The page stays on this machine."""
    print_line(f"FlexGUI: {home}   (Ctrl-C ends it)")


def greet_class(
    home: str, more: tuple[str, ...], origins: tuple[str, ...], words: tuple[Word, Word | None],
    print_line: PrintLine,
) -> None:  # fmt: skip
    """What is open, to whom, and how to come in."""
    join, teacher = words
    for_class = f"{more[0]}/?{CODE}={quote(join.word)}" if more else ""
    if for_class:
        print_line(f"FlexGUI for the class: {for_class}   (Ctrl-C ends it)")
        if sys.stdout.isatty():
            print_line(qr_text(for_class))
    else:
        print_line("No network was found: the page can be reached from this machine only.")
    print_line(f"Join code: {join.word}")
    print_line("Open: to everybody in this network who has the code, without encryption (http).")
    print_line("Pages that may connect: " + ", ".join(origins))
    print_line(f"Your own: {teacher_address(home, join, teacher)}")
