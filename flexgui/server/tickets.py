"""How a class comes in (`flexgui serve --lan`): the join code and the teacher's token, the tickets
that browsers get for them, and what stands in the terminal."""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import html
import io
import logging
import os
import secrets
import sys
from collections import OrderedDict, deque
from collections.abc import Callable
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from time import monotonic
from urllib.parse import parse_qs, quote, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from flexgui.core.errors import InputError
from flexgui.page.in_browser import asset
from flexgui.server.access import answer, redirect_response, single_header
from flexgui.server.options import address_group
from flexgui.server.services import Limits
from flexgui.server.work_folders import private_folder, state_folder

log = logging.getLogger(__name__)

CODE, TEACHER = "code", "teacher"
"""Names in the address: `/?code=K7QM-2XWP`."""

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
"""Without those that look alike."""
LENGTH = 8
"""31^8 codes: a right one always opens, so their number is what keeps guessers out. At the thousand
a second that a server can answer, half of them take thirteen years. A chosen code is as long."""


def new_code() -> str:
    """Easy to read out: `K7QM-2XWP`."""
    letters = "".join(secrets.choice(LETTERS) for _ in range(LENGTH))
    return f"{letters[:4]}-{letters[4:]}"


def checked_code(code: str) -> str:
    """A code that somebody chose; InputError where it is too easy to guess."""
    plain = _plain(code)
    if len(plain) < LENGTH or not plain.isascii() or not plain.isalnum():
        raise InputError(
            f"--join-code needs at least {LENGTH} letters and digits (hyphens do not count)."
        )
    return code.strip()


def _plain(code: str) -> str:
    return code.replace("-", "").replace(" ", "").upper()


MINUTE = 60.0
ADDRESSES = 10_000
"""Of which wrong tries are remembered."""
TICKET_DAYS = 0.5
"""A day of lessons."""
WHICH = "Which class do you want to join?"
WRONG = "Wrong code. Look at the board."
TOO_MANY = "Too many wrong codes from here. The right code is on the board; it always opens."


