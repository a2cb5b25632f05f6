"""What every excitation in the folder must keep; a new file inherits these tests."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.errors import InputError
from flexgui.core.excitation import build_excitation
from flexgui.core.excitation.excitation import Excitation
from flexgui.core.plugins import classes_of

KINDS = sorted(classes_of("flexgui.core.excitation", Excitation))
DT = 1e-3
SAMPLES = 30_000

CORRELATION = 0.1
"""Five standard deviations of 1500 independent signs are 0.13; the seeds here stay below this."""


def signal(kind: str, seed: int = 1, samples: int = SAMPLES, **options: object) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return build_excitation(kind, options).signal(samples, 2, DT, rng)


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_decides_a_signal_that_reaches_its_amplitude_uncorrelated(kind: str) -> None:
    assert abs(np.corrcoef(*signal(kind).T)[0, 1]) < CORRELATION
    assert np.abs(signal(kind, amplitude=0.2)).max() == pytest.approx(0.2, rel=1e-2)
    assert np.array_equal(signal(kind, seed=3), signal(kind, seed=3))
    assert not np.array_equal(signal(kind, seed=3), signal(kind, seed=4))


@settings(max_examples=20)
@given(
    st.sampled_from(KINDS), st.floats(1e-3, 10.0), st.integers(30, 500), st.integers(1, 3),
    st.floats(1e-4, 0.5), st.integers(0, 1000),
)  # fmt: skip
def test_signals_have_their_shape_and_stay_within_the_amplitude(
    kind: str, amplitude: float, samples: int, joints: int, hold: float, seed: int
) -> None:
    excitation = build_excitation(kind, {"amplitude": amplitude, "hold": hold})
    found = excitation.signal(samples, joints, DT, np.random.default_rng(seed))
    assert found.shape == (samples, joints)
    assert np.abs(found).max() <= amplitude * (1.0 + 1e-12)  # rounding of a division


def test_balanced_prbs_has_no_net_displacement_after_each_pair() -> None:
    displacement = np.cumsum(signal("prbs_balanced"), axis=0)[39::40]
    assert np.abs(displacement).max() < 1e-9  # rounding of sums of 0.3
    assert np.abs(np.cumsum(signal("prbs"), axis=0) * DT).max() > 0.1, "plain PRBS wanders"


@pytest.mark.parametrize("kind", ["prbs", "prbs_balanced"])
def test_prbs_keeps_its_level_for_the_hold(kind: str) -> None:
    found = signal(kind, hold=0.02)
    assert set(np.unique(np.abs(found))) == {0.3}
    changes = np.flatnonzero(np.any(np.diff(found, axis=0), axis=1)) + 1
    assert np.all(changes % 20 == 0)


def test_multisine_repeats() -> None:
    found = signal("multisine", periods=3)
    period = SAMPLES // 3
    assert np.array_equal(found[:period], found[period : 2 * period])
    assert np.array_equal(found[:period], found[2 * period :])


def test_multisine_joints_take_turns_in_frequency_below_the_highest() -> None:
    found = signal("multisine", periods=1, highest_hz=40.0)
    lines = [set(np.flatnonzero(np.abs(np.fft.rfft(column)) > 1e-6)) for column in found.T]
    assert not lines[0] & lines[1]
    assert max(max(each) for each in lines) * 1.0 / (SAMPLES * DT) <= 40.0


def test_chirp_rises_on_one_joint_and_falls_on_the_next() -> None:
    found = signal("chirp", lowest_hz=1.0, highest_hz=20.0)
    crossings = [np.flatnonzero(np.diff(np.sign(column))) for column in found.T]
    first_half = [np.mean(each < SAMPLES / 2) for each in crossings]
    assert first_half[0] < 0.3
    assert first_half[1] > 0.7


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("prbs", {"amplitude": 0.0}, "amplitude"),
        ("prbs", {"amplitude": float("nan")}, "amplitude"),
        ("prbs", {"hold": -0.02}, "hold"),
        ("prbs_balanced", {"holds": 0.02}, "did you mean 'hold'?"),
        ("multisine", {"periods": 0}, "periods"),
        ("multisine", {"periods": 2.5}, "periods"),
        ("multisine", {"highest_hz": 0.0}, "highest_hz"),
        ("chirp", {"lowest_hz": -1.0}, "lowest_hz"),
        ("prbss", {}, "did you mean 'prbs'?"),
        ("multisine", {"periods": 20_000}, "fewer periods"),
    ],
)
def test_bad_settings_are_said_in_one_line(kind: str, options: dict, words: str) -> None:
    with pytest.raises(InputError) as caught:
        signal(kind, **options)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
