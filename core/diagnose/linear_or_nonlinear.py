"""Whether the linear model is good enough for some recordings, or the full equations are needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..diagnose.base_fit import full_equations, outputs_of
from ..diagnose.noise_floor import channel_floors
from ..identify.predictor import Predictor
from ..identify.prepared import prepare
from ..identify.processing import Processing
from ..identify.unknowns import Unknowns
from ..model import Model
from ..recording.recording import Recording
from ..results import LevelChoice
from ..sensors import Sensor

AUTO = "auto"

BELOW = 0.5
"""In noise floors, rms, over the worst channel: what the linear model may miss. Its error then adds
an eighth to the noise's standard deviation, and moves no estimate by more than its own
deviation."""


MOST_SAMPLES = 30_000
"""Of all recordings together: as many as decide within a second or two; of a longer one the part
in which the joints move most."""

FEWEST_SAMPLES = 2_000
"""Of one recording: enough for the spectrum from which its floor is estimated."""


def choose_level(
    model: Model,
    fitted: Sequence[Sensor],
    processing: Processing,
    recordings: Sequence[Recording],
    stated: Mapping[str, float],
    fidelity: float,
) -> LevelChoice:
    """The linear model where it differs from the full equations by less than the floor of every
    channel on the recordings' motions, at the stated values.

    `stated`: channel -> standard deviation of the noise in SI, where it is known; `fidelity`:
    share of a channel's spread that no model is asked to explain.
    """
    chosen = [r for r in recordings if r.role == "estimate"]
    chosen = [r.excerpt(max(MOST_SAMPLES // len(chosen), FEWEST_SAMPLES)) for r in chosen]
    full = full_equations(model)
    if full.steering is not None or not _linear(model):
        return LevelChoice("nonlinear")
    outputs = outputs_of(full, fitted, chosen)
    exact = [prepare(full, r, outputs, processing) for r in chosen]
    straight = full.at_level("lpv")
    linear = [prepare(straight, r, outputs, processing) for r in chosen]
    simulated = Predictor(exact, Unknowns(()))
    a = simulated.predict(np.zeros(0))
    b = Predictor(linear, Unknowns(())).predict(np.zeros(0))
    errors = [np.where(e.counted, e.measured - y, 0.0) for e, y in zip(exact, a, strict=True)]
    motions = simulated.trajectories([(np.zeros(0), range(len(exact)))])[0]
    floors = channel_floors(exact, errors, motions, stated, fidelity)
    worst, name = 0.0, ""
    for k, (channel, _) in enumerate(exact[0].channels):
        apart = np.concatenate([x[:, k] - y[:, k] for x, y in zip(a, b, strict=True)])
        ratio = float(np.sqrt(np.mean(apart**2))) / floors[channel].value
        if not ratio <= worst and not np.isnan(worst):  # nothing is worse than no number
            worst, name = ratio, channel
    return LevelChoice("lpv" if worst <= BELOW else "nonlinear", name, worst)


def _linear(model: Model) -> bool:
    """Whether everything in the model has a place in a linear one."""
    return all(one.level("lpv") == "lpv" for one in model.effects)
