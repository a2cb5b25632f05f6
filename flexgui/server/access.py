"""Who gets a page, and who may open a websocket: decided before viser is asked."""

from __future__ import annotations

import gzip
import html
import http
import logging
import time
from collections.abc import Callable
from functools import cache
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import viser
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from flexgui.server.entry import Attempts, Word, hosts_of, same
from flexgui.server.front import ALIVE, behind_curtain
from flexgui.server.limits import Limits

log = logging.getLogger(__name__)

CODE, TEACHER = "code", "teacher"
"""Names in the address: `/?code=K7QM-2XWP`."""

HARMLESS = {
    "darkMode", "hideViserLogo", "showStats", "fixedDpr", "logCamera", "forceOrbitOriginTool",
    "initialCameraPosition", "initialCameraLookAt", "initialCameraUp",
}  # fmt: skip
"""Of what viser's client reads from its address; `websocket` and `playbackPath` would let a link
make our page run another server's scripts."""

TICKET_DAYS = 0.5
"""A day of lessons."""
TITLE = "FlexGUI"
SAFE_HEADERS = {
    # No foreign page may put ours into a frame and let people click in it.
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}

ASK = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>FlexGUI</title>
<style>body{{font:1.1rem system-ui,sans-serif;max-width:24rem;margin:20vh auto;padding:0 1rem}}
input,button{{font:inherit;padding:.5rem;box-sizing:border-box;width:100%;margin:.4rem 0}}
:root{{color-scheme:light dark}}</style>
<h1>FlexGUI</h1><p>{sentence}</p>
<form method="get" action="/"><label>Join code
<input name="code" autofocus autocomplete="off" autocapitalize="characters" maxlength="64"></label>
<button>Join</button></form></html>"""


WHICH = "Which class do you want to join?"
WRONG = "That code is not right; look at the board."
TOO_MANY = "Many wrong codes came from here. The right one is on the board; it opens at any time."


class AccessHandler:
    """Given to websockets as `process_request`; runs on the event loop."""

    def __init__(
        self,
        origins: tuple[str, ...],
        limits: Limits,
        *,
        join: Word | None = None,
        teacher: Word | None = None,
        key: bytes = b"",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.origins = frozenset(origins)
        self.open = False
        self.busy: Callable[[], int] = lambda: 0
        """How many websockets there are."""
        self._hosts = hosts_of(origins)
        self._limits, self._words = limits, {CODE: join, TEACHER: teacher}
        self._tickets = {n: w.ticket(key) for n, w in self._words.items() if w is not None}
        self._attempts = Attempts(limits, clock)

    def __call__(self, connection: ServerConnection, request: Request) -> Response | None:
        """None lets a websocket in; everything else is an answer to a page."""
        if not self.open:
            return _text(http.HTTPStatus.SERVICE_UNAVAILABLE, "FlexGUI is starting or ending.")
        host = _only(request.headers, "Host")
        if host is None or host.lower() not in self._hosts:
            return self._no("a foreign Host", connection, "This server has another name.")
        if any("websocket" in v.lower() for v in request.headers.get_all("Upgrade")):
            return self._websocket(connection, request)
        return self._page(connection, request)

    def is_teacher(self, request: Request | None) -> bool:
        """Whether the connection brought the teacher's ticket."""
        return request is not None and self._has_ticket(request, TEACHER)

    def _websocket(self, connection: ServerConnection, request: Request) -> Response | None:
        if _only(request.headers, "Origin") not in self.origins:
            return self._no("a foreign Origin", connection, "Foreign pages may not connect.")
        if (
            CODE in self._tickets
            and not self._may_enter(request)
            and not self._right_words(request)
        ):
            return self._not_in(connection, request)
        if self.busy() >= self._limits.connections:
            return _text(http.HTTPStatus.SERVICE_UNAVAILABLE, "FlexGUI is full.")
        return None

    def _page(self, connection: ServerConnection, request: Request) -> Response:
        address = urlsplit(request.path)
        query = parse_qs(address.query, keep_blank_values=True)
        if address.path == ALIVE:
            asks = CODE in self._tickets and not self._may_enter(request)
            return _text(http.HTTPStatus.UNAUTHORIZED if asks else http.HTTPStatus.OK, "")
        if address.path not in ("/", "/index.html"):
            return _text(http.HTTPStatus.NOT_FOUND, "There is one page only: /")
        if self._words.keys() & query.keys():
            return self._word_in_address(connection, request)
        if not query.keys() <= HARMLESS:
            return _redirect(Headers())
        if CODE in self._tickets and not self._may_enter(request):
            return self._not_in(connection, request)
        zipped = any("gzip" in v for v in request.headers.get_all("Accept-Encoding"))
        return client_page(zipped)

    def _may_enter(self, request: Request) -> bool:
        return any(self._has_ticket(request, name) for name in self._tickets)

    def _has_ticket(self, request: Request, name: str) -> bool:
        brought = _cookies(request).get(self._cookie(request, name))
        return brought is not None and name in self._tickets and same(brought, self._tickets[name])

    def _right_words(self, request: Request) -> list[str]:
        """The names of the words in the address that are right."""
        query = parse_qs(urlsplit(request.path).query)
        return [
            name
            for name, word in self._words.items()
            if word is not None and len(given := query.get(name, [])) == 1 and word.fits(given[0])
        ]

    def _word_in_address(self, connection: ServerConnection, request: Request) -> Response:
        """A page with a word in its address; a right one opens, however many were wrong before."""
        if self._right_words(request):
            return self._welcome(request)
        if CODE not in self._tickets or self._may_enter(request):
            return _redirect(Headers())  # an old address, of a server that asks for nothing here
        return self._not_in(connection, request)

    def _not_in(self, connection: ServerConnection, request: Request) -> Response:
        """Asks for the code. Words and tickets that are wrong are guesses, none at all is none."""
        address, guess = _address(connection), self._guessed(request)
        if guess and self._attempts.wrong(address):
            log.warning("Many wrong codes from %s; a right one opens all the same.", address)
        if guess and self._attempts.too_many(address):
            return _ask(http.HTTPStatus.TOO_MANY_REQUESTS, TOO_MANY)
        return _ask(http.HTTPStatus.FORBIDDEN, WRONG if "?" in request.path else WHICH)

    def _guessed(self, request: Request) -> bool:
        cookies = _cookies(request).keys()
        return "?" in request.path or any(self._cookie(request, n) in cookies for n in self._words)

    def _welcome(self, request: Request) -> Response:
        """The ticket, and the address without the word: it stays in no history."""
        headers = Headers()
        for name in self._right_words(request):
            headers["Set-Cookie"] = (
                f"{self._cookie(request, name)}={self._tickets[name]}; Path=/; HttpOnly; "
                f"SameSite=Lax; Max-Age={int(TICKET_DAYS * 86400)}"
            )
        return _redirect(headers)

    @staticmethod
    def _cookie(request: Request, name: str) -> str:
        """Cookies are shared by all ports of a host."""
        port = (_only(request.headers, "Host") or "").rpartition(":")[2]
        return f"flexgui_{name}_{port if port.isdigit() else 'web'}"

    def _no(self, why: str, connection: ServerConnection, sentence: str) -> Response:
        log.info("Refused %s from %s", why, _address(connection))
        return _text(http.HTTPStatus.FORBIDDEN, sentence)


