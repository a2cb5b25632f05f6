"""Angles in degrees where radians are meant."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.factors import blamed
from core.check.finding import Check, Finding
from core.check.geometry import DEGREES

NEAR = 0.08
"""Share by which a factor may differ from that of the unit: dry friction takes as much."""


class Degrees(Check):
    """A factor of 57.3 between a joint and what others say of it."""

    kind = "degrees"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in blamed(case):
            if one.channel.startswith(("theta", "dtheta")) and one.near(DEGREES, NEAR):
                unit = "deg/s" if one.channel.startswith("d") else "deg"
                sentence = (
                    f"{one.channel} fits {one.against} if divided by 57.3, so it is in {unit}"
                )
                mend = case.column(one.channel, unit=unit)
                yield case.finding(
                    self.kind, one.channel, one.factor, "", sentence, mend, one.expected
                )
