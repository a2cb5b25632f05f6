"""An encoder on the motor side of a gear that nobody stated."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.factors import blamed, other_units
from core.check.finding import Check, Finding

SMALLEST, LARGEST = 3, 300
"""A factor of two is a scale as often as a gear; above, a unit."""
WHOLE = 0.03
"""Share by which the factor may differ from a whole number: friction and noise of the loop."""


class GearRatio(Check):
    """A whole factor between an encoder and the joint that the others see."""

    kind = "gear_ratio"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in blamed(case):
            ratio = round(one.factor)
            geared = one.channel in ("theta1", "theta2", "theta3") and not other_units(one)
            if geared and SMALLEST <= ratio <= LARGEST and one.near(ratio, max(WHOLE, 0.3 / ratio)):
                sentence = f"{one.channel} turns {ratio} times as far as {one.against} say: a gear"
                mend = case.column(one.channel, gain=f"{1.0 / one.factor:.9g}")
                found = self.kind, one.channel, ratio
                yield case.finding(*found, "", sentence, mend, one.expected)
