"""Whole columns that are wrong: units, signs, swaps, factors and shifts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

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
    "stated_stiffness": "{0} {fit} the recording if divided by {1:.4g}",
}
UNITS = {"degrees": ("rad", "deg"), "millimetres": ("m", "mm")}


class WrongColumns(Check):
    """What mends the contradictions of a recording's channels once it is taken back."""

    kind = "wrong_columns"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in case.causes:
            fit = "fit" if len(one.channels) > 1 else "fits"
            names = _listed(one.channels, "and")
            sentence = SENTENCES[one.fault].format(names, one.factor, one.shift, fit=fit)
            if one.alternatives:
                sentence += f"; so would {_listed(one.alternatives, 'or')}"
            mend = None if one.alternatives else _fix_line(case, one)
            size = one.shift or one.factor
            unit = "SI" if one.shift else ""
            yield case.finding(one.fault, one.channels[0], size, unit, sentence, mend)
        tip = case.tip_off
        if tip:
            sentence = f"the camera sees the tip {tip[0]:.3g} m from where the encoders put it"
            sentence += f", on an arm of {tip[1]:.3g} m"
            yield case.finding("tip", "z1", tip[0], "m", sentence)


def _listed(names: tuple[str, ...], last: str) -> str:
    *first, end = names
    return f"{', '.join(first)} {last} {end}" if first else end


def _fix_line(case: Case, one: ColumnFault) -> str | None:
    """The line that takes a cause back; None where none can."""
    if one.shift:
        return None
    other = str.maketrans(one.exchanged, one.exchanged[::-1])
    return case.columns({n: (n.translate(other), _settings(case, one, n)) for n in one.channels})


def _settings(case: Case, one: ColumnFault, name: str) -> Mapping[str, Any]:
    if one.fault in UNITS:
        return {"unit": unit_of(case.recording, name).replace(*UNITS[one.fault])}
    if one.fault == "sign":
        return {"sign": -1}
    return {} if one.exchanged else {"gain": f"{1.0 / one.factor:.9g}"}
