"""Who comes in."""

from __future__ import annotations

import hashlib
import re
import time
from dataclasses import replace
from urllib.request import urlopen

import pytest
from websockets.exceptions import InvalidStatus

from flexgui.core.errors import InputError
from flexgui.page.in_browser import plotly_script
from flexgui.server.options import origin_of
from flexgui.server.tickets import LETTERS, Tickets, checked_code, new_code
from tests.server.conftest import SMALL, MakePlace, Place
from tests.server.helpers import Browser, get

CODE = "K7QM-2XWP"


def status_of(browser: Browser) -> int:
    with pytest.raises(InvalidStatus) as refused, browser:
        pass
    return int(refused.value.response.status_code)


ORIGINS = "null", "https://evil.example", "http://127.0.0.1:1", "http://localhost", "http://lan:80"


def test_a_foreign_missing_or_second_origin_is_refused(place: Place) -> None:
    for origin in ("", *ORIGINS):
        assert status_of(Browser(place.server, origin=origin)) == 403, origin
    assert status_of(Browser(place.server, headers={"Origin": ORIGINS[1]})) == 403


def test_the_own_names_of_this_machine_are_accepted(place: Place) -> None:
    for name in ("127.0.0.1", "localhost", "[::1]"):
        with Browser(place.server, origin=f"http://{name}:{place.server.port}") as browser:
            place.page(browser)


def test_a_listed_origin_is_accepted(make_place: MakePlace) -> None:
    place = make_place(origins=(origin_of("https://Lab.example.org:443/"),))
    with Browser(place.server, origin="https://lab.example.org") as browser:
        place.page(browser)


def test_a_name_that_points_here_by_trickery_gets_no_page(place: Place) -> None:
    assert get(place.server, "/", Host=f"evil.example:{place.server.port}").status == 403


def test_only_the_client_is_served_and_nobody_may_frame_it(place: Place) -> None:
    page = get(place.server, "/")
    assert (page.status, page.getheader("X-Frame-Options")) == (200, "DENY")
    for path in ("/../viser/_viser.py", "/%2e%2e/x", "/assets", "/favicon.ico", "//x"):
        assert get(place.server, path).status == 404


def test_the_library_of_the_plots_is_kept_by_browsers_and_named_by_its_content(
    place: Place,
) -> None:
    server = f"http://127.0.0.1:{place.server.port}"
    with urlopen(f"{server}/") as response:
        page = response.read().decode()
    (address,) = re.findall(r'script\.src = "(/plotly\.js\?\w+)"', page)
    with urlopen(f"{server}{address}") as response:
        script, headers = response.read(), response.headers
    assert script.decode() == plotly_script()
    assert headers.get_all("Cache-Control") == ["public, max-age=31536000, immutable"]
    assert address.endswith(hashlib.sha256(script).hexdigest()[:16])


def test_an_address_cannot_point_the_page_at_another_server(place: Place) -> None:
    for query in ("websocket=ws://evil.example", "playbackPath=http://evil.example/x", "a=b"):
        response = get(place.server, f"/?{query}")
        assert (response.status, response.getheader("Location")) == (303, "/")
    assert get(place.server, "/?darkMode").status == 200


def test_a_class_needs_the_code(make_place: MakePlace) -> None:
    place = make_place(tickets=Tickets(CODE))
    assert get(place.server, "/").status == 403
    assert status_of(Browser(place.server)) == 403
    assert status_of(Browser(place.server, path="/?code=WRONG-ONE")) == 403
    assert status_of(Browser(place.server, headers={"Cookie": "flexgui_code_1=x"})) == 403


def test_the_code_in_the_address_becomes_a_ticket(make_place: MakePlace) -> None:
    place = make_place(tickets=Tickets(CODE))
    response = get(place.server, f"/?code={CODE.lower().replace('-', '')}")
    assert (response.status, response.getheader("Location")) == (303, "/")
    cookie = (response.getheader("Set-Cookie") or "").partition(";")
    assert "HttpOnly" in cookie[2] and CODE not in cookie[0]
    assert get(place.server, "/", Cookie=cookie[0]).status == 200
    with Browser(place.server, headers={"Cookie": cookie[0]}) as browser:
        place.page(browser)
    for _ in range(30):  # an old code of one who is in is harmless
        response = get(place.server, "/?code=OLD1-CODE", Cookie=cookie[0])
        assert (response.status, response.getheader("Location")) == (303, "/")


def test_who_guesses_is_told_to_wait_and_a_right_code_opens_all_the_same(
    make_place: MakePlace,
) -> None:
    place = make_place(tickets=Tickets(CODE))
    for _ in range(9):
        assert get(place.server, "/?code=AAAA-AAAA").status == 403
    assert get(place.server, "/?code=AAAA-AAAA").status == 429
    assert status_of(Browser(place.server, path="/?code=AAAA-AAAA")) == 429
    assert get(place.server, f"/?code={CODE}").status == 303
    with Browser(place.server, path=f"/?code={CODE}") as browser:
        place.page(browser)
    place.clock.now += 61.0
    assert get(place.server, "/?code=AAAA-AAAA").status == 403


def test_a_page_without_a_code_is_no_guess(make_place: MakePlace) -> None:
    place = make_place(tickets=Tickets(CODE))
    for _ in range(30):
        get(place.server, "/")
        status_of(Browser(place.server))
    assert get(place.server, f"/?code={CODE}").status == 303


def test_a_new_code_is_easy_to_read_and_never_the_same() -> None:
    codes = {new_code() for _ in range(100)}
    assert len(codes) == 100
    assert all(set(code) <= set(LETTERS) | {"-"} for code in codes)


def test_an_old_code_in_the_address_is_harmless_where_none_is_asked_for(place: Place) -> None:
    for _ in range(30):
        for query in ("code=K7QM-2XWP", "teacher=x", "code=&code=x"):
            response = get(place.server, f"/?{query}")
            assert (response.status, response.getheader("Location")) == (303, "/")
    assert get(place.server, "/").status == 200


@pytest.mark.parametrize("code", ["", "abc", "-----------", "abcde!", "AB-12-CD", "äöüäöü"])
def test_a_code_that_is_easy_to_guess_is_not_taken(code: str) -> None:
    with pytest.raises(InputError, match="--join-code"):
        checked_code(code)


def test_a_full_server_says_so(make_place: MakePlace) -> None:
    place = make_place(replace(SMALL, connections=1))
    with Browser(place.server) as browser:
        place.page(browser)
        assert status_of(Browser(place.server)) == 503


def test_a_flood_is_slowed_down_and_harms_nobody(place: Place) -> None:
    with Browser(place.server) as loud, Browser(place.server) as quiet:
        place.page(loud)
        shown = place.page(quiet)
        for _ in range(3000):
            loud.send_raw(b"\xc1")
        start = time.monotonic()
        place.set(quiet, "slider", 2.0)
        quiet.until(lambda: shown.session.values.get("slider") == 2.0)
        assert time.monotonic() - start < 2.0
