"""Files whose columns have names of their own, one or several at once."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest

from flexgui.core.recording.spec import GapsSpec
from flexgui.library.shipped import demo_scenario
from flexgui.scene.recorded_motion import read_recording
from flexgui.session.session import Session
from flexgui.stages.data.rows import SHORT_GAP, Rows, settings
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
    said = [waiting.words(channel) for channel in waiting.offered]
    assert len(set(said)) == len(said) and not [text for text in said if "_ref" in text]
    before = session.document.scenario
    assert not session.recordings.read_waiting().result()
    assert session.message.bad and "dtheta1_ref" in session.message.text
    assert session.document.scenario == before and session.recordings.waiting is waiting


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


def test_a_bad_file_is_named_and_a_good_one_read_while_another_one_waits(session: Session) -> None:
    waits(session)
    before = session.recordings.waiting
    heavy = good_csv(session).replace(b"z1 [m]", b"z1 [kg]", 1)
    assert not session.recordings.upload("heavy.csv", heavy).result()
    assert session.message.bad and "heavy.csv" in session.message.text
    assert bring(session, "th1.csv", good_csv(session))
    assert session.recordings.waiting == before
    assert session.recordings.map_column("t", "clock")
    session.recordings.ask_again()
    assert session.recordings.waiting == before, "begun again nothing is known"
    session.recordings.leave_file()
    assert [path.name for path in session.folder.iterdir()] == ["th1.csv"]


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
    simulated = demo_scenario().recordings[0].name
    session.choose("demo")
    assert not session.recordings.choose_columns(simulated).result() and session.message.bad


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
    for pair in (("t", "nobody"), ("theta9", "clock"), ("dtheta1_ref", "clock")):
        assert not session.recordings.map_column(*pair)
    assert session.message.bad and "clock is already the time t [s]" in session.message.text
    assert session.recordings.waiting == before
    assert session.recordings.map_column("t", "speed")
    assert session.recordings.map_column("dtheta1_ref", "clock")


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


NAMES = {
    "t [s]": "clock", "dtheta1_ref": "vel_cmd_1", "dtheta2_ref": "vel_cmd_2",
    "theta1": "enc_1 [rad]", "theta2": "enc_2 [rad]", "z1 [m]": "cam_x [m]", "z2 [m]": "cam_y [m]",
}  # fmt: skip
STEP = 1e-3
"""s, of the recording."""


def table_of(session: Session) -> pd.DataFrame:
    """With the laboratory's own names."""
    table = pd.read_csv(io.BytesIO(good_csv(session)))
    return table.rename(columns=NAMES)[list(NAMES.values())]


def content(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False).encode()


def test_files_with_the_same_columns_are_read_with_one_table(session: Session) -> None:
    good = table_of(session)
    gap = good.copy()
    gap.loc[400:405, "enc_1 [rad]"] = np.nan
    for name, table in (("a.csv", good), ("b.csv", gap), ("c.csv", good)):
        assert not session.recordings.upload(name, content(table)).result()
    waiting = waiting_of(session)
    assert waiting.files == ("a.csv", "b.csv", "c.csv")
    assert session.recordings.read_waiting().result(), session.message.text
    specs = session.document.scenario.recordings
    assert [spec.file for spec in specs] == ["a.csv", "b.csv", "c.csv"]
    assert len({str(spec.columns) for spec in specs}) == 1
    assert [spec.gaps is not None for spec in specs] == [False, True, False]
    session.check.close()


def test_an_uneven_clock_is_no_dead_end(session: Session) -> None:
    table = table_of(session)
    rng = np.random.default_rng(0)
    table["clock"] += STEP * rng.uniform(-0.3, 0.3, len(table))
    table = table.drop(index=range(300, 306))
    assert not session.recordings.upload("rig.csv", content(table)).result()
    waiting = waiting_of(session)
    assert "uneven" in waiting.rows[0].uneven
    assert session.recordings.read_waiting().result(), session.message.text
    spec = session.document.scenario.recordings[-1]
    assert spec.resample is not None and spec.resample.how == "interpolate"
    assert spec.gaps is not None and spec.gaps.longest > 6 * STEP * 0.9
    assert session.wait_idle() and session.playback.recording is not None
    assert "Resampled to" in " ".join(session.playback.recording.warnings)
    session.check.close()


