"""A channel that counts in the wrong direction."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.factors import blamed
from core.check.finding import Check, Finding


class Sign(Check):
    """A channel that moves against all others."""

    kind = "sign"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in blamed(case):
            if one.factor < 0:
                sentence = f"{one.channel} moves against {one.against} and fits with the other sign"
                mend = case.column(one.channel, sign=-1)
                yield case.finding(self.kind, one.channel, -1.0, "", sentence, mend, one.expected)
