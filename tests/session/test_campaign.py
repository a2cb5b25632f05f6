"""Several files at once: one table of columns for all that share them, each with its own gaps."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest

from flexgui.core.recording.spec import GapsSpec
from flexgui.session.session import Session
from flexgui.stages.data.rows import SHORT_GAP, Rows, settings
from tests.session.helpers import good_csv, waiting_of

NAMES = {
    "t [s]": "clock", "dtheta1_ref": "vel_cmd_1", "dtheta2_ref": "vel_cmd_2",
    "theta1": "enc_1 [rad]", "theta2": "enc_2 [rad]", "z1 [m]": "cam_x [m]", "z2 [m]": "cam_y [m]",
}  # fmt: skip
STEP = 1e-3
"""s, of the recording."""


def foreign(session: Session) -> pd.DataFrame:
    """With the laboratory's own names."""
    table = pd.read_csv(io.BytesIO(good_csv(session)))
    return table.rename(columns=NAMES)[list(NAMES.values())]


def content(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False).encode()


def test_files_with_the_same_columns_are_read_with_one_table(session: Session) -> None:
    good = foreign(session)
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
    table = foreign(session)
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
    table = foreign(session)
    table["clock"] += STEP * np.random.default_rng(0).uniform(-0.3, 0.3, len(table))
    table.loc[400:405, "enc_1 [rad]"] = np.nan
    session.recordings.upload("rig.csv", content(table)).result()
    session.recordings.answer(clock="count", gaps="cut", rate=500.0)
    assert session.recordings.read_waiting().result(), session.message.text
    spec = session.document.scenario.recordings[-1]
    assert spec.resample is not None and (spec.resample.how, spec.resample.rate) == ("count", 500.0)
    assert spec.gaps is not None and spec.gaps.how == "cut"
    session.check.close()


def test_a_file_with_other_columns_is_asked_about_next(session: Session) -> None:
    one = foreign(session)
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


def test_a_bad_file_among_good_ones_is_named_and_the_others_are_read(session: Session) -> None:
    good = foreign(session)
    bad = good.copy()
    bad["clock"] = np.r_[good["clock"][:1500], good["clock"][: len(good) - 1500]]
    for name, table in (("a.csv", good), ("b.csv", bad)):
        session.recordings.upload(name, content(table)).result()
    assert session.recordings.read_waiting().result() and session.recordings.waiting is None
    assert session.message.bad and session.message.text.startswith("b.csv: column clock decreases")
    assert [spec.file for spec in session.document.scenario.recordings] == ["a.csv"]


def test_what_is_left_leaves_no_file_behind(session: Session) -> None:
    one = foreign(session)
    session.recordings.upload("a.csv", content(one)).result()
    session.recordings.upload("b.csv", content(one)).result()
    session.recordings.upload("c.csv", content(one.rename(columns={"clock": "zeit"}))).result()
    session.recordings.leave_waiting()
    assert session.recordings.waiting is None and not list(session.folder.glob("*.csv"))


def test_the_short_gap_is_that_of_the_scenario() -> None:
    assert GapsSpec(how="interpolate").longest == SHORT_GAP


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
