"""Two loggers with clocks of different speed."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding


class ClockDrift(Check):
    """A lag that grows with time."""

    kind = "clock_drift"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        for suspect in case.suspects:
            if suspect.drift == 0.0:
                continue
            size = f"{1e3 * suspect.drift:.3g} ms per second"
            sentence = f"{suspect.channel} lags {suspect.against} by a growing delay: {size}"
            yield case.finding(
                self.kind, suspect.channel, suspect.drift, "s/s", sentence, None, suspect.expected
            )
