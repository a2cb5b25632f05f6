"""A drive at its limit."""

from __future__ import annotations

from collections.abc import Iterable

from core.check.case import Case
from core.check.finding import Check, Finding
from core.check.limits import limit_of


class DriveSaturated(Check):
    """Torque or current that stays at its largest value."""

    kind = "drive_saturated"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        for name in found.names("u#", "i#"):
            limit = limit_of(found.counted(name))
            if limit is not None:
                level, share = limit
                said = (
                    f"{name} stays at {level:.6g} in {share:.1%} of its samples: the drive's limit"
                )
                yield case.finding(self.kind, name, abs(level), "SI", said)
