"""The sensors' stated noise as it stands in the compared outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.identify.prepared import Processing
from core.identify.setup import Setup
from core.recording.recording import Recording
from core.scenario.schema import Scenario, SensorsSpec

IMPULSE = 4097
"""Samples of the impulse that a filter's gain on noise is taken from; odd, for a middle."""


def stated_noise(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording]
) -> dict[str, float]:
    """channel -> standard deviation after the processing, SI, where it was stated.

    What is computed from other channels (velocities from tip places), or has noise of a stated
    ratio to its signal, has no stated level.
    """
    levels = _levels(scenario.sensors)
    relative = any(r.simulate and r.simulate.snr_db is not None for r in scenario.recordings)
    found: dict[str, float] = {}
    for kind, level in levels.items():
        joints = setup.model.arm.joints if kind in ("theta", "deflection", "u") else 2
        names = [f"{kind}{k + 1}" for k in range(joints)]
        recorded = all(r.has(name) for r in recordings for name in names)
        if level is None or not recorded or (relative and kind in ("z", "ydot")):
            continue
        gain = noise_gain(setup.processing, recordings[0].sample_time)
        found |= dict.fromkeys(names, gain * level)
    return found


def _levels(sensors: SensorsSpec) -> dict[str, float | None]:
    """Stem of the channels -> what is stated."""
    return {
        "z": sensors.camera_noise,
        "theta": sensors.encoder_noise,
        "deflection": sensors.deflection_noise,
        "u": sensors.torque_noise,
        "ydot": sensors.rates_noise,
    }


def noise_gain(processing: Processing, dt: float) -> float:
    """rms of white noise of rms 1 after the filter: the root of its impulse's squared sum."""
    if processing.filter is None:
        return 1.0
    impulse = np.zeros(IMPULSE)
    impulse[IMPULSE // 2] = 1.0
    return float(np.sqrt(np.sum(processing.filter.apply(impulse, dt) ** 2)))
