"""Decides who gets a page and who may open a websocket, before viser handles the request.

The page is viser's client behind a curtain: viser's own client shows an empty panel, its scene tree
and an empty picture until the server has built the page. The curtain has the colours of the
system's or the chosen theme, and `flexgui.page.in_browser` removes it.
"""

from __future__ import annotations

import gzip
import hashlib
import html
import json
import logging
from collections.abc import Callable
from functools import cache
from http import HTTPStatus
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

import viser
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from flexgui.page.in_browser import (
    BUILDING,
    CONNECTING,
    DRAWING,
    PREPARING,
    PURPOSE,
    asset,
    plotly_script,
)
from flexgui.page.layout import THEME_KEPT_AS
from flexgui.server.options import hosts_of
from flexgui.server.services import Limits

if TYPE_CHECKING:
    from flexgui.server.tickets import Tickets

log = logging.getLogger(__name__)

PLOTLY = "/plotly.js"
ALIVE = "/alive"
"""The page requests this while it is open, to see whether the server runs; the reply is empty."""
ALLOWED_PARAMETERS = {
    "darkMode", "hideViserLogo", "showStats", "fixedDpr", "logCamera", "forceOrbitOriginTool",
    "initialCameraPosition", "initialCameraLookAt", "initialCameraUp", "stage",
}  # fmt: skip
"""Parameters of the address that viser's client may read. `websocket` and `playbackPath` are not
among them: a link could make our page run another server's scripts."""

SAFE_HEADERS = {
    # No foreign page may put ours into a frame and let people click in it.
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}


class AccessHandler:
    """The `process_request` of websockets; runs on the event loop."""

    def __init__(
        self, origins: tuple[str, ...], limits: Limits, tickets: Tickets | None = None
    ) -> None:
        """`tickets` requires the join code of a class; without it this machine's browsers enter."""
        self.origins = frozenset(origins)
        self.open = False
        self.busy: Callable[[], int] = lambda: 0
        """Returns the number of open websockets."""
        self._hosts, self._limits, self._tickets = hosts_of(origins), limits, tickets

    def __call__(self, connection: ServerConnection, request: Request) -> Response | None:
        """None accepts a websocket; any other value is the HTTP response."""
        if not self.open:
            return text(HTTPStatus.SERVICE_UNAVAILABLE, "FlexGUI is starting or ending.")
        remote = connection.remote_address
        address = str(remote[0]) if remote else "?"
        host = single_header(request.headers, "Host")
        if host is None or host.lower() not in self._hosts:
            return _refused_response("a foreign Host", address, "This server has another name.")
        if any("websocket" in v.lower() for v in request.headers.get_all("Upgrade")):
            return self._websocket(address, request)
        return self._page(address, request)

    def is_teacher(self, request: Request | None) -> bool:
        """Whether the request has the teacher's ticket."""
        return (
            self._tickets is not None and request is not None and self._tickets.is_teacher(request)
        )

    def _websocket(self, address: str, request: Request) -> Response | None:
        if single_header(request.headers, "Origin") not in self.origins:
            return _refused_response("a foreign Origin", address, "Foreign pages may not connect.")
        tickets = self._tickets
        if (
            tickets is not None
            and not tickets.has_ticket(request)
            and not tickets.right_words(request)
        ):
            return tickets.ask(address, request)
        if self.busy() >= self._limits.connections:
            return text(HTTPStatus.SERVICE_UNAVAILABLE, "FlexGUI is full.")
        return None

    def _page(self, address: str, request: Request) -> Response:
        tickets, parts = self._tickets, urlsplit(request.path)
        needs_code = tickets is not None and not tickets.has_ticket(request)
        if parts.path == ALIVE:
            return text(HTTPStatus.UNAUTHORIZED if needs_code else HTTPStatus.OK, "")
        zipped = any("gzip" in v for v in request.headers.get_all("Accept-Encoding"))
        if parts.path == PLOTLY:
            return plotly_js(zipped)
        if parts.path not in ("/", "/index.html"):
            return text(HTTPStatus.NOT_FOUND, "There is one page only: /")
        query = parse_qs(parts.query, keep_blank_values=True).keys()
        if tickets is not None and tickets.names & query:
            return tickets.welcome(address, request)
        if not query <= ALLOWED_PARAMETERS:
            return redirect_response(Headers())
        if tickets is not None and needs_code:
            return tickets.ask(address, request)
        return client_page(zipped)


def _refused_response(reason: str, address: str, sentence: str) -> Response:
    log.info("Refused %s from %s", reason, address)
    return text(HTTPStatus.FORBIDDEN, sentence)


def text(status: HTTPStatus, sentence: str) -> Response:
    """A response of one line of plain text."""
    return answer(status, f"{sentence}\n".encode(), Headers(), "text/plain")


def redirect_response(headers: Headers) -> Response:
    """A redirect to the page's address without parameters."""
    headers["Location"] = "/"
    return answer(HTTPStatus.SEE_OTHER, b"", headers, "text/plain")


def answer(status: HTTPStatus, body: bytes, headers: Headers, kind: str = "text/html") -> Response:
    """An HTTP response that forbids framing and caching."""
    for name, value in SAFE_HEADERS.items():
        if name not in headers:
            headers[name] = value
    headers["Content-Type"] = f"{kind}; charset=utf-8"
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)


def single_header(headers: Headers, name: str) -> str | None:
    """The header's value if there is exactly one: proxies disagree on which of two counts."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else None


LONGEST_CURTAIN = 150_000
"""ms after which the curtain is removed from a page whose stages are shown: longer than the first
compilation. An empty page stays covered, with the sentence below."""
SLOW = (
    "This takes longer than usual. The page opens by itself. If it does not, read the messages in "
    "the terminal where FlexGUI was started."
)
SOON = 4_000
"""ms to wait for the first figure after the server has drawn the page."""


@cache
def plotly_js(zipped: bool) -> Response:
    """plotly.js. Its address changes with its text, so that browsers may cache it."""
    script, headers = plotly_script().encode(), Headers()
    headers["Cache-Control"] = "public, max-age=31536000, immutable"
    if zipped:
        script = gzip.compress(script, 6)
        headers["Content-Encoding"] = "gzip"
    return answer(HTTPStatus.OK, script, headers, "text/javascript")


@cache
def client_page(zipped: bool) -> Response:
    """viser's client, which is one file, with our curtain."""
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    page = behind_curtain(path.read_bytes())
    headers = Headers()
    if zipped:
        page = gzip.compress(page, 6)
        headers["Content-Encoding"] = "gzip"
    return answer(HTTPStatus.OK, page, headers)


def behind_curtain(page: bytes) -> bytes:
    """viser's client with our title and the curtain first in its body."""
    steps = "".join(f"<li>{step}</li>" for step in (CONNECTING, PREPARING, BUILDING, DRAWING))
    version = hashlib.sha256(plotly_script().encode()).hexdigest()[:16]
    curtain = Template(asset("curtain.html")).substitute(
        purpose=html.escape(PURPOSE), steps=steps, theme=THEME_KEPT_AS, longest=LONGEST_CURTAIN,
        soon=SOON, slow=json.dumps(SLOW), plots=f"{PLOTLY}?{version}",
    )  # fmt: skip
    first = f"<body>{curtain}<script>{asset('labels.js')}</script>"
    page = page.replace(b"<title>Viser</title>", b"<title>FlexGUI</title>")
    return page.replace(b"<body>", first.encode(), 1)
