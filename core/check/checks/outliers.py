"""Single samples far from their neighbours."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.signals import MOST_OUTLIERS, far_out
from ...recording.channels import Role, is_reference, role_of

PLACE_ROLES = (Role.PLACE, Role.TIP)
"""Which inertia keeps from standing out anywhere: up to MOST_OUTLIERS of them may be outliers."""
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
            bad = far_out(values[good], MOST_OUTLIERS if role_of(name) in PLACE_ROLES else JUMPING)
            if 0 < bad.sum() <= MOST_OUTLIERS * len(good):
                times = recording.time[good][bad]
                count = int(bad.sum())
                first = ", ".join(f"{t:.4g}" for t in times[:3])
                sentence = f"{name} has {count} samples far from their neighbours, at {first} s"
                h = recording.step / 2
                spans = ", ".join(f"[{t - h:.9g}, {t + h:.9g}]" for t in times)
                fix = f"mask = {{ {name} = [{spans}] }}" if count <= 20 else None
                yield case.finding(self.kind, name, count, "samples", sentence, fix)
