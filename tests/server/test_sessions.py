"""Whose session it is, and how long it lives."""

from __future__ import annotations

import contextlib
import stat
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from flexgui.places import WORK
from flexgui.server.services import Limits
from flexgui.server.sessions import SessionStore
from flexgui.server.work_folders import SavedWorkFolders
from tests.server.conftest import SMALL, MakePlace, Place
from tests.server.helpers import PATIENCE, SILENCE, Browser, FakeClock, SlowDisk, Thing, wait_for


def test_a_reload_keeps_the_session_and_two_windows_share_it(place: Place) -> None:
    storage: dict[str, str] = {}
    with Browser(place.server, storage=storage) as browser:
        before = place.page(browser).session
        browser.until(lambda: storage, "the key")
    with Browser(place.server, storage=storage) as one:
        assert place.page(one).session is before
        with Browser(place.server, storage=storage) as two:
            assert place.page(two).session is before
    assert wait_for(lambda: all(p.closed for p in place.pages.all))
    assert not before.closed and not before.stops


def test_two_browsers_do_not_see_each_other(place: Place) -> None:
    with Browser(place.server) as one, Browser(place.server) as two:
        first, second = place.page(one).session, place.page(two).session
        assert first is not second and first.folder != second.folder
        place.set(one, "slider", 2.0)
        wait_for(lambda: first.values)
        assert not second.values


def test_a_key_of_ones_own_invention_opens_nothing(place: Place) -> None:
    invented = {"flexgui-session": "a" * 32}
    with Browser(place.server, storage=invented) as browser:
        assert place.page(browser).session.key != "a" * 32


def test_a_browser_that_answers_late_finds_its_session(make_place: MakePlace) -> None:
    place = make_place(replace(SMALL, key_wait=0.2, key_wait_longer=30.0))
    storage: dict[str, str] = {}
    with Browser(place.server, storage=storage) as browser:
        before = place.page(browser).session
        browser.until(lambda: storage, "the key")
    with Browser(place.server, storage=storage) as late:
        time.sleep(1.0)  # it hears nothing
        assert place.page(late).session is before


def test_the_key_of_a_browser_that_does_not_answer_is_not_written_over(
    make_place: MakePlace,
) -> None:
    place = make_place(replace(SMALL, key_wait=0.1, key_wait_longer=0.1))
    storage = {"flexgui-session": "k" * 32}
    with Browser(place.server, storage=storage, answers=False) as browser:
        place.page(browser)
        browser.listen(SILENCE)
    assert storage == {"flexgui-session": "k" * 32}


def test_few_silent_browsers_are_waited_for_and_nobody_else_waits(make_place: MakePlace) -> None:
    place = make_place(replace(SMALL, key_wait=0.1, key_wait_longer=60.0, asked_longer=2))
    with contextlib.ExitStack() as silent:
        for _ in range(8):
            silent.enter_context(Browser(place.server, answers=False))
        with Browser(place.server) as browser:
            assert place.page(browser)
        wait_for(lambda: len(place.pages.all) == 7)


def test_nobody_else_can_read_a_session_folder(place: Place) -> None:
    with Browser(place.server) as browser:
        folder = place.page(browser).session.folder
        for path in (folder, folder.parent):
            assert stat.S_IMODE(path.stat().st_mode) == 0o700
        assert place.page(browser).session.key not in str(folder)


def test_the_end_of_the_server_leaves_no_folder(make_place: MakePlace) -> None:
    place = make_place()
    with Browser(place.server) as browser:
        session = place.page(browser).session
    place.server.close()
    assert session.closed and not session.folder.parent.exists()


def test_a_full_server_says_so_on_the_page(make_place: MakePlace) -> None:
    place = make_place(replace(SMALL, sessions=1))
    with Browser(place.server) as one, Browser(place.server) as two:
        place.page(one)
        message = two.await_message("GuiMarkdownMessage")
        assert "1 sessions are open" in str(message)
        two.listen(SILENCE)
        assert len(place.pages.all) == 1


@pytest.fixture
def store(clock: FakeClock) -> Iterator[SessionStore]:
    made = SessionStore(Thing, Limits(sessions=2))
    yield made
    made.close()


def test_an_hour_after_the_last_browser_left_a_session_ends(
    store: SessionStore, clock: FakeClock
) -> None:
    session = store.join(None)
    store.touch(session)
    store.join(session.key)
    store.leave(session)
    clock.now += 7200.0
    store.sweep()
    assert not session.closed, "one browser is still there"
    store.leave(session)
    clock.now += 3599.0
    store.sweep()
    assert not session.closed and store.join(session.key) is session
    store.leave(session)
    clock.now += 3600.0
    store.sweep()
    assert session.closed and not session.folder.exists() and not store.knows(session.key)


def test_jobs_go_on_over_a_reload_and_stop_soon_after_a_leave(
    store: SessionStore, clock: FakeClock
) -> None:
    session = store.join(None)
    store.touch(session)
    store.leave(session)
    clock.now += 5.0
    store.sweep()
    assert session.stops == 0
    store.join(session.key)
    clock.now += 100.0
    store.sweep()
    assert session.stops == 0
    store.leave(session)
    clock.now += 20.0
    for _ in range(3):
        store.sweep()
    assert session.stops == 1


