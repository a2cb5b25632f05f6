"""What `flexgui serve` was asked for, checked together."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError
from flexgui.server.binding import is_loopback
from flexgui.server.entry import Word, checked_code, new_code
from flexgui.server.origins import lan_address, origin_of

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
