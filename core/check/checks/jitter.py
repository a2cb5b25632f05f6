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

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        time = found.time[np.isfinite(found.time)]
        if len(time) < 20:
            return
        steps = np.diff(time)
        whole = np.round(steps / found.step)
        plain = steps[whole == 1.0] if np.mean(whole == 1.0) > 0.5 else steps
        # Two neighbouring stamps scatter independently: their distance has twice the variance.
        spread = float(np.std(plain)) / np.sqrt(2.0)
        many = float(np.mean(np.abs(plain - np.median(plain)) > SHARE * found.step))
        if spread > SHARE * found.step and many > 0.2:
            sentence = (
                f"t scatters by {1e3 * spread:.3g} ms around an even clock of {found.step:.4g} s"
            )
            yield case.finding(self.kind, "t", spread, "s", sentence, RESAMPLE_LINE)
