import io

import numpy as np
import pandas as pd
import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording.load import file_stem, load_recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import RecordingSpec

ROUNDING = 1e-12
"""Absolute, for values of the order of one."""
ROWS = 100


def _text(header="t,theta1,z1,z2", time=None, rows=ROWS):
    t = 1e-3 * np.arange(rows) if time is None else time
    lines = [f"{v:.17g},{np.sin(9 * v):.17g},{np.cos(9 * v):.17g},{9 * v:.17g}" for v in t]
    return "\n".join([header, *lines, ""])


def _load(path, **settings):
    return load_recording(path, RecordingSpec(file=path.name, **settings))


def test_headers_with_units_are_converted(write):
    recording = _load(write(_text("t [ms],theta1 [deg],z1 [mm],z2")))
    assert recording.sample_time == pytest.approx(1e-6)
    assert recording["theta1"][50] == pytest.approx(np.deg2rad(np.sin(0.45)), rel=ROUNDING)
    assert recording["z1"][0] == pytest.approx(1e-3)


@pytest.mark.parametrize("header", ["theta1 (deg)", "theta1 [°]", "theta1(deg)"])
def test_a_unit_in_any_brackets_holds_in_every_kind_of_file(write, tmp_path, header):
    text = _text(f"t,{header},z1,z2")
    as_text = _load(write(text))
    pd.read_csv(io.StringIO(text)).to_parquet(tmp_path / "same.parquet")
    as_columns = _load(tmp_path / "same.parquet")
    assert as_text["theta1"][50] == pytest.approx(np.deg2rad(np.sin(0.45)), rel=ROUNDING)
    np.testing.assert_array_equal(as_text["theta1"], as_columns["theta1"])


def test_two_spellings_of_a_unit_are_no_contradiction(write):
    path = write(_text("t,Achse 1 (°/s),z1,z2"))
    loaded = _load(path, columns={"dtheta1_ref": "Achse 1 [deg/s]"})
    assert loaded["dtheta1_ref"][50] == pytest.approx(np.deg2rad(np.sin(0.45)), rel=ROUNDING)
    with pytest.raises(InputError, match="correct one of them"):
        _load(path, columns={"dtheta1_ref": "Achse 1 [rad/s]"})


@pytest.mark.parametrize(
    ("file", "name"),
    [("chirp_0.5Hz.csv", "chirp_0.5Hz"), ("chirp_0.5Hz.csv.gz", "chirp_0.5Hz"), (".csv", ".csv")],
)
def test_a_recording_has_the_name_of_its_file(file, name):
    assert file_stem(f"data/{file}") == name


def test_columns_are_mapped_with_unit_gain_and_sign(write):
    columns = {"t": "clock", "theta1": {"name": "enc [deg]", "gain": 2.0, "sign": -1}, "z1": "cam"}
    recording = _load(write(_text("clock,enc,cam [mm],theta1")), columns=columns)
    assert recording["theta1"][50] == pytest.approx(-2 * np.deg2rad(np.sin(0.45)))
    assert recording["z1"][0] == pytest.approx(1e-3)
    assert any("theta1" in warning for warning in recording.warnings)


def test_window_keeps_its_rows_only(write):
    lines = _text().splitlines()
    lines[90] = lines[90].replace(lines[90].split(",")[1], "", 1)  # outside it does no harm
    recording = _load(write("\n".join(lines)), window=(0.02, 0.05))
    assert (recording.time[0], recording.time[-1]) == pytest.approx((0.02, 0.05))
    assert len(recording.time) == 31


def test_masked_stretches_do_not_count(write):
    recording = _load(write(_text()), mask={"theta1": [(0.0095, 0.0305)]})
    masked = np.flatnonzero(~recording.mask("theta1"))
    np.testing.assert_array_equal(masked, np.arange(10, 31))
    assert recording.mask("z1").all()


@pytest.mark.parametrize("shift", [0.0, 0.003, 0.0125, -0.004])
def test_time_shift_moves_the_camera_alone(write, shift):
    recording = _load(write(_text()), time_shift=shift)
    sampled = np.isfinite(recording["z2"])
    # z2 = 9 t is a straight line, which linear interpolation follows exactly.
    np.testing.assert_allclose(
        recording["z2"][sampled], 9 * (recording.time + shift)[sampled], atol=ROUNDING
    )
    lost = int(np.ceil(abs(shift) / 1e-3 - 1e-9))
    assert (~sampled).sum() == lost
    assert recording["theta1"][50] == pytest.approx(np.sin(0.45), abs=ROUNDING)


