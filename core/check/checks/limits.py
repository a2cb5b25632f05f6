"""Channels cut off at a limit, and drives at theirs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.signals import limit_of
from ...recording.channels import DRIVES, Role, is_reference, role_of

COMMANDED = (*DRIVES, Role.VOLTAGE)
"""What a motor is given; a limit of it is the drive's, and no sensor's."""


class Clipped(Check):
    """Values pile up at the largest or the smallest one; drives have a check of their own."""

    kind = "clipped"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            if is_reference(name) or role_of(name) in COMMANDED:
                continue
            limit = limit_of(recording.counted(name))
            if limit is not None:
                level, share = limit
                sentence = f"{name} stops at {level:.6g} in {share:.1%} of its samples"
                yield case.finding(self.kind, name, level, "SI", sentence)


HELD = 0.5
"""Of the samples off the limit that repeat the one before: a command that is held from one change
to the next stands at its largest value as at any other, and nothing cuts it off there."""


class DriveSaturated(Check):
    """Torque, current or voltage that stays at its largest value."""

    kind = "drive_saturated"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.names("u#", "i#", "voltage#"):
            limit = limit_of(recording.counted(name))
            if limit is not None and not _steps(recording.counted(name), limit[0]):
                level, share = limit
                sentence = (
                    f"{name} stays at {level:.6g} in {share:.1%} of its samples: the drive's limit"
                )
                yield case.finding(self.kind, name, abs(level), "SI", sentence)


def _steps(values: np.ndarray, level: float) -> bool:
    """Whether what is not at the level (N,) is held as well."""
    x = values[np.isfinite(values)]
    off = x[1:] != level
    return bool(np.mean(x[1:][off] == x[:-1][off]) > HELD) if off.any() else True
