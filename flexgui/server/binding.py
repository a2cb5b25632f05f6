"""A free port, bound before anything else starts."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket

from core.errors import InputError

WAITING = 100
"""Connections that may wait for the server to be ready."""

_BUSY = {errno.EADDRINUSE} | ({errno.EACCES} if os.name == "nt" else set())


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def bind(host: str, port: int, tries: int) -> socket.socket:
    """Listens on the port, or on the next one that is free; InputError where there is none."""
    last = min(port + tries - 1, 65535) if port else 0
    for candidate in range(port, last + 1):
        try:
            return _bound_socket(host, candidate)
        except OSError as error:
            if error.errno not in _BUSY:
                raise InputError(_sentence(host, candidate, error)) from error
    raise InputError(f"The ports {port} to {last} are all busy; choose another with --port.")


def port_of(listener: socket.socket) -> int:
    """The number that it got."""
    return int(listener.getsockname()[1])


def own_name(listener: socket.socket) -> str:
    """The host of an address that a browser on this machine can use."""
    host = ipaddress.ip_address(listener.getsockname()[0].partition("%")[0])
    if host.is_unspecified:
        return "127.0.0.1"
    return f"[{host}]" if host.version == 6 else str(host)


def _bound_socket(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, port), family=family, backlog=WAITING)


def _sentence(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EACCES:
        return f"Port {port} is reserved for the system; choose one above 1023 with --port."
    return f"The address {host} does not belong to this machine ({error}); check --host."
