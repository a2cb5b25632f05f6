"""The noise of each channel, estimated again with a better model.

Without stated noise or repeated motions, noise is estimated from the residual, so what the base
model lacks counts as noise. The encoders of an arm with limited, rippling torque seemed twenty
times too noisy, and the ripple stayed below the noise floor. So a model within such a floor is
compared with the floor that it shows itself. Noise is at most what all effects together do not
explain of the errors, by linear prediction, unless a servo prescribes the joints' motion.

With a virtual servo a better model may also show more noise: encoder noise excites the links, by
how much depends on them. A soft base doubled it in the torques.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..diagnose.linear_screen import Screen
from ..diagnose.search_options import Options
from ..estimate.fitted_model import FittedModel
from ..estimate.problem import FitData, within_noise
from ..noise.noise_floor import Floor, channel_floors, channel_rms
from ..noise.sensor_noise import ESTIMATED
from ..noise.whitening import whitened_rows

LEAST_RATIO = 1.25
"""Least ratio of old to new floor, or the reverse, for an update: draws of the noise scatter by a
tenth."""


def alike(floors: Mapping[str, float], others: Mapping[str, float]) -> bool:
    """Whether no noise floor differs from that of the same channel by the ratio of an update."""
    ratios = [floors[n] / others[n] for n in floors]
    return all(1.0 / LEAST_RATIO < ratio < LEAST_RATIO for ratio in ratios)


def lower_floors(
    model: FittedModel, options: Options, first_screen: Screen | None, changed: bool
) -> dict[str, Floor] | None:
    """channel -> noise floor by the last model, at most the one before; None if none is much lower,
    if the model leaves more than noise, or if its error does not surely exceed a lower one.

    `first_screen`: that of the model as given; `changed`: whether effects were added since.
    """
    data = model.data
    if not within_noise(data, model.refit.errors):
        return None
    # A damped link follows the noise of a prescribed motion less: there effects imitate noise.
    if changed or data.rig.servo:
        first_screen = None
    most = {} if first_screen is None else rms_unexplained(data, first_screen)
    old, floors = data.floors, {}
    for name, f in current_floors(model, options).items():
        noise = min(f.noise, most.get(name, np.inf)) if f.source == ESTIMATED else f.noise
        value = float(np.sqrt(max(f.value**2 - f.noise**2, 0.0) + noise**2))
        floors[name] = replace(f, value=min(value, old[name]), noise=noise)
    lower = max(old[n] / f.value for n, f in floors.items()) >= LEAST_RATIO
    exceeded = any(
        rms > floors[n].uncertainty * floors[n].value for n, rms in rms_left(model).items()
    )
    return floors if lower and exceeded else None


def rms_unexplained(data: FitData, screened: Screen) -> dict[str, float]:
    """channel -> rms, SI, of the error that no candidate of a screen explains, per independent
    sample beside the screened changes; empty if there are none."""
    squares, counts = dict.fromkeys(data.floors, 0.0), dict.fromkeys(data.floors, 0)
    rows = whitened_rows(data.experiments)
    for e, own, r in zip(data.experiments, rows, screened.remainders, strict=True):
        for c, (name, _) in enumerate(e.channels):
            squares[name] += float(np.sum(r[own[c], c] ** 2))
            counts[name] += len(own[c])
    spent = screened.whitened.parts.shape[-1] - 1
    free = 1.0 - spent / max(sum(counts.values()), 1)
    if free <= 0.0:
        return {}
    return {
        n: data.floors[n] * float(np.sqrt(x / max(counts[n], 1) / free)) for n, x in squares.items()
    }


def higher_floors(model: FittedModel, options: Options, changed: bool) -> dict[str, Floor] | None:
    """channel -> noise floor by the last model, at least the one before; None if none is much
    higher, if no effect was added, or without a servo, where noise does not move the arm.

    No noise exceeds the residual. The error from prescribing the measured joint motion does not
    count here: it was overestimated eightyfold for a model in a wrong minimum, and hid a torque
    offset.
    """
    if not changed or not model.data.rig.servo or model.data.tolerances:
        return None
    old, residual_rms = model.data.floors, rms_left(model)
    floors = {
        n: replace(f, value=max(min(f.noise, residual_rms[n]), old[n]))
        for n, f in current_floors(model, options).items()
    }
    higher = max(f.value / old[n] for n, f in floors.items()) >= LEAST_RATIO
    return floors if higher else None


def current_floors(model: FittedModel, options: Options) -> dict[str, Floor]:
    """channel -> noise floor by what the model leaves."""
    data, problem = model.data, model.refit.problem
    errors = [b / w for b, w in zip(model.refit.errors, data.weights, strict=True)]
    return channel_floors(
        problem.residuals.experiments,
        errors,
        problem.motions(),
        options.stated_noise,
        options.fidelity,
    )


EXACT = 1e-5
"""Of a channel's spread: nobody can say more exactly what it should read."""


def against_noise_alone(model: FittedModel, options: Options) -> FittedModel | None:
    """A model seen against the noise alone, without the tolerance that its floors contain; None
    where its error surely is within that as well."""
    data = model.data
    if data.tolerances:
        return None
    floors = current_floors(model, replace(options, fidelity=min(EXACT, options.fidelity)))
    if all(rms <= floors[n].uncertainty * floors[n].value for n, rms in rms_left(model).items()):
        return None
    squares = {n: data.floors[n] ** 2 - f.value**2 for n, f in floors.items()}
    tolerances = {n: max(squares[n], 0.0) / f.value**2 for n, f in floors.items()}
    return model.against(data.in_floors(floors, tolerances))


def rms_left(model: FittedModel) -> dict[str, float]:
    """channel -> rms of the model's error, SI."""
    shares = channel_rms(model.data.experiments, model.refit.errors)
    return {name: share * model.data.floors[name] for name, share in shares.items()}
