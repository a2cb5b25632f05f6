"""What an encoder adds is told from any motion, whatever a model would lack of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from flexgui.core.noise.output_noise import _limited_by_prediction, white_noise_bound
from flexgui.core.noise.sensor_noise import (
    ESTIMATED,
    STATED,
    ColumnNoise,
    common_quantisation_step,
)
from flexgui.core.recording.recording import Recording

STEP, SAMPLES, RECORDINGS = 2e-3, 600, 4
COUNT = 2.4e-5
"""rad, of an encoder with 2^18 counts"""

WHITE = COUNT / np.sqrt(12.0)

NEAR = 1.25
"""Factor; for all noise floors 1.5 is asked."""

COMMAND = 1e-6
"""N m, of a command with a smooth part"""

FOLLOWED = 3.0
"""Factor where dry friction turns in every recording: it is foretold at no turn."""


def turned(rng: np.random.Generator, friction: float) -> tuple[np.ndarray, np.ndarray]:
    """Torque and place of a hub with a lightly damped link, driven by steps; dry friction as given,
    in N m."""
    torque = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 10), 10)
    hub, link, stiffness, fine = 0.05, 0.1, 600.0, 20
    x, v, y, w = 0.3, 0.0, 0.3, 0.0
    places = np.empty(SAMPLES)
    for t in range(SAMPLES):
        places[t] = x
        for _ in range(fine):
            bend = stiffness * (y - x) + 0.05 * (w - v)
            v += STEP / fine * (torque[t] + bend - 0.1 * v - friction * np.tanh(v / 1e-3)) / hub
            w -= STEP / fine * bend / link
            x, y = x + STEP / fine * v, y + STEP / fine * w
    return torque, places


def recordings(friction: float = 0.0, noise: float = 0.0, count: float = COUNT) -> list[Recording]:
    rng, found = np.random.default_rng(3), []
    for k in range(RECORDINGS):
        torque, place = turned(rng, friction)
        read = place + noise * rng.standard_normal(SAMPLES)
        read = count * np.round(read / count) if count else read
        found.append(Recording(f"r{k}", np.arange(SAMPLES) * STEP, {"u1": torque, "theta1": read}))
    return found


@pytest.mark.parametrize("noise", [0.0, WHITE, 4.0 * WHITE])
def test_the_noise_of_an_encoder_is_told_beside_a_vibration(noise: float) -> None:
    level = white_noise_bound(recordings(noise=noise), "theta1", ["u1"])
    true = np.hypot(WHITE, noise)
    assert level is not None and true / NEAR < level < true * NEAR


def test_friction_that_no_model_knows_hides_little_of_it() -> None:
    level = white_noise_bound(recordings(friction=0.1), "theta1", ["u1"])
    assert level is not None and WHITE / NEAR < level < FOLLOWED * WHITE


def test_without_noise_next_to_nothing_is_unforeseen() -> None:
    level = white_noise_bound(recordings(count=0.0), "theta1", ["u1"])
    assert level is not None and level < 1e-3 * WHITE


@pytest.mark.parametrize("sensor_noise", [0.0, 0.05])
def test_what_a_controller_makes_of_noisy_encoders_is_no_noise_of_its_torque(
    sensor_noise: float,
) -> None:
    """N m; a current that is measured has noise of its own, which no encoder predicts."""
    rng, found = np.random.default_rng(9), recordings(noise=WHITE)
    for r in found:
        place = r["theta1"]
        speed = np.diff(place, prepend=place[:1]) / STEP
        command = np.sin(12.0 * r.time) - 20.0 * place - 4.0 * speed
        assert np.std(np.diff(speed)) * 4.0 > 0.05  # N m, of counts alone
        r.channels["u1"] = command + sensor_noise * rng.standard_normal(SAMPLES)
    level = white_noise_bound(found, "u1", ["theta1"])
    assert level is not None
    assert level == pytest.approx(sensor_noise, rel=NEAR - 1.0, abs=COMMAND)


def bounded(found: list[Recording], seen: ColumnNoise) -> float:
    """Level, counting included, of what was estimated as `seen`."""
    routes = [
        SimpleNamespace(servo_driven=False, recording=r, places=["theta1"], references=("u1",))
        for r in found
    ]
    noise = _limited_by_prediction(routes, "theta1", seen)  # type: ignore[arg-type]
    return float(np.hypot(noise.std, noise.quantum / np.sqrt(12.0)))


SEEN = ColumnNoise(20.0 * WHITE, quantum=COUNT, source=ESTIMATED)
"""As it was found where friction and ripples are missing."""


def test_what_a_model_lacks_is_no_noise_of_an_encoder_that_counts() -> None:
    assert WHITE <= bounded(recordings(), SEEN) < NEAR * WHITE


def test_the_last_digit_of_a_file_is_no_count_and_a_memory_is_no_foresight() -> None:
    """A reading that was filtered before it was written foretells its own noise."""
    rng, found = np.random.default_rng(4), recordings(count=0.0)
    for r in found:
        slow = lfilter([0.1], [1.0, -0.9], 40.0 * WHITE * rng.standard_normal(SAMPLES))
        r.channels["theta1"] = COUNT * np.round((r["theta1"] + slow) / COUNT)
    kept = float(np.hypot(SEEN.std, WHITE))
    assert bounded(found, replace(SEEN, ar_coefficient=0.9)) == pytest.approx(kept)
    loud = recordings(noise=10.0 * WHITE)
    assert bounded(loud, SEEN) == pytest.approx(kept)


def test_what_is_stated_stays() -> None:
    assert bounded(recordings(), replace(SEEN, source=STATED)) > 10.0 * WHITE


def test_hundreds_of_recordings_are_no_obstacle() -> None:
    level = white_noise_bound(recordings() * 100, "theta1", ["u1"])
    assert level is not None and WHITE / NEAR < level < NEAR * WHITE


def test_short_recordings_and_holes_say_nothing() -> None:
    short = [r.excerpt(60) for r in recordings()[:1]]
    assert white_noise_bound(short, "theta1", ["u1"]) is None
    holed = recordings()[0]
    holed.channels["theta1"][5] = np.nan
    assert white_noise_bound([holed], "theta1", ["u1"]) is None


RIPPLED = 40.0
"""Times the white noise: what a ripple leaves that no linear equation foretells."""


def test_a_calm_recording_tells_what_lively_ones_hide() -> None:
    rng, found = np.random.default_rng(6), recordings()
    for r in found[1:]:
        lively = RIPPLED * WHITE * np.sin(900.0 * r["theta1"] + rng.uniform(0.0, 6.0))
        r.channels["theta1"] = COUNT * np.round((r["theta1"] + lively) / COUNT)
    lively_alone = white_noise_bound(found[1:], "theta1", ["u1"])
    level = white_noise_bound(found, "theta1", ["u1"])
    assert level is not None and lively_alone is not None
    assert WHITE <= level < NEAR * WHITE < 0.5 * lively_alone


def test_counts_are_seen_over_all_recordings_where_one_alone_has_no_neighbours() -> None:
    rng = np.random.default_rng(8)
    sparse = COUNT * np.array([3.0, 11.0, 20.0, 47.0, 92.0])
    dense = 0.4 * COUNT + COUNT * rng.integers(0, 500, SAMPLES)
    assert common_quantisation_step([sparse]) == 0.0
    assert common_quantisation_step([sparse, dense]) == pytest.approx(COUNT)
    assert common_quantisation_step([sparse, rng.standard_normal(SAMPLES)]) == 0.0
