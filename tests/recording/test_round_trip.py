import numpy as np
import pytest
from scipy.io import savemat

from flexgui.core.errors import InputError
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import RecordingSpec

GRID_ROUNDING = 1e-12
"""s; reading puts the times on an even grid, which differs by rounding only."""
DEGREES_ROUNDING = 1e-14
"""Relative; to degrees and back is two roundings."""

FORMATS = ["th1.csv", "th1.csv.gz", "th1.parquet", "TH1.CSV"]


@pytest.mark.parametrize("file", FORMATS)
def test_what_is_saved_is_read_back(recording, tmp_path, file):
    save_recording(recording, tmp_path / file)
    assert [path.name for path in tmp_path.iterdir()] == [file]
    again = load_recording(tmp_path / file, RecordingSpec(file=file))
    assert set(again.channels) == set(recording.channels)
    np.testing.assert_allclose(again.time, recording.time, atol=GRID_ROUNDING)
    for name, values in recording.channels.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


def test_other_units_are_written_and_read_back(recording, tmp_path):
    path = tmp_path / "th1.csv"
    save_recording(recording, path, units={"theta1": "deg", "t": "ms"})
    assert path.read_text().startswith("t [ms],")
    again = load_recording(path, RecordingSpec(file="th1.csv"))
    np.testing.assert_allclose(again["theta1"], recording["theta1"], rtol=DEGREES_ROUNDING)
    np.testing.assert_allclose(again.time, recording.time, atol=GRID_ROUNDING)


@pytest.mark.parametrize("packed", [False, True], ids=["plain", "packed"])
@pytest.mark.parametrize("struct", [False, True], ids=["vectors", "one struct"])
def test_mat_file_is_read_with_its_units(recording, tmp_path, struct, packed):
    vectors = {"t": recording.time, **recording.channels}
    vectors["theta1"] = np.rad2deg(vectors["theta1"])
    inside = {"rig": vectors} if struct else vectors
    content = {**inside, "units": {"theta1": "deg"}}
    savemat(tmp_path / "th1.mat", content, do_compression=packed)
    again = load_recording(tmp_path / "th1.mat", RecordingSpec(file="th1.mat"))
    np.testing.assert_allclose(again["theta1"], recording["theta1"], rtol=DEGREES_ROUNDING)
    np.testing.assert_array_equal(again["z1"], recording["z1"])


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"])
def test_every_kind_of_number_in_a_mat_file_is_read(tmp_path, kind):
    counts = np.arange(40, dtype=kind)
    savemat(tmp_path / "th1.mat", {"t": 1e-3 * np.arange(40), "theta1": counts})
    again = load_recording(tmp_path / "th1.mat", RecordingSpec(file="th1.mat"))
    np.testing.assert_array_equal(again["theta1"], np.arange(40))


def test_what_a_mat_file_holds_besides_vectors_does_no_harm(recording, tmp_path):
    other = {"note": "hello", "cells": np.array(["a", 1], dtype=object), "deep": {"a": {"b": {}}}}
    vectors = {"t": recording.time, **recording.channels, "M": np.eye(3), "w": [1j, 2j],
               "gains": [60.0, 30.0]}  # fmt: skip
    savemat(tmp_path / "th1.mat", {**vectors, **other})
    again = load_recording(tmp_path / "th1.mat", RecordingSpec(file="th1.mat"))
    assert set(again.channels) == set(recording.channels)
    assert any("gains" in warning for warning in again.warnings)


def test_unknown_kind_of_file_is_not_written(recording, tmp_path):
    with pytest.raises(InputError, match=r"th1\.xlsx"):
        save_recording(recording, tmp_path / "th1.xlsx")
    assert not list(tmp_path.iterdir())


def test_same_recording_gives_the_same_bytes(recording, tmp_path):
    for name in ("a.csv.gz", "b.csv.gz"):
        save_recording(recording, tmp_path / name)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
