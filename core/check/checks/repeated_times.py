"""Rows with the time of the row before."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import RESAMPLE_LINE, Check, Finding


class RepeatedTimes(Check):
    """Time stamps that do not increase."""

    kind = "repeated_times"

    def find(self, case: Case) -> Iterable[Finding]:
        time = case.recording.time
        steps = np.diff(time[np.isfinite(time)])
        count = int(np.sum(steps <= 0))
        if count:
            back = int(np.sum(steps < 0))
            sentence = f"non-increasing timestamps: {count - back} repeat and {back} decrease"
            yield case.finding(self.kind, "t", count, "samples", sentence, RESAMPLE_LINE)
