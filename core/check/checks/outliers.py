"""Single samples far from their neighbours."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import FAR
from ...recording.channels import Role, is_reference, role_of

OF_SPREAD = 0.5
"""Of the channel's standard deviation: in recordings of real drives, currents stand out by 0.3."""
MOST = 0.03
"""Of the samples; more are no outliers."""
PLACES = (Role.PLACE, Role.TIP)
"""Which inertia keeps from standing out anywhere: as many samples as MOST may be outliers."""
JUMPING = 0.01
"""Of the samples of all other channels: a velocity loop's torque stands out wherever its reference
jumps, in two of a hundred samples (scenarios/mujoco), and is held against these."""


class Outliers(Check):
    """A sample, or two, that its neighbours on both sides contradict."""

    kind = "outliers"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            if is_reference(name):
                continue
            values = recording.counted(name)
            good = np.flatnonzero(np.isfinite(values))
            if len(good) < 50:
                continue
            bad = far_out(values[good], MOST if role_of(name) in PLACES else JUMPING)
            if 0 < bad.sum() <= MOST * len(good):
                times = recording.time[good][bad]
                count = int(bad.sum())
                first = ", ".join(f"{t:.4g}" for t in times[:3])
                sentence = f"{name} has {count} samples far from their neighbours, at {first} s"
                h = recording.step / 2
                spans = ", ".join(f"[{t - h:.9g}, {t + h:.9g}]" for t in times)
                fix = f"mask = {{ {name} = [{spans}] }}" if count <= 20 else None
                yield case.finding(self.kind, name, count, "samples", sentence, fix)


def far_out(x: np.ndarray, share: float = MOST) -> np.ndarray:
    """(N,) True where one or two samples stand out to the same side of both neighbours, further
    than all but a `share` of the samples do."""
    bad = np.zeros(len(x), dtype=bool)
    # Of the middle, so that the outliers do not raise it themselves.
    low, high = np.percentile(x, [1.0, 99.0])
    spread = float(np.std(np.clip(x, low, high)))
    for width in (1, 2):
        out = _standing_out(x, width)
        limit = FAR * float(np.quantile(out, 1.0 - share))
        for k in np.flatnonzero(out > max(limit, OF_SPREAD * spread, 1e-12)):
            bad[k : k + width] = True
    return bad


def _standing_out(x: np.ndarray, width: int) -> np.ndarray:
    """(N,) by how much samples k to k + width - 1 stand out; 0 where they do not."""
    out = np.zeros(len(x))
    n = len(x) - width - 1
    if n < 1:
        return out
    left, right = x[:n], x[width + 1 : width + 1 + n]
    up = np.min([x[1 + j : 1 + j + n] for j in range(width)], axis=0) - np.maximum(left, right)
    down = np.minimum(left, right) - np.max([x[1 + j : 1 + j + n] for j in range(width)], axis=0)
    # The neighbours must agree: a step of a torque is no outlier.
    out[1 : 1 + n] = np.maximum(np.maximum(up, down) - np.abs(left - right), 0.0)
    return out
