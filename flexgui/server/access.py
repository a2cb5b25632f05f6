"""Who gets a page, and who may open a websocket: decided before viser is asked. The page itself is
viser's client behind a curtain that says what is coming.

viser's own client shows an empty panel, its scene tree and an empty picture until the server has
built the page. The curtain covers these, in the colours of the system's theme or of the one that
was chosen, and is lifted by `flexgui.page.in_browser`.
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
    from flexgui.classroom.tickets import Tickets

log = logging.getLogger(__name__)

PLOTLY = "/plotly.js"
ALIVE = "/alive"
"""What the page asks for while it is open; answered without a word."""
HARMLESS = {
    "darkMode", "hideViserLogo", "showStats", "fixedDpr", "logCamera", "forceOrbitOriginTool",
    "initialCameraPosition", "initialCameraLookAt", "initialCameraUp", "stage",
}  # fmt: skip
"""Of what viser's client reads from its address; `websocket` and `playbackPath` would let a link
make our page run another server's scripts."""

SAFE_HEADERS = {
    # No foreign page may put ours into a frame and let people click in it.
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}


class AccessHandler:
    """Given to websockets as `process_request`; runs on the event loop."""

    def __init__(
        self, origins: tuple[str, ...], limits: Limits, tickets: Tickets | None = None
    ) -> None:
        """`tickets` asks a class for its code; without it everybody on this machine gets in."""
        self.origins = frozenset(origins)
        self.open = False
        self.busy: Callable[[], int] = lambda: 0
        """How many websockets there are."""
        self._hosts, self._limits, self._tickets = hosts_of(origins), limits, tickets

    def __call__(self, connection: ServerConnection, request: Request) -> Response | None:
        """None lets a websocket in; everything else is an answer to a page."""
        if not self.open:
            return text(HTTPStatus.SERVICE_UNAVAILABLE, "FlexGUI is starting or ending.")
        remote = connection.remote_address
        address = str(remote[0]) if remote else "?"
        host = only(request.headers, "Host")
        if host is None or host.lower() not in self._hosts:
            return _no("a foreign Host", address, "This server has another name.")
        if any("websocket" in v.lower() for v in request.headers.get_all("Upgrade")):
            return self._websocket(address, request)
        return self._page(address, request)

    def is_teacher(self, request: Request | None) -> bool:
        """Whether the connection brought the teacher's ticket."""
        return (
            self._tickets is not None and request is not None and self._tickets.is_teacher(request)
        )

    def _websocket(self, address: str, request: Request) -> Response | None:
        if only(request.headers, "Origin") not in self.origins:
            return _no("a foreign Origin", address, "Foreign pages may not connect.")
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
        shut = tickets is not None and not tickets.has_ticket(request)
        if parts.path == ALIVE:
            return text(HTTPStatus.UNAUTHORIZED if shut else HTTPStatus.OK, "")
        zipped = any("gzip" in v for v in request.headers.get_all("Accept-Encoding"))
        if parts.path == PLOTLY:
            return plotly_js(zipped)
        if parts.path not in ("/", "/index.html"):
            return text(HTTPStatus.NOT_FOUND, "There is one page only: /")
        query = parse_qs(parts.query, keep_blank_values=True).keys()
        if tickets is not None and tickets.names & query:
            return tickets.welcome(address, request)
        if not query <= HARMLESS:
            return redirect(Headers())
        if tickets is not None and shut:
            return tickets.ask(address, request)
        return client_page(zipped)


def _no(why: str, address: str, sentence: str) -> Response:
    log.info("Refused %s from %s", why, address)
    return text(HTTPStatus.FORBIDDEN, sentence)


def text(status: HTTPStatus, sentence: str) -> Response:
    """One line."""
    return answer(status, f"{sentence}\n".encode(), Headers(), "text/plain")


def redirect(headers: Headers) -> Response:
    """To the page, without anything in its address."""
    headers["Location"] = "/"
    return answer(HTTPStatus.SEE_OTHER, b"", headers, "text/plain")


def answer(status: HTTPStatus, body: bytes, headers: Headers, kind: str = "text/html") -> Response:
    """Framed by nobody, kept by nobody."""
    for name, value in SAFE_HEADERS.items():
        if name not in headers:
            headers[name] = value
    headers["Content-Type"] = f"{kind}; charset=utf-8"
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)


def only(headers: Headers, name: str) -> str | None:
    """The header, where there is exactly one: proxies disagree on which of two counts."""
    found = headers.get_all(name)
    return found[0] if len(found) == 1 else None


LONGEST = 150_000
"""ms after which the curtain goes from a page whose stages stand: longer than a first start
compiles. An empty page stays covered, and its curtain says so."""
SLOW = (
    "This takes longer than usual. The page comes by itself; if it does not, look for a message "
    "where FlexGUI was started."
)
SOON = 4_000
"""ms that the first picture may take once the page says that it is drawn."""


@cache
def plotly_js(zipped: bool) -> Response:
    """The library of the plots. Its address changes with its text: browsers may keep it, and what
    they have compiled of it."""
    script, headers = plotly_script().encode(), Headers()
    headers["Cache-Control"] = "public, max-age=31536000, immutable"
    if zipped:
        script = gzip.compress(script, 6)
        headers["Content-Encoding"] = "gzip"
    return answer(HTTPStatus.OK, script, headers, "text/javascript")


@cache
def client_page(zipped: bool) -> Response:
    """viser's client, which is one file, behind our curtain."""
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    page = behind_curtain(path.read_bytes())
    headers = Headers()
    if zipped:
        page = gzip.compress(page, 6)
        headers["Content-Encoding"] = "gzip"
    return answer(HTTPStatus.OK, page, headers)


def behind_curtain(page: bytes) -> bytes:
    """viser's client with our title, and the curtain as the first thing of its body."""
    steps = "".join(f"<li>{step}</li>" for step in (CONNECTING, PREPARING, BUILDING, DRAWING))
    version = hashlib.sha256(plotly_script().encode()).hexdigest()[:16]
    curtain = Template(asset("curtain.html")).substitute(
        purpose=html.escape(PURPOSE), steps=steps, theme=THEME_KEPT_AS, longest=LONGEST, soon=SOON,
        slow=json.dumps(SLOW), plots=f"{PLOTLY}?{version}",
    )  # fmt: skip
    page = page.replace(b"<title>Viser</title>", b"<title>FlexGUI</title>")
    return page.replace(b"<body>", b"<body>" + curtain.encode(), 1)
