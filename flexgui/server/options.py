"""The options of `flexgui serve`, checked together, and the addresses that it uses."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from flexgui.core.errors import InputError

EVERYWHERE = ("0.0.0.0", "::")


@dataclass(frozen=True)
class ServeOptions:
    """The options as given on the command line."""

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
        """InputError for an invalid option or two that exclude each other."""
        if not self.lan and self.join_code is not None:
            raise InputError("--join-code needs --lan, which opens the page to the network.")
        if not self.lan and not is_loopback(self.address):
            raise InputError(
                f"--host {self.host} opens the page to the network. Add --lan to allow that; "
                "everybody then needs a join code."
            )
        if not 0 <= self.port <= 65535:
            raise InputError(f"--port {self.port} is not a port; choose one from 1024 to 65535.")
        if not 1 <= self.workers <= 64:
            raise InputError(f"--workers {self.workers} is out of range; choose 1 to 64.")
        if self.data is not None and not self.data.is_dir():
            raise InputError(f"--data {self.data} is not a folder; give that of the recordings.")

    @property
    def address(self) -> str:
        """The address to listen on."""
        if self.host is not None:
            return self.host
        return EVERYWHERE[0] if self.lan else "127.0.0.1"

    def network_origins(self, port: int) -> tuple[str, ...]:
        """Origins besides this machine's own: the network address first."""
        named = tuple(origin_of(url) for url in self.origins)
        name = lan_address() if self.address in EVERYWHERE else self.address
        if not self.lan or name is None or is_loopback(name):
            return named
        return (_http_origin(name, port), *named)


LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")

_TEST_ADDRESS = ("192.0.2.1", 9)
"""An address for documentation; connecting a UDP socket to it sends nothing."""

_DEFAULT_PORTS = {"http": 80, "https": 443}


def origin_of(url: str) -> str:
    """`scheme://host[:port]` as a browser writes it; InputError for another text."""
    try:
        parts = urlsplit(url.strip())
        host, port = parts.hostname, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), None, None
    if parts.scheme not in _DEFAULT_PORTS or not host or parts.path.strip("/"):
        raise InputError(f"--origin {url} is not an origin; write it like https://lab.example.org.")
    plain = port is None or port == _DEFAULT_PORTS[parts.scheme]
    return f"{parts.scheme}://{_bracketed(host)}{'' if plain else f':{port}'}"


def _http_origin(name: str, port: int) -> str:
    return origin_of(f"http://{_bracketed(name)}:{port}")


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def loopback_origins(port: int) -> tuple[str, ...]:
    """The origins of pages on this machine."""
    return tuple(_http_origin(name, port) for name in LOOPBACK_NAMES)


def hosts_of(origins: Iterable[str]) -> frozenset[str]:
    """The `Host` headers of the origins."""
    return frozenset(urlsplit(origin).netloc.lower() for origin in origins)


def lan_address() -> str | None:
    """This machine's address in the local network; None without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_TEST_ADDRESS)
            own_address = str(probe.getsockname()[0])
        except OSError:
            return None
    return None if is_loopback(own_address) else own_address


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def address_group(address: str) -> str:
    """The address; under IPv6 the /64 network that a single machine may own."""
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    mapped = getattr(parsed, "ipv4_mapped", None)
    if parsed.version == 4 or mapped is not None:
        return str(mapped or parsed)
    return str(ipaddress.ip_network((parsed, 64), strict=False))


WAITING = 100
"""Connections that may wait for the server to be ready."""

_BUSY = {errno.EADDRINUSE} | ({errno.EACCES} if os.name == "nt" else set())


def bind(host: str, port: int, tries: int) -> socket.socket:
    """A socket that listens on the port or on the next free one; InputError without one."""
    last = min(port + tries - 1, 65535) if port else 0
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port, last + 1):
        try:
            return socket.create_server((host, candidate), family=family, backlog=WAITING)
        except OSError as error:
            if error.errno not in _BUSY:
                raise InputError(_sentence(host, candidate, error)) from None
    raise InputError(f"Ports {port} to {last} are all busy; choose another with --port.")


def _sentence(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EACCES:
        return f"Port {port} is reserved for the system; choose one above 1023 with --port."
    return f"The address {host} does not belong to this machine ({error}); check --host."


def port_of(listener: socket.socket) -> int:
    """The port number of a socket."""
    return int(listener.getsockname()[1])


def host_name(listener: socket.socket) -> str:
    """The socket's host, as a browser on this machine can use it."""
    host = ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
    return "127.0.0.1" if host.is_unspecified else _bracketed(str(host))