def test_a_newcomer_takes_the_place_of_who_left_long_ago_or_did_nothing(
    store: SessionStore, clock: FakeClock
) -> None:
    first, second = store.join(None), store.join(None)
    store.touch(first)
    store.touch(second)
    with pytest.raises(InputError, match="2 sessions"):
        store.join(None)
    store.leave(second)
    store.leave(first)
    with pytest.raises(InputError, match="few minutes"):
        store.join(None)
    clock.now += 121.0
    store.join(first.key)
    idle = store.join(None)
    assert second.closed and not first.closed
    store.leave(first)
    store.leave(idle)
    store.join(None)
    assert idle.closed and not first.closed


def test_a_session_in_which_nothing_was_done_is_given_up_soon(
    store: SessionStore, clock: FakeClock
) -> None:
    idle = store.join(None)
    store.leave(idle)
    for seconds, closed in ((Limits.keep_untouched - 0.1, False), (0.1, True)):
        clock.now += seconds
        store.sweep()
        assert idle.closed is closed, "a reload finds it"


def test_a_session_that_cannot_be_made_leaves_no_folder() -> None:
    def fail(key: str, folder: Path) -> Thing:
        raise InputError("no")

    store = SessionStore(fail, Limits())
    with pytest.raises(InputError):
        store.join(None)
    assert not list(store.root.iterdir()) and not len(store)
    store.close()
    assert not store.root.exists()


def test_work_that_gave_its_place_is_found_again_though_nobody_could_take_it(
    clock: FakeClock, tmp_path: Path
) -> None:
    disk = SlowDisk()
    store = SessionStore(disk, Limits(sessions=1), SavedWorkFolders(tmp_path / "kept"))
    first = store.join(None)
    (first.folder / WORK).touch()
    store.leave(first)
    disk.full = True
    with pytest.raises(InputError, match="full"):
        store.join(None)
    assert first.closed and store.knows(first.key)
    disk.full = False
    assert store.join(first.key).key == first.key
    store.close()


def test_a_slow_disk_delays_only_whose_session_it_holds_up(clock: FakeClock) -> None:
    disk = SlowDisk()
    store = SessionStore(disk, Limits())
    there = store.join(None)
    with ThreadPoolExecutor(2) as threads, disk.stopped():
        waits = threads.submit(store.join, None)
        assert disk.reached.wait(PATIENCE)
        for step in (lambda: store.join(there.key), lambda: store.leave(there), store.sweep):
            threads.submit(step).result(PATIENCE)
        assert not waits.done() and len(store) == 2
    assert waits.result(PATIENCE) is not there
    store.close()


@pytest.mark.parametrize("full", [False, True])
def test_windows_that_come_while_their_session_is_made_share_its_fate(
    full: bool, clock: FakeClock, tmp_path: Path
) -> None:
    disk, kept = SlowDisk(), SavedWorkFolders(tmp_path / "kept")
    store, key = SessionStore(disk, Limits(), kept), "k" * 32
    folder = kept.begin(key)
    (folder / WORK).touch()
    kept.end(folder)
    with ThreadPoolExecutor(2) as threads, disk.stopped():
        disk.full = full
        first = threads.submit(store.join, key)
        assert disk.reached.wait(PATIENCE)
        second = threads.submit(store.join, key)
    if full:
        assert isinstance(first.exception(), InputError)
        assert isinstance(second.exception(), InputError)
    else:
        assert first.result() is second.result()
    assert len(store) == (not full) and store.knows(key)
    store.close()


def test_the_end_waits_for_a_session_that_is_being_made(clock: FakeClock) -> None:
    disk = SlowDisk()
    store = SessionStore(disk, Limits())
    with ThreadPoolExecutor(2) as threads:
        with disk.stopped():
            made = threads.submit(store.join, None)
            assert disk.reached.wait(PATIENCE)
            ends = threads.submit(store.close)
        ends.result(PATIENCE)
        assert made.result().closed and not store.root.exists()


def test_one_address_does_not_take_every_session(clock: FakeClock) -> None:
    store = SessionStore(Thing, Limits(sessions=10, sessions_per_address=3))
    first = [store.join(None, address="192.0.2.1") for _ in range(3)]
    with pytest.raises(InputError, match="your network address"):
        store.join(None, address="192.0.2.1")
    assert store.join(None, address="192.0.2.2") and store.join(None, address="192.0.2.3")
    assert store.join(first[0].key, address="192.0.2.1") is first[0]
    store.leave(first[1])
    store.join(None, address="192.0.2.1")
    assert first[1].closed and not first[2].closed
    store.close()


def test_a_loop_of_connections_leaves_room_for_others(clock: FakeClock) -> None:
    store = SessionStore(Thing, Limits())
    for k in range(1000):
        with contextlib.suppress(InputError):
            one = store.join(None, address="192.0.2.1")
            if k % 3 == 0:
                store.touch(one)
            if k % 2:
                store.leave(one)
        clock.now += 0.25
        store.sweep()
    assert len(store) <= Limits.sessions_per_address
    for k in range(20):
        assert store.join(None, address=f"198.51.100.{k}")
    store.close()


def test_what_a_browser_does_is_noticed(place: Place) -> None:
    with Browser(place.server) as idle, Browser(place.server) as busy:
        place.page(idle)
        place.set(busy, "slider", 2.0)
        session = place.page(busy).session
        wait_for(lambda: session.values)
    wait_for(lambda: all(shown.closed for shown in place.pages.all))
    place.clock.now += Limits.keep_untouched
    wait_for(lambda: len(place.server.store) == 1)
    assert place.server.store.knows(session.key)
