"""Words that open the door: a class's join code, the teacher's token."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections import OrderedDict
from collections.abc import Callable

from core.errors import InputError
from flexgui.server.limits import Limits

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
"""Without those that look alike."""
LENGTH = 8
"""31^8 codes; at 200 guesses a minute half of them take 4000 years."""
SHORTEST = 6
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
    """A secret word, and the ticket that a browser gets for it."""

    def __init__(self, word: str) -> None:
        self.word = word
        self._plain = _plain(word).encode()
        # Of the word alone: who was in stays in when the server is started again.
        self.ticket = hmac.new(self._plain, b"flexgui ticket", hashlib.sha256).hexdigest()

    def fits(self, said: str) -> bool:
        """Compared in the same time however much of it is right."""
        return hmac.compare_digest(_plain(said).encode("utf-8", "replace"), self._plain)

    def admits(self, ticket: str) -> bool:
        """Whether it is the ticket."""
        return hmac.compare_digest(ticket.encode("utf-8", "replace"), self.ticket.encode())


class Attempts:
    """Counts wrong words per address and in all."""

    def __init__(self, limits: Limits, clock: Callable[[], float]) -> None:
        self._limits, self._clock = limits, clock
        self._wrong: OrderedDict[str, list[float]] = OrderedDict()
        self._all: list[float] = []

    def too_many(self, address: str) -> bool:
        """Whether nobody is to try from there at the moment."""
        self._all = self._recent(self._all)
        mine = self._recent(self._wrong.get(address, []))
        return (
            len(mine) >= self._limits.wrong_codes
            or len(self._all) >= self._limits.wrong_codes_in_all
        )

    def wrong(self, address: str) -> None:
        """One more."""
        now = self._clock()
        self._all.append(now)
        self._wrong[address] = [*self._recent(self._wrong.get(address, [])), now]
        self._wrong.move_to_end(address)
        while len(self._wrong) > ADDRESSES:
            self._wrong.popitem(last=False)

    def _recent(self, times: list[float]) -> list[float]:
        now = self._clock()
        return [time for time in times if now - time < MINUTE]
