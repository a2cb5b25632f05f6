"""Gains of channels that nobody states: gauges glued by hand, columns in counts, currents.

A gain is linear, so the best one of a model is a regression of what was measured on what the model
predicts. A descent begins there, at each of its starts: from a wrong gain, slopes in all other
unknowns are wrong by the same factor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..identify.first_states import START
from ..identify.loop_rate import with_faster_loop
from ..identify.predictor import Predictor
from ..identify.prepared_recording import Prepared, prepare
from ..identify.processing import TORQUE, Processing
from ..identify.residuals import Residuals
from ..identify.unknowns import GAIN, Unknown, Unknowns, gain_parameter
from ..model import Model
from ..recording.recording import Recording
from ..sensors.sensor import Sensor


class Gain(NamedTuple):
    """The parameter that scales a channel."""

    name: str
    power: int
    """1 where it multiplies the prediction, -1 where it multiplies the recorded column."""


def gains_of(model: Model, outputs: Sequence[Sensor]) -> dict[str, Gain]:
    """Channel -> the parameter that would scale it, of each compared channel."""
    scales = model.drive.scales(model.arm) if model.steering is not None else {}
    channels = [c.name for s in outputs for c in s.channels(model.arm)]
    gains = {name: Gain(GAIN + name, 1) for name in channels}
    torques = [c.name for s in outputs if s.kind == TORQUE for c in s.channels(model.arm)]
    columns = model.drive.reference_channels(model.arm)
    return gains | {
        torque: Gain(scales[column], -1)
        for torque, column in zip(torques, columns, strict=False) if column in scales
    }  # fmt: skip


def unknown_gains(
    model: Model, outputs: Sequence[Sensor], recordings: Sequence[Recording]
) -> dict[str, Gain]:
    """The same of those that nobody states; InputError for a column whose gain everything else
    depends on."""
    arm = model.arm
    columns = {name for r in recordings for name in r.unknown_gains}
    _check(model, columns)
    own = {
        c.name for s in outputs for c in s.channels(arm)
        if s.gain_unit(arm, c.name) is not None and any(r.has(c.name) for r in recordings)
    }  # fmt: skip
    references = model.drive.reference_channels(arm)
    torques = {f"u{k + 1}" for k, name in enumerate(references) if name in columns}
    return {n: g for n, g in gains_of(model, outputs).items() if n in {*columns, *own, *torques}}


def _check(model: Model, columns: set[str]) -> None:
    """InputError where a column moves the model and no parameter scales it."""
    arm = model.arm
    fixed = {f"theta{k + 1}" for k in range(arm.joints)} | set(model.drive.reference_channels(arm))
    fixed -= set(model.drive.scales(arm))
    if refused := sorted(columns & fixed):
        raise InputError(
            f'columns.{refused[0]}: gain = "unknown" is for sensors and for recorded torques or '
            f"currents; all else is measured in units of {refused[0]}, so state its gain."
        )


def gain_starts(
    model: Model, outputs: Sequence[Sensor], recordings: Sequence[Recording],
    values: Mapping[str, float] | None = None,
) -> dict[str, float]:  # fmt: skip
    """Parameter -> value of the gains that nobody states, by the model at `values`, which moves as
    the recordings say."""
    gains = unknown_gains(model, outputs, recordings)
    if not gains:
        return {}
    model = with_faster_loop(model)
    experiments = [prepare(model, r, outputs, Processing()) for r in recordings]
    predictor = Predictor(experiments, Unknowns(()), values or {})
    predicted = predictor.predict_many([(np.zeros(0), range(len(experiments)))])[0]
    factors = _factors(experiments, predicted)
    return {g.name: (values or {}).get(g.name, 1.0) * factors[n] ** g.power
            for n, g in gains.items()}  # fmt: skip


def _factors(experiments: Sequence[Prepared], predicted: Sequence[np.ndarray]) -> dict[str, float]:
    """Channel -> by how much its prediction must grow, each recording about its own mean; 1 where
    the model does not move."""
    products: dict[str, np.ndarray] = {}
    for e, y in zip(experiments, predicted, strict=True):
        for k, (name, _) in enumerate(e.channels):
            counted = e.counted[:, k] & np.isfinite(y[:, k])
            if counted.any():
                a, b = (x[counted, k] - x[counted, k].mean() for x in (y, e.measured))
                products[name] = products.get(name, np.zeros(2)) + [a @ b, a @ a]
    factors = {name: ab / aa if aa > 0.0 else 1.0 for name, (ab, aa) in products.items()}
    names = [name for e in experiments for name, _ in e.channels]
    return {name: factors.get(name) or 1.0 for name in names}


def with_best_gains(residuals: Residuals, vectors: np.ndarray) -> np.ndarray:
    """Vectors (S, P) with the gains among their entries regressed again, each by its own model."""
    items, e = residuals.unknowns.items, residuals.experiments[0]
    gains = gains_of(e.model, e.outputs)
    places = {u.parameter.name: i for i, u in enumerate(items) if u.recording is None}
    own = {n: (places[g.name], g.power) for n, g in gains.items() if g.name in places}
    if not own:
        return vectors
    chosen = range(len(residuals.experiments))
    better = np.array(vectors)
    for vector, predicted in zip(
        better, residuals.predictor.predict_many([(v, chosen) for v in vectors]), strict=True
    ):
        factors = _factors(residuals.experiments, predicted)
        for name, (place, power) in own.items():
            vector[place] *= factors[name] ** power
    p = residuals.unknowns.parameters
    return np.clip(better, p.lower(), p.upper())


def gain_unknowns(
    model: Model, outputs: Sequence[Sensor], recordings: Sequence[Recording],
    stated: Sequence[Unknown], values: Mapping[str, float],
) -> tuple[Unknown, ...]:  # fmt: skip
    """The gains that nobody states as unknowns, beside those that are `stated`."""
    known = {u.parameter.name for u in stated} | set(values)
    starts = gain_starts(model, outputs, recordings, _first_values(stated, values))
    units = {
        GAIN + c.name: s.gain_unit(model.arm, c.name) or ""
        for s in outputs for c in s.channels(model.arm)
    }  # fmt: skip
    return tuple(
        Unknown(gain_parameter(model, name, value, units.get(name, "")), None, False)
        for name, value in starts.items() if name not in known
    )  # fmt: skip


def _first_values(stated: Sequence[Unknown], values: Mapping[str, float]) -> dict[str, float]:
    """Where the other unknowns start; first states belong to their recordings and stay out."""
    shared = {u.parameter.name: u.parameter.value for u in stated if u.recording is None}
    return {n: x for n, x in {**shared, **values}.items() if not n.startswith(START)}
