"""Whether the linear model suffices for some recordings, or the full equations are needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .diagnose.base_fit import compared_outputs, full_equations
from .identify.compare import predictor_of
from .identify.prepared_recording import prepare
from .identify.processing import Processing
from .identify.unknown_gains import gain_starts
from .model import Model
from .noise.noise_floor import channel_floors
from .recording.recording import Recording
from .results import LevelChoice
from .sensors.sensor import Sensor

AUTO = "auto"

LINEAR_ERROR = 0.5
"""In noise floors, rms, in the worst channel: largest error of the linear model. It adds an eighth
to the noise's standard deviation, and changes no estimate by more than its own."""


MOST_SAMPLES_TO_DECIDE = 30_000
"""Samples of all recordings together, which decide within two seconds; of a longer one, the part in
which the joints move most."""

FEWEST_SAMPLES = 2_000
"""Samples of one recording, enough for the spectrum of its noise floor."""


def choose_level(
    model: Model, fitted: Sequence[Sensor], processing: Processing, recordings: Sequence[Recording],
    stated: Mapping[str, float], fidelity: float,
) -> LevelChoice:  # fmt: skip
    """The linear model if it differs from the full equations by less than the noise floor of every
    channel, along the recordings' motions at the stated values; else the full equations.

    `stated`: channel -> stated standard deviation of the noise, SI; `fidelity`: relative modelling
    tolerance, as a share of a channel's spread.
    """
    chosen = [r for r in recordings if r.role == "estimate"]
    chosen = [r.excerpt(max(MOST_SAMPLES_TO_DECIDE // len(chosen), FEWEST_SAMPLES)) for r in chosen]
    full = full_equations(model)
    if full.steering is not None or not _linear(model):
        return LevelChoice("nonlinear")
    outputs = compared_outputs(full, fitted, chosen)
    exact = [prepare(full, r, outputs, processing) for r in chosen]
    straight = full.at_level("lpv")
    linear = [prepare(straight, r, outputs, processing) for r in chosen]
    gains = gain_starts(full, outputs, chosen)
    b = predictor_of(linear, gains).predict(np.zeros(0))
    # In steps that hardly change what the linear model misses.
    as_linear = [replace(e, measured=y) for e, y in zip(exact, b, strict=True)]
    simulated = predictor_of(as_linear, gains)
    a = simulated.predict(np.zeros(0))
    errors = [np.where(e.counted, e.measured - y, 0.0) for e, y in zip(exact, a, strict=True)]
    motions = simulated.trajectories([(np.zeros(0), range(len(exact)))])[0]
    floors = channel_floors(exact, errors, motions, stated, fidelity)
    worst, name = 0.0, ""
    for k, (channel, _) in enumerate(exact[0].channels):
        difference = np.concatenate([x[:, k] - y[:, k] for x, y in zip(a, b, strict=True)])
        ratio = float(np.sqrt(np.mean(difference**2))) / floors[channel].value
        if not ratio <= worst and not np.isnan(worst):  # nothing is worse than no number
            worst, name = ratio, channel
    return LevelChoice("lpv" if worst <= LINEAR_ERROR else "nonlinear", name, worst)


def _linear(model: Model) -> bool:
    """Whether all effects of the model have a linear model."""
    return all(e.level("lpv") == "lpv" for e in model.effects)
