"""A channel that is late against the others."""

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
