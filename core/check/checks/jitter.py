"""Time stamps that are not even."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import RESAMPLE_LINE, Check, Finding

SHARE = 0.02
"""Of the sample time; rounding of the time column and real loggers stay below 1 %."""


class Jitter(Check):
    """Steps of the time column that scatter."""

    kind = "jitter"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        time = recording.time[np.isfinite(recording.time)]
        if len(time) < 20:
            return
        steps = np.diff(time)
        whole = np.round(steps / recording.step)
        plain = steps[whole == 1.0] if np.mean(whole == 1.0) > 0.5 else steps
        # Two neighbouring stamps scatter independently: their distance has twice the variance.
        spread = float(np.std(plain)) / np.sqrt(2.0)
        many = float(np.mean(np.abs(plain - np.median(plain)) > SHARE * recording.step))
        if spread > SHARE * recording.step and many > 0.2:
            size = f"{1e3 * spread:.3g} ms"
            sentence = f"t scatters by {size} around an even clock of {recording.step:.4g} s"
            yield case.finding(self.kind, "t", spread, "s", sentence, RESAMPLE_LINE)