@pytest.mark.parametrize("shift", [0.003, 0.0034, 0.0125])
def test_a_slow_camera_keeps_its_rate_when_shifted(recording, tmp_path, shift):
    save_recording(recording, tmp_path / "th1.csv")
    moved = _load(tmp_path / "th1.csv", time_shift=shift)
    rows = np.flatnonzero(np.isfinite(moved["z1"]))
    assert set(np.diff(rows)) == {10}
    assert len(rows) >= np.isfinite(recording["z1"]).sum() - 2


def test_camera_pose_is_applied(write):
    plain = _load(write(_text()))
    pose = {"origin": (1.0, -2.0), "angle": 0.3, "scale": 0.5}
    posed = _load(write(_text()), camera=pose)
    z = 0.5 * np.exp(0.3j) * (plain["z1"] + 1j * plain["z2"]) + (1 - 2j)
    np.testing.assert_allclose(posed["z1"] + 1j * posed["z2"], z, atol=ROUNDING)
    assert posed.camera.scale == 1.0  # already applied: nobody may apply it again


def test_logger_filter_role_and_working_point_are_kept(write):
    logger = {"theta1": {"frequency": 12.57, "damping": 0.9}}
    settings = {"logger_filter": logger, "role": "validate", "theta2": 0.4}
    recording = _load(write(_text()), camera={"delay": 0.01}, **settings)
    assert recording.logger_filters["theta1"].frequency == 12.57
    assert (recording.role, recording.theta2, recording.camera.delay) == ("validate", 0.4, 0.01)


def test_small_jitter_becomes_an_even_grid(write):
    rng = np.random.default_rng(3)
    time = 1e-3 * np.arange(ROWS) + 4e-6 * rng.uniform(-1, 1, ROWS)
    recording = _load(write(_text(time=time)))
    assert np.ptp(np.diff(recording.time)) < ROUNDING


def test_a_slow_drift_of_the_clock_is_refused(write):
    steps = 1e-3 * (1 + 0.009 * np.where(np.arange(999) < 500, 1, -1))
    time = np.concatenate([[0.0], np.cumsum(steps)])
    with pytest.raises(InputError, match="not uniform"):
        _load(write(_text(time=time, rows=1000)))


def test_a_column_without_any_sample_is_left_out(write):
    lines = [line.rsplit(",", 1)[0] + "," for line in _text().splitlines()[1:]]
    recording = _load(write("\n".join(["t,theta1,z1,z2", *lines, ""])))
    assert not recording.has("z2")
    assert any("z2" in warning for warning in recording.warnings)


def test_warnings_tell_of_constant_sparse_and_unused_columns(write):
    header, *lines = _text("t,theta1,z1,colour").splitlines()
    lines = [f"{line.split(',')[0]},0.5,{'' if k % 2 else 1 + k},1" for k, line in enumerate(lines)]
    text = " ".join(_load(write("\n".join([header, *lines, ""]))).warnings)
    assert "theta1 never changes" in text
    assert "z1 has a sample in 50 %" in text
    assert "colour" in text


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"columns": {"theta2": "thetta1"}}, "no column thetta1 did you mean 'theta1'"),
        ({"columns": {"theta2": "theta1 [m]", "theta1": "z1 [N]"}}, "[N] does not fit"),
        ({"window": (5.0, 6.0)}, "window [5, 6]"),
        ({"mask": {"theta2": [(0.0, 1.0)]}}, "mask theta2"),
        ({"logger_filter": {"u1": {"frequency": 1.0, "damping": 1.0}}}, "logger_filter u1"),
        ({"time_shift": 7.0}, "time_shift"),
    ],
)
def test_settings_that_do_not_fit_the_file_are_named(write, settings, words):
    with pytest.raises(InputError) as caught:
        _load(write(_text()), **settings)
    for word in words.split("  "):
        assert all(part in str(caught.value) for part in word.split(" ")), caught.value


def test_real_recordings_are_read(data_folder):
    joint = {"theta1": "q", "theta1_ref": "q_ref", "u1": "force"}
    emps = load_recording(data_folder / "emps.csv", RecordingSpec(file="emps.csv", columns=joint))
    assert len(emps.time) == 24841
    assert emps.sample_time == pytest.approx(1e-3)
    for file, rows in (("quanser_2dsfl_steps.csv", 9719), ("ctu_2dsfl_lqr.csv", 10000)):
        bench = load_recording(data_folder / file, RecordingSpec(file=file))
        assert len(bench.time) == rows
        assert bench.has("i1", "i2", "theta1", "theta2", "deflection1", "deflection2")
        assert not bench.warnings
