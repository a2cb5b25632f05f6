"""Outputs of many motions at once, by the route that the measured ones took.

The same as Prepared.predicted, for arrays (N, k, S) of S motions instead of one (N, k).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.arm.compiled import CompiledArm
from core.effects.effect import Effect
from core.identify.prepared import Prepared
from core.identify.unknowns import GAIN, OFFSET

Values = Sequence[Mapping[str, float]]


def processed(
    e: Prepared, linear: np.ndarray, compiled: CompiledArm, p: np.ndarray, values: Values
) -> np.ndarray:
    """(M, k, S) from the linear outputs (N, k', S) of S motions with p (S, np) and `values`."""
    raw = _sensed(e, linear, compiled, p, values)
    for k, (name, _) in enumerate(e.channels):
        raw[:, k] = e.through_logger(name, raw[:, k])
        gain = np.array([v.get(GAIN + name, 1.0) for v in values])
        offset = np.array([v.get(OFFSET + name, 0.0) for v in values])
        if np.any(gain != 1.0) or np.any(offset):
            raw[:, k] = gain * raw[:, k] + offset
    return e.processed(raw)


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
