"""What a raw websocket cannot do."""

from __future__ import annotations

import asyncio
import math
import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from flexgui.server import browser_connection
from flexgui.server.guard import RefusedError, Transfers
from flexgui.server.messages import FileTransferPart, FileTransferStartUpload
from flexgui.server.work_folders import folder_bytes
from tests.server.conftest import SMALL, MakePlace, Place
from tests.server.helpers import CAMERA, SILENCE, Browser, LostError, announcement, part, wait_for

NAN, INF = math.nan, math.inf

BAD = [
    ("slider", NAN), ("slider", INF), ("slider", 999), ("slider", -0.1), ("slider", "2"),
    ("slider", None), ("slider", [1.0]), ("slider", {"a": 1}), ("slider", True),
    ("whole", 11), ("whole", NAN), ("number", -1e-3), ("number", -INF), ("number", b"1"),
    ("check", 1), ("check", "yes"), ("choice", "c"), ("choice", 0), ("choice", ["a"]),
    ("text", 5), ("text", "x" * 20_001), ("text", "\x00"), ("text", None),
    ("vector", [0.0, NAN]), ("vector", [0.0]), ("vector", [0.0, 2.0]), ("vector", 0.5),
    ("colour", [1, 2, 300]), ("colour", [1, 2]), ("range", [0.8, 0.2]), ("range", [0.1]),
    ("button", 7), ("group", "up"), ("off", 2.0), ("upload", "x"),
]  # fmt: skip

GOOD = [
    ("slider", 2, 2.0), ("slider", 3.0000000000000004, 3.0), ("whole", 7, 7),
    ("number", 9.25, 9.25), ("check", True, True), ("choice", "b", "b"), ("text", "θ2\n", "θ2\n"),
    ("vector", [1, -0.5], (1.0, -0.5)), ("colour", [9, 8, 7], (9, 8, 7)),
    ("range", [0.3, 0.4], (0.3, 0.4)), ("button", True, True), ("group", "right", "right"),
]  # fmt: skip


def works(place: Place, browser: Browser) -> bool:
    """The connection still does what it should."""
    session = place.page(browser).session
    place.set(browser, "slider", 0.5)
    return bool(wait_for(lambda: session.values.get("slider") == 0.5))


def test_good_values_and_every_click_arrive(place: Place) -> None:
    clicks: list[int] = []
    with Browser(place.server) as browser:
        shown = place.page(browser)
        shown.widgets["button"].on_click(lambda _: clicks.append(1))
        for name, value, expected in GOOD:
            place.set(browser, name, value)
            wait_for(
                lambda name=name, expected=expected: shown.session.values.get(name) == expected
            )
        for _ in range(19):
            place.set(browser, "button", True)
        wait_for(lambda: len(clicks) == 20)


def test_bad_values_change_nothing_and_kill_nothing(place: Place) -> None:
    with Browser(place.server) as browser:
        shown = place.page(browser)
        before = {name: w.value for name, w in shown.widgets.items() if hasattr(w, "value")}
        for name, value in BAD:
            place.set(browser, name, value)
        assert works(place, browser)
        shown.widgets["slider"].value = before["slider"]
        assert before == {n: w.value for n, w in shown.widgets.items() if hasattr(w, "value")}
        assert set(shown.session.values) == {"slider"}


