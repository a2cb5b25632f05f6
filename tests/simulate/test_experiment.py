"""Simulated recordings: noise as asked for, channels of every sensor, messages."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.stats import spearmanr

from flexgui.core.drives.cascade import Cascade
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor, sensors
from flexgui.core.simulate.experiment import (
    NoiseLevels,
    half_cosine_rate,
    make_task,
    simulate_recording,
    simulation_tolerance,
)
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.nonlinear import DEFAULT_TOLERANCE, NOISE_SHARE, simulate_within
from tests.helpers import ARMS, PAPER, fit_percent, looped, refusal
from tests.marks import long_except
from tests.simulate.test_linear_model import FILTERED

SNR_ERROR = 0.3
"""dB: the variance of 30 000 normal numbers scatters by 0.8 %, 0.04 dB."""

LINEAR = {"level": "lpv", "theta2": 1.2, "seconds": 30.0}


@pytest.mark.parametrize("snr", [5.0, 20.0])
def test_noise_has_the_ratio_asked_for(snr: float) -> None:
    model = looped(PAPER)
    clean = simulate_recording(model, SimulateSpec(**LINEAR), "clean")
    noisy = simulate_recording(model, SimulateSpec(**LINEAR, snr_db=snr), "noisy")
    for channel in ("y1", "y2", "ydot1", "ydot2", "z1", "z2"):
        noise = noisy[channel] - clean[channel]
        ratio = 10.0 * np.log10(clean[channel].var() / noise.var())
        assert ratio == pytest.approx(snr, abs=SNR_ERROR)


def test_noise_by_output_is_added_to_that_output_alone() -> None:
    model, spec = looped(PAPER), SimulateSpec(**LINEAR)
    clean = simulate_recording(model, spec, "clean")
    noisy = simulate_recording(model, spec, "noisy", noise=NoiseLevels({"z": 3e-5}))
    assert (noisy["z1"] - clean["z1"]).std() == pytest.approx(3e-5, rel=0.03)
    assert np.array_equal(noisy["theta1"], clean["theta1"])


def test_noise_of_different_channels_is_independent() -> None:
    model, spec = looped(PAPER), SimulateSpec(**LINEAR)
    clean = simulate_recording(model, spec, "clean")
    levels = NoiseLevels({"z": 1e-4, "encoder": 1e-4})
    noisy = simulate_recording(model, spec, "noisy", noise=levels)
    noises = [noisy[name] - clean[name] for name in ("z1", "z2", "theta1", "theta2")]
    assert np.std(noises, axis=1) == pytest.approx(1e-4, rel=0.03)
    correlation = np.corrcoef(noises)
    five_sigma = 5.0 / np.sqrt(len(clean.time))
    assert np.abs(correlation - np.eye(4)).max() < five_sigma


def test_another_sensor_beside_it_leaves_a_sensor_its_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, spec = looped(PAPER), SimulateSpec(**{**LINEAR, "seconds": 0.5})
    levels = NoiseLevels(dict.fromkeys(sensors(), 0.0001))
    everything = simulate_recording(model, spec, "r", noise=levels)
    for kind in sensors():
        alone = {kind: sensors()[kind]}
        monkeypatch.setattr("flexgui.core.simulate.experiment.sensors", lambda alone=alone: alone)
        recording = simulate_recording(model, spec, "r", noise=levels)
        measured = set(recording.channels) - set(model.drive.reference_channels(model.arm))
        assert measured
        for name in measured:
            assert np.array_equal(recording[name], everything[name])


def test_the_same_seed_gives_the_same_recording_and_another_seed_another() -> None:
    model = looped(PAPER)
    settings = {"theta2": 1.2, "seconds": 0.2, "snr_db": 20.0}
    a, b, c = (simulate_recording(model, SimulateSpec(**settings, seed=s), "r") for s in (4, 4, 5))
    assert all(np.array_equal(a[name], b[name]) for name in a.channels)
    assert not np.array_equal(a["dtheta1_ref"], c["dtheta1_ref"])
    assert not np.array_equal(a["z1"], c["z1"])


def test_a_slower_camera_leaves_cells_empty() -> None:
    model = looped(PAPER)
    spec = SimulateSpec(theta2=1.2, seconds=0.1)
    recording = simulate_recording(model, spec, "r", noise=NoiseLevels({}, camera_rate=100.0))
    assert np.flatnonzero(np.isfinite(recording["z1"])).tolist() == list(range(0, 100, 10))
    assert np.all(np.isfinite(recording["theta1"]))


@pytest.mark.parametrize("name", ["one mode", "slide", "0-2-1"])
def test_arms_without_a_rigid_arm_are_recorded_without_y(name: str) -> None:
    model = looped(ARMS[name], gain=30.0)
    recording = simulate_recording(model, SimulateSpec(seconds=0.1), "r")
    assert recording.has("theta1", "z1", "z2", "u1")
    assert not recording.has("y1")
    assert all(np.all(np.isfinite(column)) for column in recording.channels.values())


def test_the_error_of_a_simulation_is_said_in_lengths_and_angles() -> None:
    spec = SimulateSpec(seconds=0.1, level="nonlinear")
    (said,) = simulate_recording(looped(PAPER), spec, "r").warnings
    steps, error = r"\d+ steps per sample", r"[\d.]+(e-\d+)?"
    assert re.fullmatch(
        f"Simulated with the non-linear equations, {steps}. Shorter steps would change positions "
        f"by about {error} µm and angles by {error} µrad.",
        said,
    )


def test_a_position_controller_starts_at_rest_wherever_the_arm_stands() -> None:
    """References at the working point and no torque: filters must not wake up."""
    for drive in (Cascade(position_gains=(9.0, 9.0), velocity_gains=(40.0, 20.0)), FILTERED):
        model = Model(PAPER, drive)
        spec = SimulateSpec(theta2=2.0, seconds=0.1, amplitude=1e-12)
        recording = simulate_recording(model, spec, "r")
        assert np.abs(recording["u2"]).max() < 1e-8
        assert np.abs(recording["theta2"] - 2.0).max() < 1e-8


def test_a_sweep_goes_from_its_start_to_its_end() -> None:
    rate = half_cosine_rate(0.5, 2.5, 3000, 1e-3)
    assert np.sum(rate) * 1e-3 == pytest.approx(2.0, rel=1e-6)
    model = looped(PAPER)
    task, theta2 = make_task(model, SimulateSpec(sweep=(0.5, 2.5)), "sweep")
    assert theta2 is None
    assert task.schedule[0, 1] == pytest.approx(0.5)
    assert task.schedule[-1, 1] == pytest.approx(2.5, abs=1e-5)


@pytest.mark.parametrize(
    ("drive", "settings", "words"),
    [
        (None, {"sweep": (0.01, 2.0)}, "simulate.sweep"),
        (None, {"sweep": (-1.0, 1.0)}, "simulate.sweep"),
        (None, {"sweep": (2.0, 4.0)}, "simulate.sweep"),
        (None, {"theta": (0.0, 1.0, 2.0)}, "simulate.theta"),
        (FILTERED, {"sweep": (0.5, 2.0)}, "velocity_loop"),
        (None, {"excitation": "prbs_balance"}, "did you mean 'prbs_balanced'?"),
        (None, {"options": {"perods": 3}}, "perods"),
    ],
)
def test_what_cannot_be_simulated_is_said_in_one_sentence(drive, settings, words) -> None:  # type: ignore[no-untyped-def]
    model = looped(PAPER) if drive is None else Model(PAPER, drive)
    assert words in refusal(lambda: make_task(model, SimulateSpec(**settings), "th1"))


def test_noise_of_a_torque_allows_no_larger_error_of_the_motion() -> None:
    stated = {"torque": 0.05}
    assert simulation_tolerance(PAPER, NoiseLevels(stated)) == DEFAULT_TOLERANCE
    stated |= {"z": 3e-5}
    assert simulation_tolerance(PAPER, NoiseLevels(stated)) == NOISE_SHARE * 3e-5


WORKING_POINTS = (np.pi / 8, np.pi / 2, 7 * np.pi / 8)
LEAST_FIT = 99.5
"""Per cent, both channels together."""
LARGEST_EXCURSION = 0.05
"""rad, of theta2 from its working point."""


def fit_and_excursion(excitation: str, theta2: float, seed: int) -> tuple[float, float]:
    model, ydot = looped(PAPER), sensor("ydot")
    numbers = model.numbers()
    spec = SimulateSpec(theta2=theta2, excitation=excitation, seed=seed)
    task, _ = make_task(model, spec, "experiment")
    true = simulate_within(model, numbers, task).trajectory
    linear = respond(model, [numbers], [task])[0]
    excursion = float(np.abs(true.q[:, 1] - theta2).max())
    return fit_percent(ydot.measure(true), ydot.measure(linear)), excursion


@pytest.mark.parametrize("theta2", WORKING_POINTS)
@pytest.mark.parametrize("seeds", long_except((6,), (6, 50)))
def test_linear_model_fits_under_the_default_excitation(theta2: float, seeds: int) -> None:
    default = SimulateSpec().excitation
    found = [fit_and_excursion(default, theta2, seed) for seed in range(1, seeds + 1)]
    fits, excursions = zip(*found, strict=True)
    assert min(fits) >= LEAST_FIT
    assert max(excursions) < LARGEST_EXCURSION


def test_under_plain_prbs_the_fit_falls_with_the_excursion() -> None:
    found = [fit_and_excursion("prbs", np.pi / 2, seed) for seed in range(1, 13)]
    fits, excursions = zip(*found, strict=True)
    assert spearmanr(fits, excursions).statistic < -0.5
    assert max(excursions) > LARGEST_EXCURSION
    assert min(fits) < LEAST_FIT
