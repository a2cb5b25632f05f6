"""Whole columns that are wrong: units, signs, swaps, factors and shifts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...check.case import Case
from ...check.column_faults import ColumnFault, unit_of
from ...check.finding import Check, Finding

SENTENCES = {
    "degrees": "{0} {fit} the other channels if divided by 57.3: degrees",
    "millimetres": "{0} {fit} the other channels if divided by 1000: millimetres",
    "sign": "{0} {fit} the other channels with the other sign",
    "swapped_joints": "{0} fit the other channels if they are swapped",
    "gear_ratio": "{0} turns {1:.0f} times as far as the other channels say: a gear",
    "scale": "{0} is {1:.4g} times what the other channels imply",
    "offset": "{0} fits the other channels if {2:.4g} smaller",
    "delay": "{0} fits the other channels if {3:.4g} s earlier",
    "stated_stiffness": "{0} {fit} the recording if divided by {1:.4g}",
}
UNITS = {"degrees": ("rad", "deg"), "millimetres": ("m", "mm")}


class WrongColumns(Check):
    """What mends the contradictions of a recording's channels once it is taken back."""

    kind = "wrong_columns"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        for fault in case.causes:
            fit = "fit" if len(fault.channels) > 1 else "fits"
            names = _listed(fault.channels, "and")
            sentence = SENTENCES[fault.fault].format(
                names, fault.factor, fault.shift, fault.lag, fit=fit
            )
            if fault.alternatives:
                sentence += f"; so would {_listed(fault.alternatives, 'or')}"
            sentence += f" from {fault.since:.4g} s on" if np.isfinite(fault.since) else ""
            fix = None if fault.alternatives else _fix_line(case, fault)
            size = fault.shift or fault.lag or fault.factor
            unit = "SI" if fault.shift else "s" if fault.lag else ""
            yield case.finding(fault.fault, fault.channels[0], size, unit, sentence, fix)
        tip = case.tip_off
        if tip:
            sentence = f"camera and encoders disagree by {tip[0]:.3g} m on the tip"
            sentence += f"; the arm's reach is {tip[1]:.3g} m"
            yield case.finding("tip", "z1", tip[0], "m", sentence)


def _listed(names: tuple[str, ...], last: str) -> str:
    *first, end = names
    return f"{', '.join(first)} {last} {end}" if first else end


def _fix_line(case: Case, fault: ColumnFault) -> str | None:
    """The line that takes a cause back; None where none can."""
    if fault.shift or fault.lag:
        return None
    other = str.maketrans(fault.swapped, fault.swapped[::-1])
    return case.columns(
        {n: (n.translate(other), _settings(case, fault, n)) for n in fault.channels}
    )


def _settings(case: Case, fault: ColumnFault, name: str) -> Mapping[str, Any]:
    if fault.fault in UNITS:
        return {"unit": unit_of(case.recording, name).replace(*UNITS[fault.fault])}
    if fault.fault == "sign":
        return {"sign": -1}
    return {} if fault.swapped else {"gain": f"{1.0 / fault.factor:.9g}"}


SHARE = 0.25
"""Of the channel's own spread: a real drive's current is off by less (0.1 of it at most)."""


class Offset(Check):
    """A shift that a reference contradicts."""

    kind = "offset"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        wrong = {name for fault in case.causes for name in fault.channels}
        for name in recording.names("i#", "theta#"):
            reference = f"{name}_ref"
            if not recording.has(reference) or name in wrong or reference in wrong:
                continue
            a, b = recording.even(reference), recording.even(name)
            # A lag behind a reference cancels in it over forward and back.
            shift = float(np.median(b - a))
            if abs(shift) > SHARE * float(np.std(b)) and abs(float(np.corrcoef(a, b)[0, 1])) > 0.5:
                sentence = f"{name} is {shift:.4g} above {reference} on average"
                yield case.finding(self.kind, name, shift, "SI", sentence)
