"""A channel with a wrong gain."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.checks.gear_ratio import GearRatio
from core.check.factors import blamed, other_units
from core.check.finding import Check, Finding


class Scale(Check):
    """A factor that is no unit, no sign and no gear."""

    kind = "scale"

    def look(self, case: Case) -> Iterable[Finding]:
        geared = {found.channel for found in GearRatio().look(case)}
        for one in blamed(case):
            if one.factor <= 0 or one.factor == 1.0 or other_units(one) or one.channel in geared:
                continue
            sentence = f"{one.channel} is {one.factor:.4g} times what {one.against} imply"
            mend = case.column(one.channel, gain=f"{1.0 / one.factor:.6g}")
            yield case.finding(self.kind, one.channel, one.factor, "", sentence, mend, one.expected)
