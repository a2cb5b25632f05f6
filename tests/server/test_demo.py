"""A demo: many watch, one changes; what a follower's own copy takes over."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexgui.places import WORK
from flexgui.server import demo as demo_module
from flexgui.server.browser_connection import BrowserConnection
from flexgui.server.demo import COPY, FOLLOW, copy_session
from flexgui.server.services import Limits
from flexgui.server.sessions import SessionStore
from flexgui.server.tickets import Tickets
from flexgui.server.work_folders import SavedWorkFolders
from flexgui.session.session import Session
from flexgui.stages.challenge.state import Challenge, Guess
from flexgui.stages.diagnose.model_versions import ModelVersion
from tests.server.conftest import MakePlace, Place
from tests.server.helpers import (
    PATIENCE,
    SILENCE,
    Browser,
    SlowDisk,
    Thing,
    announcement,
    get,
    wait_for,
)
from tests.session.helpers import HIDDEN_FRICTION, alone

CODE, TOKEN = "K7QM-2XWP", "0123456789abcdef"


def copy(teacher: Thing, own: Thing) -> None:
    own.values = dict(teacher.values)


@pytest.fixture(autouse=True)
def _copied(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo_module, "copy_session", copy)


@pytest.fixture
def demo(make_place: MakePlace) -> Place:
    return make_place(demo=True)


def button(browser: Browser, label: str) -> str:
    def find() -> str | None:
        for message in reversed(browser.heard):
            if message["type"] == "GuiButtonMessage" and message["props"]["label"] == label:
                return str(message["uuid"])
        return None

    return str(browser.until(find, label))


def test_the_first_is_the_teacher_and_the_others_follow(demo: Place) -> None:
    with Browser(demo.server) as teacher, Browser(demo.server) as follower:
        mine = demo.page(teacher)
        theirs = demo.page(follower)
        assert not mine.read_only and theirs.read_only and theirs.session is mine.session


def test_who_follows_does_not_wait_for_another_ones_saved_work(tmp_path: Path) -> None:
    disk, kept, key = SlowDisk(), SavedWorkFolders(tmp_path / "kept"), "k" * 32
    folder = kept.begin(key)
    (folder / WORK).touch()
    kept.end(folder)
    store = SessionStore(disk, Limits(), kept)
    demo = demo_module.Demo(store, lambda browser: None, first_is_teacher=True)
    teacher, other, follower = (
        BrowserConnection(cast(Any, SimpleNamespace(client_id=k)), "127.0.0.1", store)
        for k in range(3)
    )
    demo.arrive(teacher, None)
    with ThreadPoolExecutor(2) as threads, disk.stopped():
        comes_back = threads.submit(demo.arrive, other, key)
        assert disk.reached.wait(PATIENCE)
        threads.submit(demo.arrive, follower, None).result(PATIENCE)
        assert follower.session is teacher.session and not comes_back.done()
    assert other.session is not None and other.session.key == key
    store.close()


def test_a_follower_changes_nothing_and_is_told_why(demo: Place) -> None:
    with Browser(demo.server) as teacher, Browser(demo.server) as follower:
        session = demo.page(teacher).session
        shown = demo.page(follower)
        for name, value in (("slider", 2.0), ("check", True), ("button", True), ("group", "left")):
            demo.set(follower, name, value)
        follower.send(announcement(shown.widgets["upload"]._impl.uuid, 6, 1))
        follower.send(
            {"type": "SceneNodeClickMessage", "name": "/a", "instance_index": None, "owner": "",
             "ray_origin": [0, 0, 0], "ray_direction": [0, 0, 1], "screen_pos": [0, 0],
             "modifier": None}
        )  # fmt: skip
        slider = shown.widgets["slider"]._impl.uuid
        follower.await_message("GuiUpdateMessage", uuid=slider, updates={"value": 1.0})
        follower.until(lambda: any("own copy" in note for note in follower.notes))
        assert not session.values and shown.widgets["slider"].value == 1.0
        demo.set(teacher, "slider", 2.0)
        assert wait_for(lambda: session.values.get("slider") == 2.0)


def test_a_follower_takes_an_own_copy_and_comes_back(demo: Place) -> None:
    storage: dict[str, str] = {}
    with Browser(demo.server) as teacher, Browser(demo.server, storage=storage) as follower:
        session = demo.page(teacher).session
        demo.set(teacher, "slider", 2.0)
        wait_for(lambda: session.values)
        old = demo.page(follower)
        follower.set(button(follower, COPY), True)
        follow = button(follower, FOLLOW)
        own = demo.page(follower)
        assert own.session is not session and own.session.values == {"slider": 2.0}
        assert old.closed and not own.read_only
        demo.set(follower, "slider", 0.5)
        wait_for(lambda: own.session.values["slider"] == 0.5)
        assert session.values["slider"] == 2.0
        assert storage["flexgui-session"] == own.session.key
        follower.set(follow, True)
        wait_for(lambda: len(demo.pages.all) == 4)
        follower.listen(SILENCE)
        assert demo.page(follower).session is session and demo.page(follower).read_only


def test_who_has_a_copy_keeps_it_over_a_reload(demo: Place) -> None:
    storage: dict[str, str] = {}
    with Browser(demo.server) as teacher:
        demo.page(teacher)
        with Browser(demo.server, storage=storage) as follower:
            demo.page(follower)
            follower.set(button(follower, COPY), True)
            follower.until(lambda: storage, "the key")
        with Browser(demo.server, storage=storage) as again:
            shown = demo.page(again)
            assert shown.session.key == storage["flexgui-session"] and not shown.read_only


def test_followers_never_learn_the_teachers_key(demo: Place) -> None:
    with Browser(demo.server) as teacher, Browser(demo.server) as follower:
        key = demo.page(teacher).session.key
        demo.page(follower)
        follower.listen(SILENCE)
        assert key not in str(follower.heard) and not follower.storage


def test_the_teacher_stays_the_teacher_over_a_reload_and_for_hours(demo: Place) -> None:
    storage: dict[str, str] = {}
    with Browser(demo.server, storage=storage) as teacher:
        session = demo.page(teacher).session
        teacher.until(lambda: storage, "the key")
    demo.clock.now += 10_000.0
    wait_for(lambda: demo.pages.all[0].closed)
    demo.server.store.sweep()
    with Browser(demo.server, storage=storage) as teacher:
        assert demo.page(teacher).session is session and not demo.page(teacher).read_only


def test_in_a_class_the_teacher_is_who_has_the_token(make_place: MakePlace) -> None:
    place = make_place(demo=True, tickets=Tickets(CODE, TOKEN))
    ticket = (get(place.server, f"/?teacher={TOKEN}").getheader("Set-Cookie") or "").split(";")[0]
    with Browser(place.server, path=f"/?code={CODE}") as early:
        early.await_message("GuiMarkdownMessage")
        assert not place.pages.all
        with Browser(place.server, headers={"Cookie": ticket}) as teacher:
            assert not place.page(teacher).read_only
            assert place.page(early).read_only
            assert place.page(early).session is place.page(teacher).session


@pytest.fixture
def both(tmp_path: Path) -> Iterator[list[Session]]:
    """A teacher's session and one that takes a copy."""
    made = [alone(key, tmp_path / key) for key in ("teacher", "own")]
    yield made
    for session in made:
        session.close()


def test_a_copy_has_what_the_teacher_found(both: list[Session]) -> None:
    teacher, own = both
    teacher.diagnosis.versions = (ModelVersion(teacher.document.scenario),)
    copy_session(teacher, own)
    assert own.diagnosis.versions == teacher.diagnosis.versions and own.challenge.state is None


def test_a_copy_of_a_challenge_begins_anew(both: list[Session]) -> None:
    teacher, own = both
    (teacher.folder / "th1.csv").write_text("t\n")
    teacher.challenge.state = Challenge(7, "hard", HIDDEN_FRICTION, (Guess("rotor_inertia"),))
    teacher.diagnosis.versions = (ModelVersion(teacher.document.scenario),)
    copy_session(teacher, own)
    assert (own.folder / "th1.csv").is_file()
    known = own.challenge.state
    assert known is not None and (known.seed, known.level) == (7, "hard")
    assert known.truth == HIDDEN_FRICTION
    assert not known.guesses
    assert not own.diagnosis.versions, "the teacher's findings would give it away"
