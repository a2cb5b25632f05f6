"""The time-line."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.session import Session
from flexgui.session.state import Part
from tests.session.helpers import until

NEAR = 2e-3
"""m: model and measurement of the same simulated arm differ by noise and large motion only."""


@pytest.fixture
def loaded(session: Session) -> Session:
    session.refresh_playback()
    assert session.wait_idle()
    return session


def test_ghost_and_model_of_the_same_arm_stand_together(loaded: Session) -> None:
    assert loaded.playback is not None and loaded.playback.ghost is not None
    model, ghost = loaded.playback.motion.q, loaded.playback.ghost
    assert np.abs(model[:, :2] - ghost[:, :2]).max() < NEAR


def test_frames_follow_the_cursor(loaded: Session) -> None:
    motion = loaded.playback
    assert motion is not None
    assert motion.frame(0.0) == 0
    assert motion.frame(motion.seconds) == len(motion.motion.time) - 1
    assert motion.frame(1e9) == len(motion.motion.time) - 1


def test_playing_moves_the_cursor_and_pausing_stops_it(loaded: Session) -> None:
    loaded.set_cursor(playing=True)
    until(lambda: loaded.cursor.time > 0.0)
    loaded.set_cursor(playing=False)
    until(lambda: not loaded._player._running)
    stands = loaded.cursor.time
    assert loaded.cursor.time == stands


def test_a_tick_that_fails_ends_no_playing(
    loaded: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(seconds: float) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr(loaded, "advance", fails)
        loaded.set_cursor(playing=True)
        until(lambda: loaded.faults.old == {Part.CURSOR})
    until(lambda: loaded.cursor.time > 0.0 and not loaded.faults.old)
    loaded.set_cursor(playing=False)


def test_cursor_starts_again_at_the_end(loaded: Session) -> None:
    assert loaded.playback is not None
    loaded.set_cursor(time=loaded.playback.seconds)
    loaded.advance(0.1)
    assert loaded.cursor.time == 0.0


def test_another_recording_is_read_and_shown(loaded: Session) -> None:
    loaded.set_cursor(recording="sweep", time=0.0)
    assert loaded.wait_idle()
    assert loaded.playback is not None and loaded.playback.recording == "sweep"
    assert loaded.recording is not None and loaded.recording.role == "validate"
