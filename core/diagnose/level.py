"""Whether the linear model is good enough for some recordings, or the full equations are needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.floor import channel_floors
from core.diagnose.start import full_equations, outputs_of
from core.identify.predictor import Predictor
from core.identify.prepared import Processing, prepare
from core.identify.unknowns import Unknowns
from core.model import Model
from core.recording.recording import Recording
from core.sensors import Sensor
from core.written import format_number

AUTO = "auto"

BELOW = 0.5
"""In floors, rms, over the worst channel: what the linear model may miss. Its error then adds an
eighth to the noise's standard deviation, and moves no estimate by more than its own deviation."""


MOST_SAMPLES = 30_000
"""Of all recordings together: as many as decide within a second or two; of a longer one the part
in which the joints move most."""

FEWEST_SAMPLES = 2_000
"""Of one recording: enough for the spectrum from which its floor is estimated."""


@dataclass(frozen=True)
class Choice:
    """The level that was chosen, and the line that says why."""

    level: str
    sentence: str


def choose_level(
    model: Model,
    fitted: Sequence[Sensor],
    processing: Processing,
    recordings: Sequence[Recording],
    stated: Mapping[str, float],
    fidelity: float,
) -> Choice:
    """The linear model where it differs from the full equations by less than the floor of every
    channel on the recordings' motions, at the stated values.

    `stated`: channel -> standard deviation of the noise in SI, where it is known; `fidelity`:
    share of a channel's spread that no model is asked to explain.
    """
    chosen = [r for r in recordings if r.role == "estimate"]
    chosen = [r.excerpt(max(MOST_SAMPLES // len(chosen), FEWEST_SAMPLES)) for r in chosen]
    full = full_equations(model)
    if full.steering is not None or not _linear(model):
        return Choice("nonlinear", "Model level: full equations, which this rig needs.")
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
    number = format_number(worst, 2)
    if worst <= BELOW:
        return Choice(
            "lpv",
            f"Model level: linear parameter-varying; on these motions it is within {number} times "
            f"the noise floor of the full equations.",
        )
    return Choice(
        "nonlinear",
        f"Model level: full equations; the linear model misses {name} by {number} times the noise "
        f"floor on these motions.",
    )


def _linear(model: Model) -> bool:
    """Whether everything in the model has a place in a linear one."""
    return all(one.level("lpv") == "lpv" for one in model.effects)
