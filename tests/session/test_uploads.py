"""Files that a person brings."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.rig_spec import SensorsSpec
from flexgui.jobs import JobPool
from flexgui.server.services import Services
from flexgui.session.scenario_edits import apply_edits, set_value
from flexgui.session.session import Session
from flexgui.stages.challenge.state import Challenge
from flexgui.stages.data import state as uploading
from flexgui.stages.data.uploads import safe_name, scenario_file, unpacked, zipped
from tests.session.conftest import UPLOAD_LIMIT
from tests.session.helpers import HIDDEN_FRICTION, bring, good_csv, waiting_of, worked


def lines(content: bytes) -> list[str]:
    return content.decode().splitlines()


BAD = {
    "empty": (lambda good: b"", "is empty"),
    "unit": (lambda good: good.replace(b"z1 [m]", b"z1 [kg]", 1), "z1"),
    "hole": (lambda good: "\n".join([*lines(good)[:5], ",,"]).encode(), "row"),
    "text": (lambda good: b"name,comment\nAnna,fine\nBen,late\n", "no column of numbers"),
    "large": (lambda good: good + b" " * UPLOAD_LIMIT, "MB"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_leaves_one_sentence_and_nothing_else(session: Session, case: str) -> None:
    make, said = BAD[case]
    before = session.document.scenario
    content = make(good_csv(session))
    assert not session.recordings.upload(f"{case}.csv", content).result()
    assert session.message.bad and said in session.message.text
    assert case in session.message.text and "\n" not in session.message.text
    assert session.document.scenario == before
    assert not list(session.folder.iterdir())


def test_why_a_file_was_not_read_stands_until_the_next_is_brought(session: Session) -> None:
    """Beside the button, where only "uploaded successfully" was seen."""
    good = good_csv(session)
    for name in ("empty.csv", "empty2.csv"):
        assert not session.recordings.upload(name, b"").result()
        assert session.recordings.refused == (session.message.text,)
        assert name in session.message.text
    assert session.recordings.upload("good.csv", good).result()
    assert session.recordings.refused == ()


def test_a_text_among_numbers_is_named_and_no_text_is_asked_about(session: Session) -> None:
    """With file, column and line; a column of words was offered as a signal."""
    table = pd.read_csv(io.BytesIO(good_csv(session))).rename(columns={"theta1": "enc_1"})
    table["enc_1"] = table["enc_1"].astype(object)
    table.loc[100, "enc_1"] = "#####"
    table["gripper"] = "open"
    content = table.to_csv(index=False).encode()
    assert not session.recordings.upload("slip.csv", content).result()
    waiting = waiting_of(session)
    assert not {"enc_1", "gripper"} & {*waiting.headers, *waiting.unused}
    assert waiting.inspection is not None
    assert waiting.inspection.unread == (
        "slip.csv: column enc_1 holds '#####' in data row 101 (line 102); write a number there.",
    )


def test_rows_out_of_order_are_not_refused_but_asked_about(session: Session) -> None:
    rows = good_csv(session).splitlines(keepends=True)
    swapped = b"".join([*rows[:9], rows[10], rows[9], *rows[11:]])
    assert not session.recordings.upload("unsorted.csv", swapped).result()
    assert not session.message.bad
    assert "resample" in waiting_of(session).settings()
    assert session.recordings.read_waiting().result()
    assert [spec.file for spec in session.document.scenario.recordings] == ["unsorted.csv"]


def test_a_file_that_our_own_fault_keeps_from_being_read_is_not_blamed(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    content = good_csv(session)
    with monkeypatch.context() as broken:
        broken.setattr(uploading, "waiting_for", fails)
        assert not session.recordings.upload("own.csv", content).result()
    assert session.message.bad and "a fault of FlexGUI" in session.message.text
    assert session.recordings.upload("own.csv", content).result()


def test_a_good_file_becomes_a_recording_and_is_shown(session: Session) -> None:
    assert bring(session, "th1.csv", good_csv(session))
    assert session.document.scenario.recordings[-1].file == "th1.csv"
    assert session.wait_idle()
    assert session.playback.recording is not None and session.playback.recording.name == "th1"
    assert session.playback.motion is not None and session.playback.motion.ghost is not None


def test_an_arrived_file_is_no_recording_before_its_place_is_chosen(session: Session) -> None:
    worked(session)
    before = session.document.scenario
    assert session.recordings.upload("own.csv", good_csv(session)).result()
    assert session.document.scenario == before and len(session.recordings.imports.pending) == 1
    session.recordings.imports.cancel()
    assert session.document.scenario == before and not session.recordings.imports.pending
    assert not list(session.folder.iterdir())


def test_what_nobody_has_touched_makes_room_without_a_question(session: Session) -> None:
    assert session.recordings.upload("own.csv", good_csv(session)).result()
    scenario, imports = session.document.scenario, session.recordings.imports
    assert [spec.file for spec in scenario.recordings] == ["own.csv"]
    assert not imports.pending and session.replaced.left is None
    assert scenario.identify.parameters == ("EI1", "EI2") and scenario.identify.output is None
    assert scenario.model.level == "nonlinear", "so that everything measured is compared"
    assert scenario.sensors == SensorsSpec(), "what was simulated says nothing of them"


def test_what_a_person_has_stated_is_kept_with_their_recordings(session: Session) -> None:
    session.document.change(
        set_value(("identify", "parameters"), ["m1"]), set_value(("identify", "bounds"), None)
    )
    assert session.recordings.upload("own.csv", good_csv(session)).result()
    assert session.document.scenario.identify.parameters == ("m1",)


def test_used_alone_it_takes_the_place_of_the_others_which_can_be_brought_back(
    session: Session,
) -> None:
    worked(session)
    before = session.document.scenario
    assert session.recordings.upload("own.csv", good_csv(session)).result()
    assert session.recordings.imports.use(alone=True)
    own = session.document.scenario
    assert [s.file for s in own.recordings] == ["own.csv"]
    assert session.replaced.back() and session.document.scenario == before
    assert session.replaced.back() and session.document.scenario == own


def test_files_that_arrive_wait_for_one_answer_and_later_ones_for_none(session: Session) -> None:
    worked(session)
    content, imports = good_csv(session), session.recordings.imports
    for name in ("a.csv", "b.csv"):
        assert session.recordings.upload(name, content).result() and imports.pending
    assert imports.use(alone=True)
    assert session.recordings.upload("a.csv", content).result() and not imports.pending
    files = [s.file for s in session.document.scenario.recordings]
    assert files == ["a.csv", "b.csv", "a-2.csv"]
    session.choose("demo")
    worked(session)
    assert session.recordings.upload("a.csv", content).result() and imports.pending


def test_a_zip_of_scenario_and_recordings_can_be_brought_back(session: Session) -> None:
    content = good_csv(session)
    bring(session, "th1.csv", content)
    name, data = scenario_file(session.document.scenario, session.folder)
    assert name.endswith(".zip")
    (session.folder / "th1.csv").unlink()
    session.choose("demo")
    assert session.recordings.upload(name, data).result()
    assert session.document.scenario.recordings[-1].file == "th1.csv"
    assert (session.folder / "th1.csv").read_bytes() == content


def test_a_challenge_waits_while_own_recordings_are_used_alone(session: Session) -> None:
    known = session.challenge.state = Challenge(4, "easy", HIDDEN_FRICTION)
    assert session.recordings.upload("own.csv", good_csv(session)).result()
    assert session.recordings.imports.use(alone=True) and session.challenge.state is None
    assert session.replaced.back() and session.challenge.state == known


@pytest.mark.parametrize("content", [b"no zip at all", zipped({"a.csv": b"t"})])
def test_a_bad_zip_is_refused_in_words(session: Session, content: bytes) -> None:
    before = session.document.scenario
    assert not session.recordings.upload("work.zip", content).result()
    assert session.message.bad and "work.zip" in session.message.text
    assert session.document.scenario == before


def archive(kind: int, **files: bytes) -> bytes:
    """A zip packed in one of the ways that there are."""
    room = io.BytesIO()
    with zipfile.ZipFile(room, "w", kind) as made:
        for name, content in files.items():
            made.writestr(name.replace("_", "."), content)
    return room.getvalue()


PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)


@pytest.mark.parametrize("kind", PACKED)
def test_a_zip_with_wrong_bytes_is_refused_in_words_or_read(kind: int, tmp_path: Path) -> None:
    """Every third byte wrong once, in the packed data and in the directory."""
    rng = np.random.default_rng(kind)
    whole = archive(kind, a_toml=b"title = 3\n" * 20, b_csv=rng.bytes(200))
    refused = 0
    for place in range(0, len(whole), 3):
        folder = tmp_path / str(place)
        folder.mkdir()
        damaged = bytearray(whole)
        damaged[place] ^= 0xA5
        (folder / "work.zip").write_bytes(damaged)
        try:
            unpacked(folder / "work.zip", folder, UPLOAD_LIMIT)
        except InputError as error:
            refused += 1
            assert "work.zip" in str(error) and "\n" not in str(error)
            assert [path.name for path in folder.iterdir()] == ["work.zip"]
    assert refused > len(whole) / 9


def test_a_zip_that_lies_about_its_sizes_is_counted(tmp_path: Path) -> None:
    zeros = bytes(40 * UPLOAD_LIMIT)
    whole = bytearray(archive(zipfile.ZIP_DEFLATED, a_toml=zeros))
    for mark, place in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
        at = whole.index(mark) + place
        whole[at : at + 4] = struct.pack("<I", 4 * UPLOAD_LIMIT + 5)
    (tmp_path / "work.zip").write_bytes(whole)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"work\.zip (holds more than|is not a zip)"):
            unpacked(tmp_path / "work.zip", tmp_path, UPLOAD_LIMIT)
        assert tracemalloc.get_traced_memory()[1] < UPLOAD_LIMIT
    finally:
        tracemalloc.stop()
    assert [path.name for path in tmp_path.iterdir()] == ["work.zip"]


def test_a_zip_with_the_name_of_a_folder_is_refused_in_words(session: Session) -> None:
    """As a session has them for its reports and studies."""
    (session.folder / "export").mkdir()
    content = archive(zipfile.ZIP_STORED, a_toml=b"title = 3\n", export=b"t\n0\n")
    assert not session.recordings.upload("work.zip", content).result()
    assert "export cannot be written" in session.message.text and session.message.bad


@given(st.text(max_size=200))
def test_a_name_never_leaves_the_folder(name: str) -> None:
    plain = safe_name(name)
    assert plain and "/" not in plain and "\\" not in plain and not plain.startswith(".")
    assert (Path("/room") / plain).parent == Path("/room")


def test_a_scenario_waits_for_the_recordings_that_come_after_it(session: Session) -> None:
    content = good_csv(session)
    text = scenario_toml(
        apply_edits(
            session.document.scenario,
            set_value(("recordings",), [{"file": "one.csv"}, {"file": "two.csv"}]),
        )
    )
    assert session.recordings.upload("mine.toml", text.encode()).result()
    assert not session.message.bad and "one.csv, two.csv" in session.message.text
    assert session.wait_idle() and not session.message.bad
    assert session.recordings.upload("two.csv", content).result()
    assert session.recordings.imports.missing == ("one.csv",)
    assert session.recordings.upload("one.csv", content).result()
    assert "all recordings are here" in session.message.text
    assert len(session.document.scenario.recordings) == 2
    assert session.wait_idle() and session.playback.recording is not None


ROWS = 1_330_000
LONG = 240.0
"""s, on a busy machine."""


@pytest.mark.long
def test_as_many_numbers_as_an_upload_may_hold_become_a_recording_and_are_played(
    tmp_path: Path, job_pool: JobPool
) -> None:
    """A text of seventy megabytes; the workers' memory is limited."""
    t = np.arange(ROWS) / 5000.0
    speeds = [0.4 * np.sign(np.sin(2.0 * np.pi * f * t)) for f in (0.7, 0.9)]
    theta = np.cumsum(speeds, axis=1) / 5000.0 + np.array([[0.0], [1.0]])
    z = np.cumsum([0.5 * f(np.cumsum(theta, axis=0)) for f in (np.cos, np.sin)], axis=1)[:, -1]
    names = ("t", "dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
    table = pd.DataFrame(dict(zip(names, (t, *speeds, *theta, *z), strict=True)))
    session = Session("long", tmp_path, Services(job_pool))
    content = table.round(6).to_csv(index=False).encode()
    assert session.recordings.upload("long.csv", content).result(LONG), session.message
    session.playback.refresh()
    assert session.wait_idle(LONG) and not session.message.bad, session.message
    assert session.playback.recording is not None and session.playback.motion is not None
    assert len(session.playback.recording.time) == ROWS
    session.close()
