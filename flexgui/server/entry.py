"""Words that give access, a class's join code and the teacher's token, and the pages that may speak
to the server."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
import socket
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable
from urllib.parse import urlsplit

from flexgui.core.errors import InputError
from flexgui.server.limits import Limits

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
"""Without those that look alike."""
LENGTH = 8
"""31^8 codes: a right one always opens, so their number is what keeps guessers out. At the thousand
a second that a server can answer, half of them take thirteen years."""
SHORTEST = 8
"""For the same reason."""
MINUTE = 60.0
ADDRESSES = 10_000
"""Of which wrong tries are remembered."""


def new_code() -> str:
    """Easy to read out: `K7QM-2XWP`."""
    letters = "".join(secrets.choice(LETTERS) for _ in range(LENGTH))
    return f"{letters[:4]}-{letters[4:]}"


def checked_code(code: str) -> str:
    """A code that somebody chose; InputError where it is too easy to guess."""
    plain = _plain(code)
    if len(plain) < SHORTEST or not plain.isascii() or not plain.isalnum():
        raise InputError(
            f"--join-code needs at least {SHORTEST} letters and digits (hyphens do not count)."
        )
    return code.strip()


def _plain(code: str) -> str:
    return code.replace("-", "").replace(" ", "").upper()


class Word:
    """A secret word that gives access."""

    def __init__(self, word: str) -> None:
        self.word = word
        self._plain = _plain(word).encode()

    def fits(self, given: str) -> bool:
        """Compared in the same time however much of it is right."""
        return hmac.compare_digest(_plain(given).encode("utf-8", "replace"), self._plain)

    def ticket(self, key: bytes) -> str:
        """What a browser gets for the word. Nobody who guesses words can compute it: the server's
        key is in it."""
        return hmac.new(key, b"flexgui ticket " + self._plain, hashlib.sha256).hexdigest()


def same(ticket: str, other: str) -> bool:
    """Compared in the same time however much of it is the same."""
    return hmac.compare_digest(ticket.encode("utf-8", "replace"), other.encode())


class Attempts:
    """Counts wrong words and wrong tickets per address."""

    def __init__(self, limits: Limits, clock: Callable[[], float]) -> None:
        self._most, self._clock = limits.wrong_codes, clock
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()

    def too_many(self, address: str) -> bool:
        """Whether so many came from there within a minute that the next is told to wait."""
        times = self._wrong.get(neighbours(address), deque[float]())
        return len(times) == self._most and self._clock() - times[0] < MINUTE

    def wrong(self, address: str) -> bool:
        """One more; whether it is the first of too many."""
        before = self.too_many(address)
        times = self._wrong.setdefault(neighbours(address), deque(maxlen=self._most))
        times.append(self._clock())
        self._wrong.move_to_end(neighbours(address))
        while len(self._wrong) > ADDRESSES:
            self._wrong.popitem(last=False)
        return not before and self.too_many(address)


def neighbours(address: str) -> str:
    """The address, or the /64 network that one machine may have to itself under IPv6."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    mapped = getattr(found, "ipv4_mapped", None)
    if found.version == 4 or mapped is not None:
        return str(mapped or found)
    return str(ipaddress.ip_network((found, 64), strict=False))


LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")

_NOWHERE = ("192.0.2.1", 9)
"""An address for documentation; asking for the way there sends nothing."""

_DEFAULT_PORTS = {"http": 80, "https": 443}


def origin_of(url: str) -> str:
    """`scheme://host[:port]` as a browser writes it; InputError where the text is no such thing."""
    try:
        parts = urlsplit(url.strip())
        host, port = parts.hostname, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), None, None
    if parts.scheme not in _DEFAULT_PORTS or not host or parts.path.strip("/"):
        raise InputError(f"--origin {url} is no origin; write it like https://lab.example.org.")
    name = f"[{host}]" if ":" in host else host
    plain = port is None or port == _DEFAULT_PORTS[parts.scheme]
    return f"{parts.scheme}://{name}" if plain else f"{parts.scheme}://{name}:{port}"


def loopback_origins(port: int) -> tuple[str, ...]:
    """Of a page on this machine."""
    return tuple(origin_of(f"http://{name}:{port}") for name in LOOPBACK_NAMES)


def lan_address() -> str | None:
    """This machine's address in its network; None without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
            found = str(probe.getsockname()[0])
        except OSError:
            return None
    return None if ipaddress.ip_address(found).is_loopback else found


def hosts_of(origins: Iterable[str]) -> frozenset[str]:
    """The `Host` headers that go with the origins."""
    return frozenset(urlsplit(origin).netloc.lower() for origin in origins)
