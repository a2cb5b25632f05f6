"""Whole columns that are wrong: units, signs, swaps, factors and shifts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...check.case import Case
from ...check.column_fault import TIME, ColumnFault, unit_of
from ...check.finding import Check, Finding
from ...check.sized_faults import is_absurd
from ...recording.channels import from_camera
from ...sentences import listed

SENTENCES = {
    "degrees": "{0} {fit} the other channels if divided by 57.3: degrees",
    "millimetres": "{0} {fit} the other channels if divided by 1000: millimetres",
    "sign": "{0} {fit} the other channels with the other sign",
    "swapped_joints": "{0} fit the other channels if they are swapped",
    "gear_ratio": "{0} turns {1:.0f} times as far as the other channels say: a gear",
    "scale": "{0} is {1:.4g} times what the other channels imply",
    "offset": "{0} fits the other channels if {2:.4g} {smaller}",
    "delay": "{0} {fit} the other channels if {3:.4g} s earlier",
    "clock_drift": "{0} gets ever further {behind} the other channels: {4:.3g} ms per second",
    "sample_time": "the motion fits the references with {5:.4g} s per row instead of {6:.4g} s",
    "stated_stiffness": "{0} {fit} the recording if divided by {1:.4g}",
}
CONFUSED_UNITS = {"degrees": ("rad", "deg"), "millimetres": ("m", "mm")}


class WrongColumns(Check):
    """What explains the contradictions of a recording's channels, and ends them if corrected."""

    kind = "wrong_columns"

    def find(self, case: Case) -> Iterable[Finding]:
        for fault in case.wrong_columns:
            sentence = _sentence(case, fault)
            question = case.search is not None and case.search.is_question(fault)
            if absurd := is_absurd(fault):
                sentence += ". No unit or gear does that: the arm is not the stated one"
            elif question:
                sentence += ". A missing effect or a wrong mass may explain it as well"
            fix = None if fault.alternatives or absurd else _fix_line(case, fault)
            unit = "s/s" if fault.drift else "s" if fault.lag else "SI" if fault.shift else ""
            for channel in fault.channels if fault.lag or fault.drift else fault.channels[:1]:
                finding = case.finding(fault.fault, channel, fault.size, unit, sentence, fix, True)
                yield replace(finding, is_fault=not question)


def _sentence(case: Case, fault: ColumnFault) -> str:
    many, step = len(fault.channels) > 1, case.recording.step
    sentence = SENTENCES[fault.fault].format(
        listed(fault.channels), fault.factor, abs(fault.shift), fault.lag,
        1e3 * abs(fault.drift), step / fault.factor, step, fit="fit" if many else "fits",
        smaller="smaller" if fault.shift > 0.0 else "larger",
        behind="behind" if fault.drift > 0.0 else "ahead of",
    )  # fmt: skip
    if fault.alternatives:
        sentence += f"; so would {listed(fault.alternatives, 'or')}"
    sentence += f" from {fault.since:.4g} s on" if np.isfinite(fault.since) else ""
    if fault.deviation:
        sentence += f" (standard deviation {_percent(fault.deviation / abs(fault.size))})"
    if fault.explains is None:
        return sentence
    channel, before, after = fault.explains
    fall = f"from {_percent(before)} to {_percent(after)}"
    return f"{sentence}. Once this is corrected, the unexplained part of {channel} falls {fall}"


def _percent(share: float) -> str:
    return "below 0.01%" if share < 1e-4 else f"{100.0 * share:.3g}%"


def _fix_line(case: Case, fault: ColumnFault) -> str | None:
    """The line that corrects a cause; None where none can."""
    if fault.lag and all(from_camera(n) for n in fault.channels):
        return f"time_shift = {fault.lag:.6g}"  # the camera has a clock of its own
    if fault.shift or fault.lag or fault.drift:
        return None
    if TIME in fault.channels:
        return case.columns({TIME: (TIME, {"gain": f"{1.0 / fault.factor:.6g}"})})
    other = str.maketrans(fault.swapped, fault.swapped[::-1])
    return case.columns(
        {n: (n.translate(other), _settings(case, fault, n)) for n in fault.channels}
    )


def _settings(case: Case, fault: ColumnFault, name: str) -> Mapping[str, Any]:
    if fault.fault in CONFUSED_UNITS:
        return {"unit": unit_of(case.recording.model, name).replace(*CONFUSED_UNITS[fault.fault])}
    if fault.fault == "sign":
        return {"sign": -1}
    return {} if fault.swapped else {"gain": f"{1.0 / fault.factor:.9g}"}


LARGEST_OFFSET = 0.25
"""Of the channel's own spread: a real drive's current is off by less (0.1 of it at most)."""


class Offset(Check):
    """A shift that a reference contradicts."""

    kind = "offset"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        wrong = {name for fault in case.wrong_columns for name in fault.channels}
        for name in recording.names("i#", "theta#"):
            reference = f"{name}_ref"
            if not recording.has(reference) or name in wrong or reference in wrong:
                continue
            a, b = recording.even(reference), recording.even(name)
            # A lag behind a reference cancels in it over forward and back.
            shift = float(np.median(b - a))
            alike = abs(float(np.corrcoef(a, b)[0, 1])) > 0.5
            if alike and abs(shift) > LARGEST_OFFSET * float(np.std(b)):
                sentence = f"{name} is {shift:.4g} above {reference} on average"
                yield case.finding(self.kind, name, shift, "SI", sentence)
