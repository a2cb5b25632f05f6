"""The motion as the encoders show it: the fitted one, moved by what it misses of them.

A law acts along the true motion. Where friction holds a joint for a while, or a spring turns it
round, the fitted motion, which knows no such law, is elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from ..estimate.fitted_model import FittedModel
from ..recording.visible_band import visible_band
from ..trajectory import Trajectory

ORDER = 2
"""Of the low-pass, which runs forwards and backwards."""


def actual_motions(model: FittedModel) -> tuple[Trajectory, ...]:
    """The motion of each recording, with the joints where the encoders saw them, within the band
    where they see a motion; of a model at its minimum."""
    problem = model.refit.problem
    fitted = tuple(motion for motion, _, _ in problem.motions())
    if model.data.rig.servo:  # the joints follow the encoders already
        return fitted
    everything = range(len(fitted))
    readings = problem.residuals.predictor.readings([(problem.vector, everything)])[0]
    missed = [
        {
            name: e.recording[name] - y[:, i]
            for i, (name, _) in enumerate(e.channels)
            if e.kinds[i] == "encoder"
        }
        for e, y in zip(model.data.experiments, readings, strict=True)
    ]
    return _moved(fitted, missed)


def _moved(
    fitted: tuple[Trajectory, ...], missed: list[dict[str, np.ndarray]]
) -> tuple[Trajectory, ...]:
    places = [(m.q.copy(), m.v.copy()) for m in fitted]
    for j in range(fitted[0].arm.joints):
        errors = [each.get(f"theta{j + 1}") for each in missed]
        dts = [float(m.time[1] - m.time[0]) for m in fitted]
        known = [
            (x, dt) for x, dt in zip(errors, dts, strict=True)
            if x is not None and np.isfinite(x).all()
        ]  # fmt: skip
        band = visible_band(known) if len(known) == len(fitted) else None
        if band is None:
            continue
        for (q, v), (x, dt) in zip(places, known, strict=True):
            smooth = _below(x, dt, band.hz)
            q[:, j] += smooth
            v[:, j] += np.gradient(smooth, dt)
    return tuple(replace(m, q=q, v=v) for m, (q, v) in zip(fitted, places, strict=True))


def _below(x: np.ndarray, dt: float, hz: float) -> np.ndarray:
    """(N,) below a frequency, without delay."""
    share = 2.0 * hz * dt
    if share >= 1.0:
        return x
    sections = scipy.signal.butter(ORDER, share, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, x))
