"""The model of the sliders, a slider under a hand, and the time-line."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.export.serialization import deserialize, serialize
from flexgui.places import WORK, has_saved_work
from flexgui.session import edited_scenario, playback
from flexgui.session.saved_work import SavedWork
from flexgui.session.scenario_edits import Edit, set_arm
from flexgui.session.scheduling import COMPUTE_TURNS
from flexgui.session.session import Session
from flexgui.session.state import LiveSettings, PagePart, Topic
from flexgui.stages.arm.live import LiveModel
from flexgui.stages.data.rigs import RIGS
from tests.session.helpers import until


def live(session: Session) -> LiveModel:
    session.document.refresh()
    assert session.wait_idle()
    assert session.document.live_model is not None
    return session.document.live_model


def fails(*_: object) -> None:
    raise ZeroDivisionError


@pytest.mark.parametrize(
    ("part", "module", "function", "refresh"),
    [
        (PagePart.MODEL, edited_scenario, "live_model", lambda session: session.document.refresh()),
        (
            PagePart.PLAYBACK,
            playback.recorded_motion,
            "simulated_motion",
            lambda session: session.playback.refresh(),
        ),
    ],
)
def test_what_our_own_fault_leaves_old_is_called_old_until_it_is_computed_anew(
    session: Session,
    part: PagePart,
    module: ModuleType,
    function: str,
    refresh: Callable[[Session], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session.playback.refresh()
    view = live(session)
    motion = session.playback.motion
    with monkeypatch.context() as broken:
        broken.setattr(module, function, fails)
        refresh(session)
        assert session.wait_idle() and session.faults.outdated == {part}
    assert session.document.live_model is view and session.playback.motion is motion is not None
    refresh(session)
    assert session.wait_idle() and not session.faults.outdated


def test_every_slider_moves_the_poles(session: Session) -> None:
    before = live(session).at.poles
    for name, value in (("young_modulus", 2e9), ("width", 0.06), ("mass", [8.0, 6.0])):
        session.document.change(set_arm(session.document.scenario, name, value))
        now = live(session).at.poles
        assert not np.allclose(now, before)
        before = now
    session.document.set_live(theta2=2.0)
    assert not np.allclose(live(session).at.poles, before)


@pytest.mark.parametrize("title", [rig.title for rig in RIGS])
def test_every_kind_of_rig_is_shown_at_once(session: Session, title: str) -> None:
    """Torques damp nothing: the free arm has poles on the axis of its frequency response."""
    rig = session.recordings.rig
    assert rig.choose_kind(title) or title == RIGS[0].title
    assert live(session).scenario is session.document.scenario
    assert not session.faults.outdated and not session.message.bad


def test_another_kind_of_arm_is_announced_while_it_is_made(session: Session) -> None:
    live(session)
    told: list[str] = []
    session.subscribe(lambda topic: told.append(session.message.text))
    session.document.change(set_arm(session.document.scenario, "mass", [8.0, 6.0]))
    live(session)
    assert not any("compiled" in text for text in told)
    session.document.change(set_arm(session.document.scenario, "modes", [0, 1]))
    live(session)
    assert any("compiled" in text for text in told)
    assert session.message.text == ""


def test_a_stiffer_arm_bends_less_at_the_newest_working_point(session: Session) -> None:
    soft = live(session).q[2:]
    session.document.change(set_arm(session.document.scenario, "young_modulus", 2e9))
    assert live(session).q[2:] == pytest.approx(soft / 2.0)
    told: list[Topic] = []
    session.subscribe(told.append)
    for degrees in range(10, 170):
        session.document.set_live(theta2=np.radians(degrees))
    assert live(session).q[1] == pytest.approx(np.radians(169))
    assert told.count(Topic.LIVE) <= 161


def test_noise_follows_its_level(session: Session) -> None:
    session.document.set_live(snr_db=20.0)
    loud = live(session).noise
    session.document.set_live(snr_db=40.0)
    assert live(session).noise == pytest.approx(loud / 10.0)
    session.document.set_live(snr_db=None)
    assert not live(session).noise.any()


def test_model_without_bending_has_no_modes_to_bend(session: Session) -> None:
    session.document.change(set_arm(session.document.scenario, "modes", [0, 0]))
    assert live(session).q == pytest.approx([0.0, session.document.live.theta2])


SOON = 60.0
"""s on a busy machine; only waited for where something is wrong."""


def stiffness(session: Session, value: float) -> Edit:
    """Of the segments' material, in Pa."""
    return set_arm(session.document.scenario, "young_modulus", value)


def drawn(session: Session, value: float) -> bool:
    """Whether the arm that is shown has it."""
    view = session.document.live_model
    return view is not None and view.scenario.arm.model_dump()["young_modulus"] == value


@pytest.fixture
def kept(session: Session) -> Session:
    session.store.begin()
    session.document.refresh()
    assert session.wait_idle(SOON)
    return session


