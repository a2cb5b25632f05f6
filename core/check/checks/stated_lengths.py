"""Lengths of the scenario that are not those of the arm which was recorded."""

from __future__ import annotations

from collections.abc import Iterable

from ...check.case import Case
from ...check.finding import Check, Finding


class StatedLength(Check):
    """A link as the camera and the encoders see it, beside what is stated."""

    kind = "stated_length"

    def find(self, case: Case) -> Iterable[Finding]:
        for k, seen in case.wrong_lengths.items():
            assert case.recording.model is not None
            stated = case.recording.model.arm.segments[k].length
            sentence = (
                f"[arm] length of segment {k + 1} is {stated:g} m; camera and encoders show "
                f"{seen:.3g} m. State the length from joint to joint, or to the tip that the "
                "camera sees"
            )
            yield case.finding(self.kind, f"l{k + 1}", stated / seen, "", sentence)
