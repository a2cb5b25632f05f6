"""Files whose columns have names of their own."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest

from flexgui.scene.recorded_motion import read_recording
from flexgui.session.session import Session
from flexgui.stages.data.uploads import scenario_file
from flexgui.views.preview import as_in_file
from tests.session.helpers import bring, good_csv, laboratory_csv, settle, waiting_of

TEXT_DIGITS = 1e-9
"""Relative: a degree written as text is as exact as its digits."""


def foreign(session: Session) -> bytes:
    """A good recording under other names, without units in two headings."""
    text = good_csv(session).replace(b"t [s]", b"clock", 1)
    return text.replace(b",theta1,", b",motor,", 1).replace(b"dtheta1_ref", b"speed", 1)


def waits(session: Session) -> None:
    """Without what a first look has guessed."""
    assert not session.recordings.upload("rig.csv", foreign(session)).result()
    assert session.recordings.waiting is not None
    session.recordings.ask_again()


def test_a_file_with_other_names_waits_for_its_columns(session: Session) -> None:
    assert not session.recordings.upload("rig.csv", foreign(session)).result()
    waiting = waiting_of(session)
    assert "clock" in waiting.headers
    assert waiting.headers_of == {"t": "clock", "theta1": "motor"}
    assert waiting.missing == ("dtheta1_ref",)
    assert session.message.bad and "missing signal" in session.message.text
    assert (session.folder / "rig.csv").is_file()


def test_chosen_columns_make_it_a_recording(session: Session) -> None:
    shown = session.document.scenario.recordings[0].name
    plain = read_recording(session.document.scenario, shown, session.folder)
    waits(session)
    assert session.recordings.map_column("t", "clock")
    assert session.recordings.map_column("dtheta1_ref", "speed")
    assert session.recordings.map_column("theta1", "motor", gain=2.0, sign=-1, unit="deg")
    assert session.recordings.read_waiting().result() and settle(session), session.message.text
    assert session.recordings.waiting is None
    assert session.wait_idle()
    found, spec = session.playback.recording, session.document.scenario.recordings[-1]
    assert found is not None and spec.columns["theta1"].name == "motor [deg]"
    assert found["theta1"] == pytest.approx(-2.0 * np.radians(plain["theta1"]), rel=TEXT_DIGITS)
    assert found["dtheta1_ref"] == pytest.approx(plain["dtheta1_ref"])


def test_it_is_not_read_while_a_needed_column_is_missing(session: Session) -> None:
    waits(session)
    before = session.document.scenario
    assert session.recordings.map_column("t", "clock")
    assert not session.recordings.read_waiting().result()
    assert session.message.bad and "dtheta1_ref" in session.message.text
    assert session.document.scenario == before and session.recordings.waiting is not None


@pytest.mark.parametrize("pair", [("t", "nobody"), ("theta9", "clock")])
def test_what_is_not_there_cannot_be_chosen(session: Session, pair: tuple[str, str]) -> None:
    waits(session)
    before = session.recordings.waiting
    assert not session.recordings.map_column(*pair)
    assert session.recordings.waiting == before


def test_a_file_that_needs_no_answers_is_read_while_another_one_waits(session: Session) -> None:
    waits(session)
    before = session.recordings.waiting
    assert bring(session, "th1.csv", good_csv(session))
    assert session.recordings.waiting == before
    assert sorted(p.name for p in session.folder.iterdir()) == ["rig.csv", "th1.csv"]
    session.recordings.leave_file()
    assert [p.name for p in session.folder.iterdir()] == ["th1.csv"]


def test_a_bad_file_is_named_while_another_one_waits(session: Session) -> None:
    waits(session)
    before = session.recordings.waiting
    heavy = good_csv(session).replace(b"z1 [m]", b"z1 [kg]", 1)
    assert not session.recordings.upload("heavy.csv", heavy).result()
    assert session.message.bad and "heavy.csv" in session.message.text
    assert session.recordings.waiting == before


def test_columns_of_a_recording_can_be_chosen_again(session: Session) -> None:
    assert bring(session, "th1.csv", good_csv(session))
    assert session.recordings.choose_columns("th1").result()
    one, two = (
        next(h for h in waiting_of(session).headers if h.startswith(name))
        for name in ("theta1", "theta2")
    )
    assert session.recordings.map_column("theta1", two, sign=-1)
    assert waiting_of(session).missing == ("theta2",)
    assert session.recordings.map_column("theta2", one)
    count = len(session.document.scenario.recordings)
    assert session.recordings.read_waiting().result(), session.message.text
    assert len(session.document.scenario.recordings) == count
    assert session.document.scenario.recordings[-1].columns["theta1"].sign == -1
    session.recordings.choose_columns("th1").result()
    session.recordings.leave_waiting()
    assert (session.folder / "th1.csv").is_file()


def test_a_simulated_recording_has_no_columns_to_choose(session: Session) -> None:
    assert not session.recordings.choose_columns(
        session.document.scenario.recordings[0].name
    ).result()
    assert session.message.bad


def test_the_choice_travels_with_the_scenario(session: Session) -> None:
    waits(session)
    session.recordings.map_column("t", "clock")
    session.recordings.map_column("dtheta1_ref", "speed")
    assert session.recordings.read_waiting().result() and settle(session)
    name, data = scenario_file(session.document.scenario, session.folder)
    session.choose("demo")
    for path in session.folder.iterdir():
        path.unlink()
    assert session.recordings.upload(name, data).result(), session.message.text
    assert session.document.scenario.recordings[-1].columns["t"].name == "clock"


def bare(session: Session) -> bytes:
    """A good recording with a semicolon, a decimal comma, and no name that is known."""
    lines = good_csv(session).decode().splitlines()
    names = [cell.split(" ")[0].strip() for cell in lines[0].split(",")]
    kept = [k for k, name in enumerate(names) if name != "theta2"]
    new = {"t": "Zeit", "theta1": "Winkel A", "z1": "cam x", "z2": "cam y",
           "dtheta1_ref": "ref A", "dtheta2_ref": "ref B"}  # fmt: skip
    head = ";".join(new.get(names[k], f"other {k}") for k in kept)
    rows = (line.split(",") for line in lines[1:])
    body = (";".join(row[k].replace(".", ",") for k in kept) for row in rows)
    return "\n".join([head, *body, ""]).encode()


ANSWERS = {"t": "Zeit", "dtheta1_ref": "ref A", "dtheta2_ref": "ref B", "theta1": "Winkel A",
           "z1": "cam x", "z2": "cam y"}  # fmt: skip


def test_what_is_asked_follows_the_answers_and_ends(session: Session) -> None:
    assert not session.recordings.upload("rig.csv", bare(session)).result()
    session.recordings.ask_again()
    asked = []
    for _ in range(len(ANSWERS) + 1):
        assert waiting_of(session).questions
        channel = waiting_of(session).questions[0]
        asked.append(channel)
        assert channel == "theta2" or ANSWERS[channel] in waiting_of(session).unused
        if channel == "theta2":
            session.recordings.answer(theta2=0.7)
        else:
            assert session.recordings.map_column(channel, ANSWERS[channel])
        assert not session.message.bad, "an answer clears the sentence before it"
    assert not waiting_of(session).questions
    assert asked[:4] == ["t", "dtheta1_ref", "dtheta2_ref", "theta2"]
    assert set(asked) == {*ANSWERS, "theta2"}
    assert session.recordings.read_waiting().result(), session.message.text
    assert session.wait_idle()
    spec, found = session.document.scenario.recordings[-1], session.playback.recording
    assert spec.theta2 == 0.7 and found is not None and found.has("z1", "z2", "theta1")
    assert session.playback.motion is not None and not session.message.bad


def test_a_column_holds_one_channel(session: Session) -> None:
    waits(session)
    assert session.recordings.map_column("t", "clock")
    before = session.recordings.waiting
    assert not session.recordings.map_column("dtheta1_ref", "clock")
    assert session.message.bad and "clock is already the time t [s]" in session.message.text
    assert session.recordings.waiting == before
    assert session.recordings.map_column("t", "speed") and session.recordings.map_column(
        "dtheta1_ref", "clock"
    )


def test_the_working_point_is_needed_where_no_column_has_it(session: Session) -> None:
    before = session.document.scenario
    content = good_csv(session).replace(b",theta2,", b",column 7,", 1)
    assert not session.recordings.upload("rig.csv", content).result()
    assert waiting_of(session).missing == ("theta2",)
    assert not session.recordings.read_waiting().result() and session.document.scenario == before
    assert "[[" not in session.message.text and not session.recordings.imports.pending
    session.recordings.answer(theta2=0.5)
    assert session.recordings.read_waiting().result()
    assert [spec.theta2 for spec in session.document.scenario.recordings] == [0.5]


def test_what_is_only_useful_may_be_absent(session: Session) -> None:
    content = good_csv(session).replace(b",z1 ", b",remark ", 1)
    assert not session.recordings.upload("rig.csv", content).result()
    assert waiting_of(session).questions == ("z1",)
    assert not session.message.bad and not waiting_of(session).missing
    session.recordings.no_column("t")
    assert waiting_of(session).questions == ("z1",)
    session.recordings.no_column("z1")
    assert waiting_of(session).questions == () and session.recordings.read_waiting().result()


def test_begun_again_nothing_is_known(session: Session) -> None:
    waits(session)
    first = session.recordings.waiting
    assert session.recordings.map_column("t", "clock")
    session.recordings.ask_again()
    assert session.recordings.waiting == first


def test_a_first_look_knows_names_units_swaps_and_gaps(session: Session) -> None:
    """In one table."""
    assert not session.recordings.upload("rig.csv", laboratory_csv(session)).result()
    waiting = waiting_of(session)
    assert not waiting.missing and not waiting.questions
    assert waiting.settings() == {"gaps": {"how": "interpolate"}}
    assert waiting.rows[0].empty == {"enc_1": 6}
    names = {c: entry["name"] for c, entry in waiting.columns.items()}
    assert names["theta1"] == "enc_2 [deg]" and names["theta2"] == "enc_1 [deg]"
    assert session.recordings.read_waiting().result(), session.message.text
    spec = session.document.scenario.recordings[-1]
    assert spec.gaps is not None and spec.gaps.how == "interpolate"


def test_channels_are_named_in_plain_words(session: Session) -> None:
    waits(session)
    waiting = waiting_of(session)
    said = [waiting.words(channel) for channel in waiting.offered]
    assert said[0] == "the time t [s]" and len(set(said)) == len(said)
    assert not [text for text in said if "_ref" in text]


@pytest.mark.parametrize(("every", "first"), [(100, 1), (997, 990)])
def test_the_picture_of_a_slow_camera_shows_its_samples(
    session: Session, every: int, first: int
) -> None:
    table = pd.read_csv(io.BytesIO(foreign(session)))
    camera = table["z1 [m]"].copy()
    table.loc[np.arange(len(table)) % every != first, "z1 [m]"] = np.nan
    assert not session.recordings.upload("slow.csv", table.to_csv(index=False).encode()).result()
    inspection = waiting_of(session).inspection
    assert inspection is not None
    rows, values = inspection.pictures["z1 [m]"]
    assert list(rows) == list(range(first, len(table), every))
    assert np.allclose(values, camera[rows.astype(int)])
    drawn = as_in_file(inspection.pictures, "clock", ["z1 [m]"])
    assert drawn is not None
    assert np.allclose(drawn["data"][0]["x"], table["clock"][rows.astype(int)], atol=1e-3)


def test_a_file_of_times_alone_has_nothing_to_draw() -> None:
    rows = np.arange(5)
    assert as_in_file({"clock": (rows, 0.1 * rows)}, "clock", []) is None
