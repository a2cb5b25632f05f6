"""The sensors' stated noise, by the columns that they write."""

from __future__ import annotations

from collections.abc import Sequence

from core.identify.setup import Setup
from core.recording.recording import Recording
from core.scenario.schema import Scenario, SensorsSpec


def stated_noise(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording]
) -> dict[str, float]:
    """column -> standard deviation as the sensor writes it, SI, where it was stated.

    What is computed from other channels (velocities from tip places), or has noise of a stated
    ratio to its signal, has no stated level. That of a current is stated by its torque.
    """
    levels = _levels(scenario.sensors)
    relative = any(r.simulate and r.simulate.snr_db is not None for r in scenario.recordings)
    found: dict[str, float] = {}
    for kind, level in levels.items():
        joints = setup.model.arm.joints if kind in ("theta", "deflection", "u") else 2
        if level is None or (relative and kind in ("z", "ydot")):
            continue
        for name in (f"{kind}{k + 1}" for k in range(joints)):
            current = kind == "u" and all(r.has(f"i{name[1:]}") for r in recordings)
            if current or all(r.has(name) for r in recordings):
                found[name] = level
    return found


def _levels(sensors: SensorsSpec) -> dict[str, float | None]:
    """Stem of the columns -> what is stated."""
    return {
        "z": sensors.camera_noise,
        "theta": sensors.encoder_noise,
        "deflection": sensors.deflection_noise,
        "u": sensors.torque_noise,
        "ydot": sensors.rates_noise,
    }
