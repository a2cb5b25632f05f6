"""Two loggers with clocks of different speed."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding


class ClockDrift(Check):
    """A lag that grows with time."""

    kind = "clock_drift"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in case.suspects:
            if one.drift == 0.0:
                continue
            sentence = (
                f"{one.channel} falls behind {one.against} by {1e3 * one.drift:.3g} ms per second"
            )
            yield case.finding(
                self.kind, one.channel, one.drift, "s/s", sentence, None, one.expected
            )
