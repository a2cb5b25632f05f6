"""Time in milliseconds or finer units where seconds are meant."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding

SLOWEST = 0.25
"""s: no logger of a moving arm samples more seldom than 4 Hz."""
UNITS = ((1e3, "ms"), (1e6, "us"), (1e9, "ns"))


class TimeUnit(Check):
    """A sample time that no logger has."""

    kind = "time_unit"

    def find(self, case: Case) -> Iterable[Finding]:
        step = case.recording.stated_step
        if step <= SLOWEST:
            return
        factor, unit = next((u for u in UNITS if step / u[0] <= SLOWEST), UNITS[-1])
        sentence = f"t steps by {step:g}; as seconds that is {1 / step:.3g} Hz, so it is in {unit}"
        fix = case.columns({"t": ("t", {"unit": unit})})
        yield case.finding(self.kind, "t", factor, "", sentence, fix)