@cache
def client_page(zipped: bool) -> Response:
    """viser's client, which is one file, behind our curtain."""
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    page = behind_curtain(path.read_bytes(), TITLE)
    headers = Headers()
    if zipped:
        page = gzip.compress(page)
        headers["Content-Encoding"] = "gzip"
    return _answer(http.HTTPStatus.OK, page, "text/html; charset=utf-8", headers)


def _ask(status: http.HTTPStatus, sentence: str) -> Response:
    page = ASK.format(sentence=html.escape(sentence)).encode()
    return _answer(status, page, "text/html; charset=utf-8", Headers())


def _text(status: http.HTTPStatus, sentence: str) -> Response:
    return _answer(status, f"{sentence}\n".encode(), "text/plain; charset=utf-8", Headers())


def _redirect(headers: Headers) -> Response:
    headers["Location"] = "/"
    return _answer(http.HTTPStatus.SEE_OTHER, b"", "text/plain; charset=utf-8", headers)


def _answer(status: http.HTTPStatus, body: bytes, kind: str, headers: Headers) -> Response:
    for name, value in SAFE_HEADERS.items():
        headers[name] = value
    headers["Content-Type"] = kind
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)


def _only(headers: Headers, name: str) -> str | None:
    """The header, where there is exactly one: proxies disagree on which of two counts."""
    found = headers.get_all(name)
    return found[0] if len(found) == 1 else None


def _cookies(request: Request) -> dict[str, str]:
    found: SimpleCookie = SimpleCookie()
    for header in request.headers.get_all("Cookie"):
        try:
            found.load(header)
        except CookieError:
            continue
    return {name: morsel.value for name, morsel in found.items()}


def _address(connection: ServerConnection) -> str:
    remote = connection.remote_address
    return str(remote[0]) if remote else "?"
