"""Words that give access: a class's join code, the teacher's token."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
from collections import OrderedDict, deque
from collections.abc import Callable

from core.errors import InputError
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

    def fits(self, said: str) -> bool:
        """Compared in the same time however much of it is right."""
        return hmac.compare_digest(_plain(said).encode("utf-8", "replace"), self._plain)

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
