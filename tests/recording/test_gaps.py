"""Empty cells of encoders: bridged, left out or cut off, as the scenario says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording.clock import bridged, longest_complete, runs
from flexgui.core.recording.load import load_recording, load_unchecked
from flexgui.core.recording.spec import RecordingSpec
from flexgui.stages.data.rows import parted, rows, settings

N, DT = 200, 1e-3
GAP = slice(50, 56)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """One ramp with six empty cells, and a camera with fewer samples."""
    t = DT * np.arange(N)
    rows = ["t,theta1,z1"]
    for k in range(N):
        theta = "" if GAP.start <= k < GAP.stop else f"{2.0 * t[k]:.9g}"
        rows.append(f"{t[k]:.9g},{theta},{0.1 if k % 5 == 0 else ''}")
    path = tmp_path / "rig.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def spec(**gaps: object) -> RecordingSpec:
    return RecordingSpec.model_validate({"file": "rig.csv", **({"gaps": gaps} if gaps else {})})


def test_without_a_word_on_gaps_they_are_refused(file: Path) -> None:
    with pytest.raises(InputError, match=r"theta1 is empty in data row 51 .*state what happens"):
        load_recording(file, spec())


def test_straight_lines_bridge_a_short_gap(file: Path) -> None:
    found = load_recording(file, spec(how="interpolate"))
    assert found["theta1"] == pytest.approx(2.0 * found.time, abs=1e-12)
    assert found.mask("theta1").all()
    assert "6 cells bridged" in " ".join(found.warnings)
    with pytest.raises(InputError, match=r"gap from 0.05 s on that is longer than gaps.longest"):
        load_recording(file, spec(how="interpolate", longest=0.004))


def test_a_reference_is_held_over_a_gap(tmp_path: Path) -> None:
    """A drive keeps what it was asked for last; a straight line is a command that nobody gave."""
    lines = [f"{DT * k:.9g},0,{'' if k in (5, 6) else k}" for k in range(20)]
    (tmp_path / "rig.csv").write_text("\n".join(["t,theta1,dtheta1_ref", *lines]) + "\n")
    found = load_recording(tmp_path / "rig.csv", spec(how="mask"))
    assert found["dtheta1_ref"][3:9].tolist() == [3, 4, 4, 4, 7, 8]


def test_a_file_with_a_long_gap_becomes_two_recordings() -> None:
    time = np.r_[np.arange(0.0, 0.8, DT), np.arange(0.92, 2.0, DT)]
    found = rows({"t": time, "a": time}, {"t": "t", "theta1": "a"}, {})
    entries = parted({"file": "rig.csv", **settings(found)})
    assert [e["name"] for e in entries] == ["rig 1", "rig 2"]
    assert [e["window"][1] - e["window"][0] for e in entries] == pytest.approx(
        [0.8, 1.08], abs=0.01
    )
    assert all(RecordingSpec.model_validate(e).gaps is not None for e in entries)


def test_masked_gaps_do_not_count_or_the_longest_complete_part_is_kept(file: Path) -> None:
    masked = load_recording(file, spec(how="mask")).mask("theta1")
    assert np.flatnonzero(~masked).tolist() == list(range(GAP.start, GAP.stop))
    found = load_recording(file, spec(how="cut"))
    assert found.time[0] == pytest.approx(GAP.stop * DT) and len(found.time) == N - GAP.stop
    assert np.isnan(found["z1"]).any()  # a slower camera has no gaps
    raw = load_unchecked(file, spec(how="cut"))
    assert raw.time is not None and raw.time[0] == found.time[0], "the check sees the same part"
    assert np.isfinite(raw.channels["theta1"]).all()


def test_runs_and_their_ends() -> None:
    empty = np.array([1, 0, 0, 1, 1, 0], dtype=bool)
    assert runs(empty) == [(0, 1), (3, 5)]
    assert longest_complete([empty], 6) == slice(1, 3)
    values = np.where(empty[1:], np.nan, np.arange(5.0))
    assert np.array_equal(bridged(values, 2), np.arange(5.0))
    assert np.array_equal(bridged(values, 1), values, equal_nan=True)
    ends = np.where(empty, np.nan, np.arange(6.0))
    assert np.array_equal(np.isnan(bridged(ends, 9)), np.arange(6) == 0)
