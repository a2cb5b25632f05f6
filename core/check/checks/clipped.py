"""A channel cut off at a limit."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import limit_of
from ...recording.channels import DRIVES, is_reference, role_of


class Clipped(Check):
    """Values pile up at the largest or the smallest one; drives have a check of their own."""

    kind = "clipped"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            if is_reference(name) or role_of(name) in DRIVES:
                continue
            limit = limit_of(recording.counted(name))
            if limit is not None:
                level, share = limit
                sentence = f"{name} stops at {level:.6g} in {share:.1%} of its samples"
                yield case.finding(self.kind, name, level, "SI", sentence)
