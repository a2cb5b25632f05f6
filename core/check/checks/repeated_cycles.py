"""An experiment that repeats itself: good, it gives the noise floor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...noise.repeated_motions import period


class RepeatedCycles(Check):
    """References that are the same again after a period."""

    kind = "repeated_cycles"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        names = recording.names("theta#_ref", "dtheta#_ref")
        if not names:
            return
        repeats = period(np.column_stack([recording.even(n) for n in names]))
        if repeats:
            span, count = repeats * recording.step, len(recording.grid) // repeats
            sentence = (
                f"the references repeat every {span:.4g} s, {count} times: their scatter is noise"
            )
            cycles = case.finding(self.kind, names[0], span, "s", sentence)
            yield replace(cycles, is_fault=False)
