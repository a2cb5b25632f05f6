"""Time stamps in another unit, out of order, or uneven."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import RESAMPLE_LINE, Check, Finding
from ...recording.clock import JITTER

SLOWEST = 0.25
"""s: no logger of a moving arm samples more seldom than 4 Hz."""
CLOCK_UNITS = ((1e3, "ms"), (1e6, "us"), (1e9, "ns"))


class TimeUnit(Check):
    """A sample time that no logger has."""

    kind = "time_unit"

    def find(self, case: Case) -> Iterable[Finding]:
        step = case.recording.stated_step
        if step <= SLOWEST:
            return
        factor, unit = next((u for u in CLOCK_UNITS if step / u[0] <= SLOWEST), CLOCK_UNITS[-1])
        sentence = f"t steps by {step:g}; as seconds that is {1 / step:.3g} Hz, so it is in {unit}"
        fix = case.columns({"t": ("t", {"unit": unit})})
        yield case.finding(self.kind, "t", factor, "", sentence, fix)


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
        many = float(np.mean(np.abs(plain - np.median(plain)) > JITTER * recording.step))
        if spread > JITTER * recording.step and many > 0.2:
            size = f"{1e3 * spread:.3g} ms"
            sentence = f"t scatters by {size} around an even clock of {recording.step:.4g} s"
            yield case.finding(self.kind, "t", spread, "s", sentence, RESAMPLE_LINE)
