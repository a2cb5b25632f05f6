"""The model of the sliders."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from flexgui.session import edited_scenario, playback
from flexgui.session.scenario_edits import set_arm
from flexgui.session.session import Session
from flexgui.session.state import PagePart, Topic
from flexgui.stages.arm.live import LiveModel


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
        (
            PagePart.MODEL,
            edited_scenario,
            "live_model",
            lambda session: session.document.refresh(),
        ),
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


def test_a_stiffer_arm_bends_less(session: Session) -> None:
    soft = live(session).q[2:]
    session.document.change(set_arm(session.document.scenario, "young_modulus", 2e9))
    assert live(session).q[2:] == pytest.approx(soft / 2.0)


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


def test_posture_stands_at_the_working_point(session: Session) -> None:
    session.document.set_live(theta2=1.25)
    assert live(session).q[1] == 1.25


def test_noise_follows_its_level(session: Session) -> None:
    session.document.set_live(snr_db=20.0)
    loud = live(session).noise
    session.document.set_live(snr_db=40.0)
    assert live(session).noise == pytest.approx(loud / 10.0)
    session.document.set_live(snr_db=None)
    assert not live(session).noise.any()


def test_newest_wish_wins(session: Session) -> None:
    live(session)
    told: list[Topic] = []
    session.subscribe(told.append)
    for degrees in range(10, 170):
        session.document.set_live(theta2=np.radians(degrees))
    assert live(session).live.theta2 == pytest.approx(np.radians(169))
    assert told.count(Topic.LIVE) <= 161


def test_model_without_bending_has_no_modes_to_bend(session: Session) -> None:
    session.document.change(set_arm(session.document.scenario, "modes", [0, 0]))
    assert live(session).q == pytest.approx([0.0, session.document.live.theta2])