def test_places_that_a_hand_passes_are_not_heard_and_the_last_one_is_written_before_it_is(
    kept: Session,
) -> None:
    heard: list[tuple[Topic, float]] = []

    def listen(topic: Topic) -> None:
        if topic in (Topic.SCENARIO, Topic.LIVE):
            written = deserialize((kept.folder / WORK).read_bytes(), SavedWork).scenario
            heard.append((topic, written.arm.model_dump()["young_modulus"]))

    kept.subscribe(listen)
    with COMPUTE_TURNS.for_computing():  # nobody else computes meanwhile
        for value in (0.91e9, 0.92e9, 0.93e9):
            assert kept.document.change(stiffness(kept, value), dragging=True)
        assert not heard and not has_saved_work(kept.folder)
    assert kept.wait_idle(SOON) and drawn(kept, 0.93e9)
    assert [topic for topic, _ in heard].count(Topic.SCENARIO) == 1
    assert {value for _, value in heard} == {0.93e9}


def test_a_slid_scenario_is_heard_of_and_written_even_where_its_arm_cannot_be_computed(
    kept: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> LiveModel:
        raise InputError("no such arm")

    monkeypatch.setattr(edited_scenario, "live_model", fails)
    heard: list[Topic] = []
    kept.subscribe(heard.append)
    assert kept.document.change(stiffness(kept, 0.94e9), dragging=True)
    assert kept.wait_idle(SOON)
    assert Topic.SCENARIO in heard and has_saved_work(kept.folder)


def test_sessions_at_the_same_place_share_scenario_and_model(kept: Session, tmp_path: Path) -> None:
    folder = tmp_path / "another"
    folder.mkdir()
    other = Session("another-person", folder, kept.services)
    for each in (kept, other):
        assert each.document.change(stiffness(each, 0.95e9), dragging=True)
        assert each.wait_idle(SOON)
    assert kept.document.scenario is other.document.scenario
    assert kept.document.live_model is other.document.live_model is not None
    other.document.set_live(theta2=2.0)
    assert other.wait_idle(SOON)
    assert (
        kept.document.live_model is not other.document.live_model
        and kept.document.live_model.model is other.document.live_model.model
    )  # type: ignore[union-attr]
    other.close()


def test_no_changed_byte_of_kept_work_is_taken_for_the_work() -> None:
    content = serialize(LiveSettings(theta2=1.5))
    assert deserialize(content, LiveSettings) == LiveSettings(theta2=1.5)
    for place in range(len(content)):
        for bit in (1, 4):
            damaged = bytearray(content)
            damaged[place] ^= bit
            with pytest.raises(InputError, match="damaged"):
                deserialize(bytes(damaged), LiveSettings)
    for length in range(len(content)):
        with pytest.raises(InputError, match="damaged"):
            deserialize(content[:length], LiveSettings)


NEAR = 2e-3
"""m: model and measurement of the same simulated arm differ by noise and large motion only."""


@pytest.fixture
def loaded(session: Session) -> Session:
    session.playback.refresh()
    assert session.wait_idle()
    return session


def test_ghost_and_model_of_the_same_arm_stand_together(loaded: Session) -> None:
    assert loaded.playback.motion is not None and loaded.playback.motion.ghost is not None
    model, ghost = loaded.playback.motion.motion.q, loaded.playback.motion.ghost
    assert np.abs(model[:, :2] - ghost[:, :2]).max() < NEAR


def test_frames_follow_the_cursor_which_plays_and_starts_again_at_the_end(loaded: Session) -> None:
    motion = loaded.playback.motion
    assert motion is not None
    last = len(motion.motion.time) - 1
    assert [motion.frame(t) for t in (0.0, motion.seconds, 1e9)] == [0, last, last]
    loaded.playback.move(playing=True)
    until(lambda: loaded.playback.cursor.time > 0.0)
    loaded.playback.move(playing=False)
    until(lambda: not any(t.name == "player" for t in threading.enumerate()))
    loaded.playback.move(time=motion.seconds)
    loaded.playback.advance(0.1)
    assert loaded.playback.cursor.time == 0.0


def test_a_tick_that_fails_ends_no_playing(
    loaded: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(seconds: float) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr(loaded.playback, "advance", fails)
        loaded.playback.move(playing=True)
        until(lambda: loaded.faults.outdated == {PagePart.CURSOR})
    until(lambda: loaded.playback.cursor.time > 0.0 and not loaded.faults.outdated)
    loaded.playback.move(playing=False)


def test_another_recording_is_read_and_shown(loaded: Session) -> None:
    loaded.playback.move(recording="sweep", time=0.0)
    assert loaded.wait_idle()
    assert loaded.playback.motion is not None and loaded.playback.motion.recording == "sweep"
    assert loaded.playback.recording is not None and loaded.playback.recording.role == "validate"
