"""Lengths in millimetres where metres are meant."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.factors import blamed
from core.check.finding import Check, Finding
from core.check.geometry import MILLI

NEAR = 0.15
"""Share by which a factor may differ from 1000."""


class Millimetres(Check):
    """A factor of 1000 between a length and what others say of it."""

    kind = "millimetres"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in blamed(case):
            if one.near(MILLI, NEAR) and not one.channel.startswith(("y", "i")):
                sentence = f"{one.channel} fits {one.against} if divided by 1000, so it is in mm"
                mend = case.column(one.channel, unit="mm")
                yield case.finding(
                    self.kind, one.channel, one.factor, "", sentence, mend, one.expected
                )
