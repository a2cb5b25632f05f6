"""Which pages may speak to the server, and under which names it answers."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Iterable
from urllib.parse import urlsplit

from core.errors import InputError

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
