"""The time-line."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from flexgui.session.session import Session
from flexgui.session.state import PagePart
from tests.session.helpers import until

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


def test_frames_follow_the_cursor(loaded: Session) -> None:
    motion = loaded.playback.motion
    assert motion is not None
    assert motion.frame(0.0) == 0
    assert motion.frame(motion.seconds) == len(motion.motion.time) - 1
    assert motion.frame(1e9) == len(motion.motion.time) - 1


def test_playing_moves_the_cursor_and_pausing_stops_it(loaded: Session) -> None:
    loaded.playback.move(playing=True)
    until(lambda: loaded.playback.cursor.time > 0.0)
    loaded.playback.move(playing=False)
    until(lambda: not any(t.name == "player" for t in threading.enumerate()))
    stands = loaded.playback.cursor.time
    assert loaded.playback.cursor.time == stands


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


def test_cursor_starts_again_at_the_end(loaded: Session) -> None:
    assert loaded.playback.motion is not None
    loaded.playback.move(time=loaded.playback.motion.seconds)
    loaded.playback.advance(0.1)
    assert loaded.playback.cursor.time == 0.0


def test_another_recording_is_read_and_shown(loaded: Session) -> None:
    loaded.playback.move(recording="sweep", time=0.0)
    assert loaded.wait_idle()
    assert loaded.playback.motion is not None and loaded.playback.motion.recording == "sweep"
    assert loaded.playback.recording is not None and loaded.playback.recording.role == "validate"
