"""Rows that are not even in time: put on an even clock by a method that is stated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexgui.core.check.run_checks import check_file, check_scenario
from flexgui.core.errors import InputError
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.read import parse_scenario

N, DT = 2000, 1e-3
SPLINE = 2e-6
"""rad: (2 pi 5 Hz 1.6 ms)^4 5/384 of the amplitude is 8e-8; near the ends it is worse."""
ENDS = 5
"""Samples beside an end, where the spline knows one side only."""


def theta(t: np.ndarray) -> np.ndarray:
    return 0.5 + np.asarray(np.sin(2.0 * np.pi * 5.0 * t))


def reference(t: np.ndarray) -> np.ndarray:
    """Steps of 20 ms."""
    return 0.3 * (-1.0) ** np.floor(t / 0.02 + 1e-9)


def table(t: np.ndarray) -> pd.DataFrame:
    camera = np.full(len(t), np.nan)
    camera[::20] = theta(t[::20])
    return pd.DataFrame({"t": t, "dtheta1_ref": reference(t), "theta1": theta(t), "z1": camera})


def read(path: Path, rows: pd.DataFrame, **settings: object) -> Recording:
    file = path / "rig.csv"
    rows.to_csv(file, index=False)
    return load_recording(file, RecordingSpec.model_validate({"file": "rig.csv", **settings}))


def jittered(seed: int = 0, size: float = 0.3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return DT * (np.arange(N) + np.r_[0.0, rng.uniform(-size, size, N - 2), 0.0])


EVEN = {"resample": {"how": "interpolate"}}


def test_a_jittered_clock_is_made_even_and_the_motion_stays(tmp_path: Path) -> None:
    rows = table(jittered())
    with pytest.raises(InputError, match=r'set resample = \{ how = "interpolate" \}'):
        read(tmp_path, rows)
    found = read(tmp_path, rows, **EVEN)
    assert len(found.time) == N
    assert found.sample_time == pytest.approx(DT, rel=1e-6)
    assert np.ptp(np.diff(found.time)) < 1e-12
    off = np.abs(found["theta1"] - theta(found.time))
    assert np.max(off[ENDS:-ENDS]) < SPLINE
    assert "cubic spline" in " ".join(found.warnings)


def test_held_references_keep_the_motion_that_they_command(tmp_path: Path) -> None:
    t = jittered()
    found = read(tmp_path, table(t), **EVEN)
    commanded = np.append(0.0, np.cumsum(reference(t)[:-1] * np.diff(t)))
    now = np.append(0.0, np.cumsum(found["dtheta1_ref"])[:-1] * found.sample_time)
    assert np.max(np.abs(now - np.interp(found.time, t, commanded))) < 1e-9


def test_an_even_clock_is_left_as_it_is(tmp_path: Path) -> None:
    rows = table(DT * np.arange(N))
    before, after = read(tmp_path, rows), read(tmp_path, rows, **EVEN)
    assert after.time == pytest.approx(before.time, abs=1e-12)
    assert np.array_equal(after["dtheta1_ref"], before["dtheta1_ref"])
    assert after["theta1"] == pytest.approx(before["theta1"], abs=1e-9)
    assert np.array_equal(after["z1"], before["z1"], equal_nan=True)


def test_repeated_and_unsorted_rows_are_put_in_order(tmp_path: Path) -> None:
    rows = table(DT * np.arange(N))
    mixed = pd.concat([rows[:100], rows[90:100], rows[101:102], rows[100:101], rows[102:]])
    found = read(tmp_path, mixed, **EVEN)
    assert len(found.time) == N
    assert found["theta1"] == pytest.approx(theta(found.time), abs=SPLINE)
    assert "10 rows with an empty or repeated timestamp left out" in " ".join(found.warnings)


def test_missing_rows_become_gaps_of_which_the_user_decides(tmp_path: Path) -> None:
    rows = table(DT * np.arange(N)).drop(index=range(500, 510))
    with pytest.raises(InputError, match=r"resampled table.*gaps = \{ how = \"mask\" \}"):
        read(tmp_path, rows, **EVEN)
    masked = read(tmp_path, rows, **EVEN, gaps={"how": "mask"})
    assert np.flatnonzero(~masked.mask("theta1")).tolist() == list(range(500, 510))
    cut = read(tmp_path, rows, **EVEN, gaps={"how": "cut"})
    assert cut.time[0] == pytest.approx(0.51) and len(cut.time) == N - 510


def test_counted_rows_keep_their_values(tmp_path: Path) -> None:
    rows = table(DT * np.arange(N))
    rows["t"] = np.floor(rows["t"] / 4e-3 + 1e-9) * 4e-3  # stamps of a clock of 250 Hz
    rows.loc[N - 1, "t"] = DT * (N - 1)
    found = read(tmp_path, rows, resample={"how": "count"})
    assert found.sample_time == pytest.approx(DT, rel=1e-9)
    assert found["theta1"] == pytest.approx(rows["theta1"].to_numpy(), abs=1e-9)
    assert np.array_equal(found["dtheta1_ref"], rows["dtheta1_ref"])
    with pytest.raises(InputError, match="rows are missing; use resample"):
        read(tmp_path, rows.drop(index=range(500, 510)), resample={"how": "count"})


def test_channels_with_rates_of_their_own_share_the_densest_clock(tmp_path: Path) -> None:
    """Rows of three loggers one after another, each with its own cells."""
    fast = pd.DataFrame({"t": DT * np.arange(N)})
    fast["theta1"] = theta(fast["t"].to_numpy())
    slow = pd.DataFrame({"t": 0.31e-3 + 4e-3 * np.arange(N // 4)})
    slow["theta2"] = theta(slow["t"].to_numpy())
    given = pd.DataFrame({"t": 0.02 * np.arange(N // 20)})
    given["dtheta1_ref"] = reference(given["t"].to_numpy())
    rows = pd.concat([fast, slow, given]).sort_values("t", kind="stable")
    merged = rows.groupby("t", as_index=False).first()
    found = read(tmp_path, merged, **EVEN, gaps={"how": "cut"})
    assert found.sample_time == pytest.approx(DT, rel=1e-6)
    inside = slice(20, -20)
    assert np.max(np.abs(found["theta2"] - theta(found.time))[inside]) < 1e-4
    held = reference(found.time)
    assert np.mean(np.abs(found["dtheta1_ref"] - held) > 1e-9) < 0.06  # but for one row in twenty


def test_a_fast_log_is_thinned_and_nothing_is_folded(tmp_path: Path) -> None:
    t = 1e-4 * np.arange(10 * N)
    rows = table(t)
    rows["theta1"] += 0.1 * np.sin(2.0 * np.pi * 980.0 * t)
    found = read(tmp_path, rows, resample={"rate": 1000.0})
    assert found.sample_time == pytest.approx(DT, rel=1e-9)
    off = np.abs(found["theta1"] - theta(found.time))
    assert np.max(off[20:-20]) < 1e-4 * 1.5  # 80 dB
    assert np.array_equal(found["dtheta1_ref"], reference(found.time))
    assert np.isfinite(found["z1"]).sum() == len(t) // 20
    assert "Kaiser" in " ".join(found.warnings)


def test_a_camera_that_does_not_fit_the_new_rate_keeps_all_its_samples(tmp_path: Path) -> None:
    rows = table(1e-4 * np.arange(10 * N))
    rows["z1"] = np.nan
    rows.loc[3::333, "z1"] = 1.0
    found = read(tmp_path, rows, resample={"rate": 1000.0})
    assert np.isfinite(found["z1"]).sum() == rows["z1"].notna().sum()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: np.r_[t[:-1], 1e9], r"samples of .* are allowed. Cut it with window"),
        (lambda t: np.r_[t[:1000], t[:1000]], r"decreases by .* second recording"),
        (lambda t: np.zeros(N), r"1 different times"),
        (lambda t: np.full(N, np.nan), r"0 different times"),
    ],
)
def test_hopeless_clocks_have_one_sentence(tmp_path: Path, change, said: str) -> None:
    rows = table(DT * np.arange(N))
    rows["t"] = change(rows["t"].to_numpy())
    with pytest.raises(InputError, match=said):
        read(tmp_path, rows, **EVEN)


@pytest.mark.parametrize("spoilt", ["jitter", "dropouts", "repeated_times"])
def test_what_the_check_offers_mends_what_it_names(tmp_path: Path, spoilt: str) -> None:
    rows = table(DT * np.arange(N))
    if spoilt == "jitter":
        rows["t"] = jittered()
    elif spoilt == "dropouts":
        rows = rows.drop(index=range(500, 505))
    else:
        rows = pd.concat([rows[:300], rows[299:300], rows[300:]])
    rows.to_csv(tmp_path / "rig.csv", index=False)
    (said,) = [f for f in check_file(tmp_path / "rig.csv") if (f.fault, f.channel) == (spoilt, "t")]
    text = f"""
title = "One joint"
[arm]
preset = "single_axis"
[drive]
kind = "velocity_loop"
gains = [60.0]
[[recordings]]
file = "rig.csv"
{said.fix}
"""
    after = check_scenario(parse_scenario(text, "a.toml"), tmp_path)
    assert not [f for f in after if f.channel == "t"]
    spec = parse_scenario(text, "a.toml").recordings[0]
    assert len(load_recording(tmp_path / "rig.csv", spec).time) == N


def test_the_window_acts_before_the_clock_is_judged(tmp_path: Path) -> None:
    rows = table(np.r_[DT * np.arange(1500), jittered()[1500:]])
    rows.loc[0:10, "t"] = [-5.0 - 1e-3 * k for k in range(11)]
    found = read(tmp_path, rows, **EVEN, window=[0.1, 2.0])
    assert found.time[0] == pytest.approx(0.1)
