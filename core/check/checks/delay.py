"""A channel that is late against the others."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding
from ...recording.channels import from_camera


class Delay(Check):
    """A lag that no drive and no filter explains."""

    kind = "delay"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in case.suspects:
            if one.delay == 0.0:
                continue
            sentence = f"{one.channel} is {1e3 * one.delay:.3g} ms late against {one.against}"
            # Camera columns alone have a clock of their own that a scenario can move.
            camera = from_camera(one.channel)
            mend = f"time_shift = {one.delay:.6g}" if camera else None
            yield case.finding(self.kind, one.channel, one.delay, "s", sentence, mend, one.expected)
