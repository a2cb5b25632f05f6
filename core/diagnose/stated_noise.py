"""The sensors' stated noise, by the columns that they write."""

from __future__ import annotations

from collections.abc import Sequence

from core.identify.setup import Setup
from core.recording.recording import Recording
from core.scenario.schema import Scenario
from core.sensors import sensors


def stated_noise(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording]
) -> dict[str, float]:
    """column -> standard deviation as the sensor writes it, SI, where it was stated.

    What is computed from other channels (velocities from tip places), or has noise of a stated
    ratio to its signal, has no stated level. That of a current is stated by its torque.
    """
    relative = any(r.simulate and r.simulate.snr_db is not None for r in scenario.recordings)
    found: dict[str, float] = {}
    for kind, one in sensors().items():
        level = scenario.sensors.noise_of(one.noise)
        if level is None or (relative and kind in ("z", "ydot")):
            continue
        for name in (channel.name for channel in one.channels(setup.model.arm)):
            current = kind == "torque" and all(r.has(f"i{name[1:]}") for r in recordings)
            if current or all(r.has(name) for r in recordings):
                found[name] = level
    return found