def test_only_the_value_of_a_widget_can_be_set(place: Place) -> None:
    with Browser(place.server) as browser:
        shown = place.page(browser)
        slider = shown.widgets["slider"]
        place.set(browser, "slider", 2.0, removed=True)
        for updates in ({"removed": True}, {"update_cb": []}, {"props": {}}, {}, {"uuid": "x"}):
            browser.send(
                {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": updates}
            )
        assert works(place, browser)
        assert not slider._impl.removed


@pytest.mark.parametrize(
    "message",
    [
        {"type": "ShareUrlRequest"},
        {"type": "ShareUrlDisconnect"},
        {"type": "GuiFormDirtyMessage", "uuid": "x"},
        {"type": "GuiRemoveMessage", "uuid": "x"},
        {"type": "RunJavascriptMessage", "source": "1"},
        {**CAMERA, "fov": NAN},
        {**CAMERA, "position": "abc"},
        {k: v for k, v in CAMERA.items() if k != "fov"},
        {**CAMERA, "extra": 1},
    ],
    ids=lambda m: str(m["type"]),
)
def test_other_messages_are_passed_over(
    place: Place, message: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[bool] = []
    monkeypatch.setattr(place.server.viser, "request_share_url", lambda: asked.append(True))
    with Browser(place.server) as browser:
        browser.send(message)
        assert works(place, browser)
    assert not asked


def test_an_announced_gigabyte_is_refused_before_it_comes(place: Place) -> None:
    with Browser(place.server) as browser:
        shown = place.page(browser)
        upload = shown.widgets["upload"]._impl.uuid
        start = announcement(upload, 10**9, 2000, "huge.csv")
        browser.send(start)
        browser.until(lambda: browser.notes, "the refusal")
        assert "huge.csv has 1,000 MB" in browser.notes[0] and "100.0 kB" in browser.notes[0]
        browser.send(part(start, 0, b"x" * 1000))
        assert works(place, browser)
        assert not shown.client.gui._current_file_upload_states


def test_a_file_of_the_announced_size_arrives(place: Place) -> None:
    with Browser(place.server) as browser:
        shown = place.page(browser)
        start = announcement(shown.widgets["upload"]._impl.uuid, 6, 1)
        browser.send(start)
        browser.send(part(start, 0, b"t,u\n01"))
        assert wait_for(lambda: shown.session.uploads) == [b"t,u\n01"]


def test_more_bytes_than_announced_are_dropped(place: Place) -> None:
    with Browser(place.server) as browser:
        shown = place.page(browser)
        start = announcement(shown.widgets["upload"]._impl.uuid, 70_000, 2)
        browser.send(start)
        browser.send(part(start, 0, b"x" * 60_000))
        browser.send(part(start, 0, b"x" * 60_000))
        assert works(place, browser)
        assert not shown.client.gui._current_file_upload_states and not shown.session.uploads


def test_the_files_of_a_session_have_a_limit_and_no_loop_waits_for_their_count(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    on_loop: list[bool] = []

    def count(folder: Path) -> int:
        on_loop.append(asyncio._get_running_loop() is not None)
        return folder_bytes(folder)

    monkeypatch.setattr(browser_connection, "folder_bytes", count)
    with Browser(place.server) as browser:
        shown = place.page(browser)
        (shown.session.folder / "kept.csv").write_bytes(b"x" * 100_000)
        browser.send(announcement(shown.widgets["upload"]._impl.uuid, 90_000, 1))
        browser.until(lambda: browser.notes, "the refusal")
        assert "150.0 kB" in browser.notes[0] and on_loop == [False]


@pytest.mark.parametrize("shared", ["upload_memory", "session_bytes"])
def test_windows_share_the_room_of_uploads_until_one_leaves(
    shared: str, make_place: MakePlace
) -> None:
    place = make_place(replace(SMALL, **{"session_bytes": 10**6, shared: 150_000}))
    storage: dict[str, str] = {}
    with Browser(place.server, storage=storage) as other:
        upload = place.page(other).widgets["upload"]._impl.uuid
        other.until(lambda: storage, "the key")
        mine = storage if shared == "session_bytes" else {}
        with Browser(place.server, storage=mine) as first:
            start = announcement(place.page(first).widgets["upload"]._impl.uuid, 90_000, 2)
            first.send(start)
            first.send(part(start, 0, b"x" * 89_999))
            first.await_message("FileTransferPartAck")
            other.send(announcement(upload, 90_000, 2, "second.csv"))
            other.until(lambda: other.notes, "the refusal")
            assert other.notes[0].startswith("second.csv ")
        wait_for(lambda: any(shown.closed for shown in place.pages.all))
        start = announcement(upload, 90_000, 1)
        other.send(start)
        other.send(part(start, 0, b"x" * 90_000))
        wait_for(lambda: place.page(other).session.uploads)


@pytest.mark.parametrize("seed", range(5))
def test_no_order_of_uploads_holds_more_than_a_session_and_the_server_may(seed: int) -> None:
    """Two windows to a session; each upload waits for its last byte, as long as it can."""

    def opened(k: int) -> Any:
        return SimpleNamespace(session=k // 2, uploads={})

    def send(k: int, upload: str, size: int) -> None:
        transfers.part(windows[k], FileTransferPart("", upload, 0, bytes(size)))

    limits, random = replace(SMALL, upload_memory=200_000), Random(seed)
    windows = {k: opened(k) for k in range(4)}
    held: dict[int, dict[str, int]] = {k: {} for k in windows}
    transfers = Transfers(limits, windows)
    for step in range(400):
        k, size = random.randrange(4), random.choice([2, 50_000, 90_000])
        kind = random.choice(["begin", "begin", "begin", "end", "leave"])
        if kind == "leave":
            windows[k], held[k] = opened(k), {}
        elif kind == "end" and held[k]:
            send(k, held[k].popitem()[0], 1)
        elif kind == "begin":
            start = FileTransferStartUpload("", str(step), "a.csv", "", 1, size)
            with suppress(RefusedError):
                transfers.begin(windows[k], start, 0)
                held[k][str(step)] = size - 1
                send(k, str(step), size - 1)
        now = [sum(sizes.values()) for sizes in held.values()]
        assert sum(now) <= limits.upload_memory
        assert max(now[0] + now[1], now[2] + now[3]) <= limits.session_bytes
    windows.update({k: opened(k) for k in windows})
    transfers.begin(windows[0], FileTransferStartUpload("", "last", "a.csv", "", 1, 10**5), 0)


def test_a_callback_that_fails_is_told_and_logged_once(
    place: Place, caplog: pytest.LogCaptureFixture
) -> None:
    with Browser(place.server) as browser:
        for _ in range(2):
            place.set(browser, "text", "explode")
            place.set(browser, "text", "fine")
        browser.until(lambda: len(browser.notes) >= 2, "the notes")
        assert "ValueError" in browser.notes[0] and "\n" not in browser.notes[0]
        assert works(place, browser)
    assert sum("logged once" in r.getMessage() for r in caplog.records) == 1


def test_one_browser_cannot_use_the_widgets_of_another(place: Place) -> None:
    with Browser(place.server) as one, Browser(place.server) as two:
        theirs = place.page(two)
        place.page(one)
        one.set(theirs.widgets["slider"]._impl.uuid, 2.0)
        assert works(place, one)
        assert theirs.widgets["slider"].value == 1.0


def test_a_message_that_is_too_large_ends_its_own_connection_only(make_place: MakePlace) -> None:
    place = make_place(replace(SMALL, message_bytes=10_000))
    with Browser(place.server) as big, Browser(place.server) as other:
        place.page(big)
        big.send_raw(b"x" * 20_000)
        with pytest.raises(LostError, match="too big"):
            big.until(lambda: None, "the end of the connection")
        assert works(place, other)


FRAMES: dict[str, list[bytes | str]] = {
    "nonsense": [
        b"", b"\xc1", b"\x93\x01\x02\x03", "text", b"\x80", b"\x91" * 5000,
        b"\x81\xa4type\xa7Message", b"\x81\xa4type\x01",
    ],
    "no utf-8": [
        b"\x81\xa4type\xa2\xff\xfe", b"\x81\xa2\xff\xfe\xa1a", b"\xa1\xff",
        b"\x91\xa3\xed\xa0\x80", b"\x82\xa4type\xb0GuiUpdateMessage\xa4uuid\xa1\x80",
    ],
    "at random": [bytes([k % 256]) + Random(k).randbytes(k % 23) for k in range(400)],
}  # fmt: skip


@pytest.mark.parametrize("kind", FRAMES)
def test_frames_that_are_no_message_are_refused_without_a_word(
    place: Place, kind: str, caplog: pytest.LogCaptureFixture
) -> None:
    with Browser(place.server) as browser:
        place.page(browser)
        for frame in FRAMES[kind]:
            browser.send_raw(frame)
        assert works(place, browser)
    assert not [r for r in caplog.records if r.levelname in ("WARNING", "ERROR", "CRITICAL")]


def test_a_fast_hand_waits_in_the_queue_once_per_input(place: Place) -> None:
    """The newest position wins before the queue: what lies in between is never computed."""
    begun, go_on, seen = threading.Event(), threading.Event(), list[float]()
    with Browser(place.server) as browser:
        shown = place.page(browser)
        slider, number = shown.widgets["slider"], shown.widgets["number"]

        @slider.on_update
        def _(event: Any) -> None:
            begun.set()
            go_on.wait(5.0)
            seen.append(event.target.value)

        number.on_update(lambda event: seen.append(-event.target.value))
        place.set(browser, "slider", 0.1)
        assert wait_for(begun.is_set)
        for k in range(2, 30):
            place.set(browser, "slider", k / 10)
        place.set(browser, "number", 7.0)
        wait_for(lambda: -7.0 in seen)
        go_on.set()
        wait_for(lambda: len(seen) == 3)
        browser.listen(SILENCE)
    assert seen == [-7.0, 2.9, 2.9]


def test_a_drag_that_the_server_could_not_follow_is_answered_by_its_last_place(
    place: Place,
) -> None:
    with Browser(place.server) as browser:
        page = place.page(browser)
        seen: list[float] = []
        slider = page.widgets["slider"]

        @slider.on_update  # on the event loop: once for every message that viser is given
        async def _(_: object) -> None:
            seen.append(slider.value)

        loop = place.server.viser.get_event_loop()
        free = threading.Event()
        loop.call_soon_threadsafe(free.wait)  # the server stands
        places = [round(0.01 * k, 2) for k in range(1, 201)]
        for value in places:  # one after the other, without a look at what came meanwhile
            browser.set(slider._impl.uuid, value)
        browser.send(CAMERA)
        place.set(browser, "slider", NAN)  # refused: the place before it stays the last one
        free.set()
        wait_for(lambda: page.session.values.get("slider") == places[-1])
        assert seen == sorted(seen) and len(seen) < len(places) / 4


def test_no_click_overtakes_the_slider_that_was_moved_before_it(place: Place) -> None:
    with Browser(place.server) as browser:
        page = place.page(browser)
        slider, at_click = page.widgets["slider"], []
        page.widgets["button"].on_click(lambda _: at_click.append(slider.value))
        free = threading.Event()
        place.server.viser.get_event_loop().call_soon_threadsafe(free.wait)
        for value in (0.5, 1.0):
            place.set(browser, "slider", value)
        place.set(browser, "button", True)
        free.set()
        wait_for(lambda: at_click)
        assert at_click == [1.0]
