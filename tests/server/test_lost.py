"""The browser of these tests takes no lost connection for something that is slow."""

from __future__ import annotations

import time

import pytest

from tests.server.conftest import MakePlace, Place
from tests.server.helpers import PATIENCE, Browser, LostError
from tests.server.served import sees

LONG = 10.0 * PATIENCE
"""s that nobody waits."""


def test_who_waits_hears_of_the_end_of_the_server_at_once(make_place: MakePlace) -> None:
    place = make_place()
    with Browser(place.server) as browser:
        place.page(browser)
        place.server.close()
        begin = time.monotonic()
        with pytest.raises(LostError, match="ended the connection after"):
            sees(browser, "words that nobody says", LONG)
        assert time.monotonic() - begin < LONG / 2.0


def test_what_came_before_the_end_is_heard(place: Place) -> None:
    with Browser(place.server) as browser:
        place.page(browser).widgets["text"].value = "the last words"
        time.sleep(0.5)  # it lies in the socket and nobody has read it
        place.server.close()
        browser.until(lambda: "the last words" in str(browser.heard))
        with pytest.raises(LostError):
            sees(browser, "words that nobody says", LONG)
