"""Guessers, from one address and from many, beside people who know the code."""

from __future__ import annotations

import hashlib
import hmac
import itertools
import secrets
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from flexgui.server import tickets
from flexgui.server.access import AccessHandler
from flexgui.server.options import address_group
from flexgui.server.services import Limits
from flexgui.server.tickets import CODE, KEY_FILE, TEACHER, Tickets, new_code, server_key
from flexgui.server.work_folders import STATE_VARIABLE
from tests.server.helpers import FakeClock

PORT = 8080
GUESSES = 2_000
JOIN, TEACHERS = "K7QM-2XWP", "t0ken"


@pytest.fixture(autouse=True)
def _key(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(STATE_VARIABLE, str(tmp_path))


def made() -> AccessHandler:
    found = AccessHandler((f"http://127.0.0.1:{PORT}",), Limits(), Tickets(JOIN, TEACHERS))
    found.open = True
    return found


@pytest.fixture
def access(monkeypatch: pytest.MonkeyPatch) -> AccessHandler:
    monkeypatch.setattr(tickets, "monotonic", FakeClock())
    return made()


def asked(
    access: AccessHandler, address: str, path: str = "/", cookie: str = "", *, socket: bool = False
) -> Response | None:
    """What the handler answers; None where it lets a websocket in."""
    headers = Headers({"Host": f"127.0.0.1:{PORT}"})
    if cookie:
        headers["Cookie"] = cookie
    if socket:
        headers["Upgrade"], headers["Origin"] = "websocket", f"http://127.0.0.1:{PORT}"
    connection: Any = SimpleNamespace(remote_address=(address, 50_000))
    return access(cast(ServerConnection, connection), Request(path, headers))


def is_in(answer: Response | None) -> bool:
    return answer is None or answer.status_code in (200, 303)


def cookies() -> Iterator[str]:
    """Random ones, and those that the code alone would give: of every code that is tried."""
    for k in itertools.count():
        code = new_code().replace("-", "")
        forged = hmac.new(code.encode(), b"flexgui ticket", hashlib.sha256).hexdigest()
        ticket = forged if k % 2 else secrets.token_hex(32)
        yield f"flexgui_{(CODE, TEACHER)[k // 2 % 2]}_{PORT}={ticket}"


@pytest.mark.parametrize("addresses", [1, 20])
def test_no_guesser_comes_in_and_nobody_who_knows_the_code_is_kept_out(
    access: AccessHandler, addresses: int
) -> None:
    guessers = [f"192.0.2.{k + 1}" for k in range(addresses)]
    brought = cookies()
    for k in range(GUESSES // 2):
        address = guessers[k % addresses]
        wrong = {"path": f"/?{(CODE, TEACHER)[k % 2]}={new_code()}"}
        assert not is_in(asked(access, address, **wrong, socket=k % 3 == 0))
        assert not is_in(asked(access, address, cookie=next(brought), socket=k % 3 == 0))
        if k % 200 == 199:
            for who in (guessers[0], guessers[-1], "198.51.100.1"):
                knows_the_words(access, who)
    assert cast(Response, asked(access, guessers[0], f"/?{CODE}=AAAA-AAAA")).status_code == 429


def knows_the_words(access: AccessHandler, address: str) -> None:
    """The code or the token, and then the ticket, open page and websocket."""
    for name, word in ((CODE, JOIN), (TEACHER, TEACHERS)):
        welcome = asked(access, address, f"/?{name}={word}")
        assert welcome is not None and welcome.status_code == 303
        cookie = welcome.headers["Set-Cookie"].partition(";")[0]
        assert is_in(asked(access, address, cookie=cookie))
        assert asked(access, address, cookie=cookie, socket=True) is None
        assert asked(access, address, f"/?{name}={word}", socket=True) is None


def test_the_ticket_of_the_code_alone_no_longer_opens(access: AccessHandler) -> None:
    plain = JOIN.replace("-", "").encode()
    forged = hmac.new(plain, b"flexgui ticket", hashlib.sha256).hexdigest()
    assert not is_in(asked(access, "192.0.2.1", cookie=f"flexgui_{CODE}_{PORT}={forged}"))


def test_a_ticket_holds_over_a_restart_and_not_at_another_server(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    welcome = asked(made(), "192.0.2.1", f"/?{CODE}={JOIN}")
    assert welcome is not None
    cookie = welcome.headers["Set-Cookie"].partition(";")[0]
    assert is_in(asked(made(), "192.0.2.1", cookie=cookie))
    monkeypatch.setenv(STATE_VARIABLE, str(tmp_path / "another"))
    assert not is_in(asked(made(), "192.0.2.1", cookie=cookie))


def test_wrong_tickets_count_as_guesses(access: AccessHandler) -> None:
    last = None
    for _, cookie in zip(range(Limits.wrong_codes), cookies(), strict=False):
        last = asked(access, "192.0.2.1", cookie=cookie)
    assert last is not None and last.status_code == 429


def test_machines_are_told_apart_by_what_they_may_have_to_themselves() -> None:
    assert (
        address_group("2001:db8::1")
        == address_group("2001:db8::ffff:2")
        != address_group("2001:db9::1")
    )
    assert (
        address_group("::ffff:192.0.2.1")
        == address_group("192.0.2.1")
        != address_group("192.0.2.2")
    )


def test_the_key_is_random_and_stays_and_is_nobody_elses(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = []
    for name in ("one", "two"):
        monkeypatch.setenv(STATE_VARIABLE, str(tmp_path / name))
        keys.append(server_key())
        assert server_key() == keys[-1]
        assert (tmp_path / name).stat().st_mode & 0o777 == 0o700
        assert (tmp_path / name / KEY_FILE).stat().st_mode & 0o777 == 0o600
    assert len(set(keys)) == 2


def test_without_a_folder_the_key_is_fresh(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv(STATE_VARIABLE, str(tmp_path / "file" / "below"))
    assert len(server_key()) == 32 and server_key() != server_key()
