"""A channel that is shifted by a constant."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding

SHARE = 0.25
"""Of the channel's own spread: a real drive's current is off by less (0.1 of it at most)."""


class Offset(Check):
    """A shift that a reference contradicts."""

    kind = "offset"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        wrong = {name for fault in case.causes for name in fault.channels}
        for name in recording.names("i#", "theta#"):
            reference = f"{name}_ref"
            if not recording.has(reference) or name in wrong or reference in wrong:
                continue
            a, b = recording.even(reference), recording.even(name)
            # A lag behind a reference cancels in it over forward and back.
            shift = float(np.median(b - a))
            if abs(shift) > SHARE * float(np.std(b)) and abs(float(np.corrcoef(a, b)[0, 1])) > 0.5:
                sentence = f"{name} is {shift:.4g} above {reference} on average"
                yield case.finding(self.kind, name, shift, "SI", sentence)