def test_a_choice_of_clock_gaps_and_rate_is_written_into_the_scenario(session: Session) -> None:
    table = table_of(session)
    table["clock"] += STEP * np.random.default_rng(0).uniform(-0.3, 0.3, len(table))
    table.loc[400:405, "enc_1 [rad]"] = np.nan
    session.recordings.upload("rig.csv", content(table)).result()
    session.recordings.answer(clock="count", gaps="cut", rate=500.0)
    assert session.recordings.read_waiting().result(), session.message.text
    spec = session.document.scenario.recordings[-1]
    assert spec.resample is not None and (spec.resample.how, spec.resample.rate) == ("count", 500.0)
    assert spec.gaps is not None and spec.gaps.how == "cut"
    session.check.close()


def test_the_picture_of_a_slow_camera_shows_its_samples(session: Session) -> None:
    table = table_of(session)
    camera = table["cam_x [m]"].copy()
    table.loc[np.arange(len(table)) % 997 != 990, "cam_x [m]"] = np.nan
    session.recordings.upload("slow.csv", content(table)).result()
    inspection = waiting_of(session).inspection
    assert inspection is not None
    rows, values = inspection.pictures["cam_x [m]"]
    assert list(rows) == list(range(990, len(table), 997))
    assert np.allclose(values, camera[rows.astype(int)])
    drawn = as_in_file(inspection.pictures, "clock", ["cam_x [m]"])
    assert drawn is not None
    assert np.allclose(drawn["data"][0]["x"], table["clock"][rows.astype(int)], atol=STEP)
    times = {"clock": inspection.pictures["clock"]}
    assert as_in_file(times, "clock", []) is None, "times alone have nothing to draw"


def test_a_file_with_other_columns_is_asked_about_next(session: Session) -> None:
    one = table_of(session)
    other = one.rename(columns={"clock": "zeit"})
    session.recordings.upload("a.csv", content(one)).result()
    session.recordings.upload("b.csv", content(other)).result()
    session.recordings.upload("c.csv", content(one)).result()
    session.recordings.upload("d.csv", content(other)).result()
    assert waiting_of(session).files == ("a.csv", "c.csv")
    pressed_twice = session.recordings.read_waiting(), session.recordings.read_waiting()
    assert [one.result() for one in pressed_twice] == [True, False]
    assert waiting_of(session).files == ("b.csv", "d.csv")
    assert session.recordings.read_waiting().result() and session.recordings.waiting is None
    files = [spec.file for spec in session.document.scenario.recordings]
    assert files == ["a.csv", "c.csv", "b.csv", "d.csv"]
    session.recordings.upload("e.csv", content(one)).result()
    session.recordings.upload("f.csv", content(other)).result()
    session.recordings.leave_waiting()
    assert session.recordings.waiting is None
    assert sorted(path.name for path in session.folder.glob("*.csv")) == sorted(files)


def test_a_bad_file_among_good_ones_is_named_and_the_others_are_read(session: Session) -> None:
    good = table_of(session)
    bad = good.copy()
    bad["clock"] = np.r_[good["clock"][:1500], good["clock"][: len(good) - 1500]]
    for name, table in (("a.csv", good), ("b.csv", bad)):
        session.recordings.upload(name, content(table)).result()
    assert session.recordings.read_waiting().result() and session.recordings.waiting is None
    assert session.message.bad and session.message.text.startswith("b.csv: column clock decreases")
    assert [spec.file for spec in session.document.scenario.recordings] == ["a.csv"]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (Rows(), {}),
        (Rows({"a": 1}, 0.005), {"gaps": {"how": "interpolate"}}),
        (Rows({"a": 1}, 0.1), {"gaps": {"how": "mask", "longest": 0.101}}),
        (Rows(uneven="x"), {"resample": {"how": "interpolate"}}),
    ],
)
def test_what_is_proposed_for_rows(rows: Rows, expected: dict[str, object]) -> None:
    assert settings(rows) == expected
    assert GapsSpec(how="interpolate").longest == SHORT_GAP