class Tickets:
    """Admits requests with a right code or token in the address, or with a ticket."""

    names = frozenset({CODE, TEACHER})

    def __init__(
        self, code: str | None = None, token: str | None = None, limits: Limits | None = None
    ) -> None:
        """A new code where none was chosen; `token` where there is a teacher."""
        self.words = {CODE: new_code() if code is None else checked_code(code)}
        if token is not None:
            self.words[TEACHER] = token
        key = server_key()
        # Nobody who guesses words can compute a ticket: the server's key is in it.
        self._given = {
            name: hmac.new(key, b"flexgui ticket " + _plain(word).encode(), hashlib.sha256)
            for name, word in self.words.items()
        }
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()
        self._most = (limits or Limits()).wrong_codes

    def is_teacher(self, request: Request) -> bool:
        """Whether the request has the teacher's ticket."""
        return self._brought(request, TEACHER)

    def has_ticket(self, request: Request) -> bool:
        """Whether the request has a ticket."""
        return any(self._brought(request, name) for name in self.words)

    def right_words(self, request: Request) -> list[str]:
        """Names of the right codes in the address."""
        query = parse_qs(urlsplit(request.path).query)
        return [
            name
            for name, word in self.words.items()
            if len(values := query.get(name, [])) == 1 and _same(_plain(values[0]), _plain(word))
        ]

    def welcome(self, address: str, request: Request) -> Response:
        """A page with a word in its address; a right one opens, however many were wrong before.

        It gives the ticket, and the address without the word, which then stays in no history.
        """
        right = self.right_words(request)
        if not right and not self.has_ticket(request):
            return self.ask(address, request)
        headers = Headers()
        for name in right:
            headers["Set-Cookie"] = (
                f"{_cookie(request, name)}={self._given[name].hexdigest()}; Path=/; HttpOnly; "
                f"SameSite=Lax; Max-Age={int(TICKET_DAYS * 86400)}"
            )
        return redirect_response(headers)

    def ask(self, address: str, request: Request) -> Response:
        """Asks for the code. Words and tickets that are wrong are guesses, none at all is none."""
        has_query, cookies = "?" in request.path, _cookies(request)
        guess = has_query or any(_cookie(request, name) in cookies for name in self.names)
        if guess and self._too_many(address):
            return _form(HTTPStatus.TOO_MANY_REQUESTS, TOO_MANY)
        return _form(HTTPStatus.FORBIDDEN, WRONG if has_query else WHICH)

    def own_address(self, home: str) -> str:
        """Address with the code, for the browser on this machine."""
        name = TEACHER if TEACHER in self.words else CODE
        return f"{home}?{name}={quote(self.words[name])}"

    def greet(
        self,
        home: str,
        more: tuple[str, ...],
        origins: tuple[str, ...],
        print_line: Callable[[str], None],
    ) -> None:
        """Prints addresses and codes."""
        if more:
            for_class = f"{more[0]}/?{CODE}={quote(self.words[CODE])}"
            print_line(f"FlexGUI for the class: {for_class}   (Ctrl-C ends it)")
            if sys.stdout.isatty():
                print_line(qr_text(for_class))
        else:
            print_line("No network found: only this machine can open the page.")
        print_line(f"Join code: {self.words[CODE]}")
        print_line("Open to everybody in this network who has the code; not encrypted (http).")
        print_line("Pages that may connect: " + ", ".join(origins))
        print_line(f"Your own: {self.own_address(home)}")

    def _too_many(self, address: str) -> bool:
        """One more wrong word or ticket; whether so many came from there within a minute that who
        brings it has to wait."""
        place = address_group(address)
        times = self._wrong.setdefault(place, deque(maxlen=self._most))
        before = self._within_a_minute(times)
        times.append(monotonic())
        self._wrong.move_to_end(place)
        while len(self._wrong) > ADDRESSES:
            self._wrong.popitem(last=False)
        after = self._within_a_minute(times)
        if after and not before:
            log.warning("Many wrong codes from %s; a right one opens all the same.", address)
        return after

    def _within_a_minute(self, times: deque[float]) -> bool:
        return len(times) == self._most and monotonic() - times[0] < MINUTE

    def _brought(self, request: Request, name: str) -> bool:
        brought = _cookies(request).get(_cookie(request, name))
        ticket = self._given.get(name)
        return brought is not None and ticket is not None and _same(brought, ticket.hexdigest())


def _same(text: str, other: str) -> bool:
    """Compares in constant time."""
    return hmac.compare_digest(text.encode("utf-8", "replace"), other.encode())


def _form(status: HTTPStatus, sentence: str) -> Response:
    page = asset("join.html").replace("{sentence}", html.escape(sentence))
    return answer(status, page.encode(), Headers())


def _cookie(request: Request, name: str) -> str:
    """Name of the cookie; it holds the port, as all ports of a host share cookies."""
    port = (single_header(request.headers, "Host") or "").rpartition(":")[2]
    return f"flexgui_{name}_{port if port.isdigit() else 'web'}"


def _cookies(request: Request) -> dict[str, str]:
    cookies: SimpleCookie = SimpleCookie()
    for header in request.headers.get_all("Cookie"):
        with contextlib.suppress(CookieError):
            cookies.load(header)
    return {name: morsel.value for name, morsel in cookies.items()}


KEY_FILE, KEY_BYTES = "server.key", 32


def server_key() -> bytes:
    """Random, and the same at the next start: who was in with a code that still holds stays in.

    Where nothing can be kept, a fresh one.
    """
    fresh = secrets.token_bytes(KEY_BYTES)
    with contextlib.suppress(OSError):
        path = private_folder(state_folder()) / KEY_FILE
        with contextlib.suppress(FileExistsError):
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(fresh)
        key = path.read_bytes()
        if len(key) == KEY_BYTES:
            return key
        path.unlink()  # cut short by a crash: the next start makes it again
    return fresh


def qr_text(address: str) -> str:
    """A QR code of half blocks, light on dark, for a terminal that can show them."""
    import segno

    out = io.StringIO()
    segno.make(address, error="m", micro=False).terminal(out, compact=True, border=2)
    return out.getvalue().rstrip("\n")
