"""Files whose columns have names of their own."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.session import Session
from flexgui.session.bundle import scenario_file
from tests.session.conftest import Offered
from tests.session.helpers import good_csv

TEXT_DIGITS = 1e-9
"""Relative: a degree written as text is as exact as its digits."""


def foreign(session: Session) -> bytes:
    """A good recording under other names, without units in two headings."""
    text = good_csv(session).replace(b"t [s]", b"clock", 1)
    return text.replace(b",theta1,", b",motor,", 1).replace(b"dtheta1_ref", b"speed", 1)


def waits(session: Session, services: Offered) -> None:
    assert not session.upload("rig.csv", foreign(session), services)
    assert session.waiting is not None


def test_a_file_with_other_names_waits_for_its_columns(session: Session, services: Offered) -> None:
    waits(session, services)
    waiting = session.waiting
    assert waiting is not None and "clock" in waiting.headers
    assert waiting.missing == ("t", "dtheta1_ref")
    assert session.message.bad and "column t" in session.message.text
    assert "Which column is which" in session.message.text
    assert (session.folder / "rig.csv").is_file()


def test_chosen_columns_make_it_a_recording(session: Session, services: Offered) -> None:
    waits(session, services)
    assert session.map_column("t", "clock")
    assert session.map_column("dtheta1_ref", "speed")
    assert session.map_column("theta1", "motor", gain=2.0, sign=-1, unit="deg")
    assert session.read_waiting(), session.message.text
    assert session.waiting is None
    assert session.wait_idle()
    found, spec = session.recording, session.scenario.recordings[-1]
    assert found is not None and spec.columns["theta1"].name == "motor [deg]"
    session.set_cursor(recording=session.scenario.recordings[0].name)
    assert session.wait_idle()
    plain = session.recording
    assert plain is not None
    assert found["theta1"] == pytest.approx(-2.0 * np.radians(plain["theta1"]), rel=TEXT_DIGITS)
    assert found["dtheta1_ref"] == pytest.approx(plain["dtheta1_ref"])


def test_it_is_not_read_while_a_needed_column_is_missing(
    session: Session, services: Offered
) -> None:
    waits(session, services)
    before = session.scenario
    assert session.map_column("t", "clock")
    assert not session.read_waiting()
    assert session.message.bad and "dtheta1_ref" in session.message.text
    assert session.scenario == before and session.waiting is not None


@pytest.mark.parametrize("pair", [("t", "nobody"), ("theta9", "clock")])
def test_what_is_not_there_cannot_be_chosen(
    session: Session, services: Offered, pair: tuple[str, str]
) -> None:
    waits(session, services)
    before = session.waiting
    assert not session.map_column(*pair)
    assert session.waiting == before


def test_another_upload_forgets_the_file(session: Session, services: Offered) -> None:
    waits(session, services)
    assert session.upload("th1.csv", good_csv(session), services)
    assert session.waiting is None
    assert [p.name for p in session.folder.iterdir()] == ["th1.csv"]


def test_columns_of_a_recording_can_be_chosen_again(session: Session, services: Offered) -> None:
    assert session.upload("th1.csv", good_csv(session), services)
    assert session.choose_columns("th1")
    header = next(h for h in session.waiting.headers if h.startswith("theta2"))  # type: ignore[union-attr]
    assert session.map_column("theta1", header, sign=-1)
    count = len(session.scenario.recordings)
    assert session.read_waiting(), session.message.text
    assert len(session.scenario.recordings) == count
    assert session.scenario.recordings[-1].columns["theta1"].sign == -1
    session.choose_columns("th1")
    session.leave_waiting()
    assert (session.folder / "th1.csv").is_file()


def test_a_simulated_recording_has_no_columns_to_choose(session: Session) -> None:
    assert not session.choose_columns(session.scenario.recordings[0].name)
    assert session.message.bad


def test_the_choice_travels_with_the_scenario(session: Session, services: Offered) -> None:
    waits(session, services)
    session.map_column("t", "clock")
    session.map_column("dtheta1_ref", "speed")
    assert session.read_waiting()
    name, data = scenario_file(session.scenario, session.folder)
    session.choose("demo", services)
    for path in session.folder.iterdir():
        path.unlink()
    assert session.upload(name, data, services), session.message.text
    assert session.scenario.recordings[-1].columns["t"].name == "clock"
