"""Channels that are late, or ever later, against the others."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding
from ...recording.channels import from_camera


class Delay(Check):
    """A lag that no drive and no filter explains."""

    kind = "delay"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        for suspect in case.suspects:
            if suspect.delay == 0.0:
                continue
            sentence = f"{suspect.channel} lags {suspect.against} by {1e3 * suspect.delay:.3g} ms"
            # Camera columns alone have a clock of their own that a scenario can move.
            camera = from_camera(suspect.channel)
            fix = f"time_shift = {suspect.delay:.6g}" if camera else None
            yield case.finding(
                self.kind, suspect.channel, suspect.delay, "s", sentence, fix, suspect.expected
            )


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
