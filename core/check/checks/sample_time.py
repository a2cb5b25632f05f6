"""A time column that runs too fast or too slow."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.clock_speed import clock_speed
from core.check.finding import Check, Finding


class SampleTime(Check):
    """The loop's motion fits only with another sample time."""

    kind = "sample_time"

    def look(self, case: Case) -> Iterable[Finding]:
        found = clock_speed(case)
        if found is None:
            return
        factor, explained, before = found
        step = case.recording.step / factor
        said = (
            f"the motion fits the references with {step:.4g} s per row ({explained:.1%} explained) "
            f"instead of {case.recording.step:.4g} s ({max(before, 0.0):.1%})"
        )
        mend = case.column("t", gain=f"{1.0 / factor:.6g}")
        yield case.finding(self.kind, "t", factor, "", said, mend)
