"""Outputs of many motions at once, by the route that the measured ones took.

The same as Prepared.predicted, for arrays (N, k, S) of S motions instead of one (N, k).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.arm.compiled import CompiledArm
from core.effects.effect import Effect
from core.identify.prepared import Prepared, Processing
from core.identify.unknowns import GAIN, OFFSET
from core.identify.zero_phase import filtered
from core.recording.channels import from_camera
from core.recording.logger_filter import apply_logger_filter

Values = Sequence[Mapping[str, float]]


def processed(
    e: Prepared, linear: np.ndarray, compiled: CompiledArm, p: np.ndarray, values: Values
) -> np.ndarray:
    """(M, k, S) from the linear outputs (N, k', S) of S motions with p (S, np) and `values`."""
    raw = _sensed(e, linear, compiled, p, values)
    dt = e.recording.sample_time
    for k, (name, _) in enumerate(e.channels):
        raw[:, k] = _through_logger(e, name, raw[:, k], dt)
        gain = np.array([v.get(GAIN + name, 1.0) for v in values])
        offset = np.array([v.get(OFFSET + name, 0.0) for v in values])
        if np.any(gain != 1.0) or np.any(offset):
            raw[:, k] = gain * raw[:, k] + offset
    return apply_processing(e.processing, raw, dt)


def apply_processing(processing: Processing, y: np.ndarray, dt: float) -> np.ndarray:
    """Processing.apply for complete signals (N, k, S)."""
    for low_pass in (processing.filter, processing.output_filter):
        if low_pass is not None:
            y = filtered(low_pass, y, dt)
    return y[:: processing.decimate]


def _sensed(
    e: Prepared, linear: np.ndarray, compiled: CompiledArm, p: np.ndarray, values: Values
) -> np.ndarray:
    """(N, k, S): what the sensors read."""
    arm, found, place = e.model.arm, [], 0
    numbers = e.model.numbers()
    for sensor in e.outputs:
        rows = sensor.linear_rows(e.recording, arm, numbers.p, numbers.law)
        assert rows is not None
        count = len(rows.Q)
        part = linear[:, place : place + count]
        place += count
        y = sensor.from_linear(part, e.recording, arm, compiled, p)
        found.append(_through_effects(e, sensor.kind, y, values))
    return np.concatenate(found, axis=1)


def _through_effects(e: Prepared, kind: str, y: np.ndarray, values: Values) -> np.ndarray:
    if all(type(one).sensed is Effect.sensed for one in e.model.effects):
        return y
    dt = e.recording.sample_time
    each = [e.model.sensed(kind, y[:, :, s], dt, v) for s, v in enumerate(values)]
    return np.stack(each, axis=2)


def _through_logger(e: Prepared, name: str, y: np.ndarray, dt: float) -> np.ndarray:
    """y (N, S) of one channel."""
    delay = e.recording.camera.delay
    if delay and from_camera(name):
        y = _delayed(y, e.task.time, delay)
    logged = e.recording.logger_filters.get(name)
    return y if logged is None else apply_logger_filter(y, dt, logged)


def _delayed(y: np.ndarray, time: np.ndarray, delay: float) -> np.ndarray:
    """y (N, S) at time - delay, straight between samples, constant beyond the ends."""
    at = np.interp(time - delay, time, np.arange(len(time), dtype=float))
    below = np.minimum(at.astype(np.int64), len(time) - 2)
    share = (at - below)[:, None]
    return np.asarray((1.0 - share) * y[below] + share * y[below + 1])
