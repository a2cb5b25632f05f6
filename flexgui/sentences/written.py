"""Numbers, sizes and channels as people write them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexgui.core.results import Estimate

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LARGE, SMALL = 1e6, 1e-3
"""Outside these sizes a number is written with a power of ten."""
SMALLEST_POWER = -300
"""A computer's smallest numbers are less than any power of ten that it knows."""


def format_value(value: float, std: float, unit: str = "") -> str:
    """'520.83 ± 0.02 N m²': the value, rounded to its standard deviation `std` in the same unit.

    The deviation keeps one digit, or two where the first is a 1; the value at least two of its own,
    so that one that is hardly known is still read as it is. Without a finite deviation the value
    keeps four digits and no '±' is claimed.
    """
    if not math.isfinite(value):
        return "–"
    if not math.isfinite(std) or std <= 0.0:
        return with_unit(format_number(value), unit)
    power = _power(max(abs(value), std))
    text = f"{_rounded(value / 10**power, std / 10**power)}"
    return with_unit(f"({text}) × 10{str(power).translate(SUPERSCRIPTS)}" if power else text, unit)


def _rounded(value: float, std: float) -> str:
    """'value ± std' in fixed notation with the digits of `format_value`."""
    exponent = math.floor(math.log10(std))
    first = round(std / 10.0**exponent, 1)
    decimals = -exponent + (1 if first < 2.0 else 0)
    own = 1 - math.floor(math.log10(abs(value))) if value else decimals
    own = min(max(own, decimals), decimals + MOST_BEYOND)
    return f"{_to_decimals(value, own)} ± {_to_decimals(std, decimals)}"


MOST_BEYOND = 3
"""Digits of a value beyond those of its deviation: a millionth of it is nought."""


def _to_decimals(x: float, decimals: int) -> str:
    """In fixed notation; to tens, hundreds, … where `decimals` are negative."""
    step = 10.0 ** max(-decimals, 0)
    return f"{round(x / step) * step if step > 1.0 else x:.{max(decimals, 0)}f}"


def _power(size: float) -> int:
    """The power of ten to write apart, 0 for ordinary sizes."""
    return 0 if SMALL <= size < LARGE else max(math.floor(math.log10(size)), SMALLEST_POWER)


def format_number(value: float, digits: int = 4, keep_zeros: bool = False) -> str:
    """A value of any unit with `digits` significant digits, '–' where there is none.

    `keep_zeros` writes 9.70 instead of 9.7, so that a column of results stands in line.
    """
    if not math.isfinite(value):
        return "–" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    if value == 0.0:
        return "0"
    power = _power(abs(value))
    if power:
        exponent = str(power).translate(SUPERSCRIPTS)
        return f"{value / 10.0**power:.{digits - 1}f} × 10{exponent}".replace("-", "−")
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    text = f"{value:.{decimals}f}"
    if "." in text and not keep_zeros:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", "−")


def with_unit(text: str, unit: str) -> str:
    """The text and its unit, s^2 as s², with a space that does not break."""
    raised = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(SUPERSCRIPTS), unit)
    return f"{text}\N{NO-BREAK SPACE}{raised}" if unit else text


LARGER = {"Pa": ((1e8, 1e-9, "GPa"), (1e5, 1e-6, "MPa")), "N": ((1e4, 1e-3, "kN"),)}
"""Unit -> (from this size on, factor, shown unit)."""

SMALLER = {
    "m": (0.2, 1e3, "mm"),
    "m/s": (0.02, 1e3, "mm/s"),
    "rad": (0.02, 1e3, "mrad"),
    "rad/s": (0.02, 1e3, "mrad/s"),
    "N m": (0.02, 1e3, "mN m"),
    "s": (0.2, 1e3, "ms"),
}
"""Unit -> (below this size, factor, shown unit)."""


@dataclass(frozen=True)
class ShownUnit:
    """A number in the unit of the results times `factor` is the number in `name`."""

    factor: float
    name: str

    def label(self, what: str) -> str:
        """An axis title such as 'θ1 [mrad]'."""
        return f"{what} [{self.name or '–'}]"


def shown_unit(values: float | np.ndarray, unit: str) -> ShownUnit:
    """The unit to show `values` in, by their largest finite size."""
    sizes = np.abs(np.atleast_1d(np.asarray(values, dtype=float)))
    sizes = sizes[np.isfinite(sizes)]
    largest = float(sizes.max()) if sizes.size else 0.0
    for limit, factor, name in LARGER.get(unit, ()):
        if largest >= limit:
            return ShownUnit(factor, name)
    limit, factor, name = SMALLER.get(unit, (0.0, 1.0, unit))
    if 0.0 < largest < limit:
        return ShownUnit(factor, name)
    return ShownUnit(1.0, unit)


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A `value` in an SI `unit`, in one that suits it: '0.21 mm'."""
    if not math.isfinite(value):
        return "–"
    shown = shown_unit(value, unit)
    return with_unit(format_number(value * shown.factor, digits, keep_zeros=True), shown.name)


def angle(theta: float) -> str:
    """'3π/8' for an angle theta in rad that is such a multiple, else degrees: '75.0°'."""
    eighths = theta / (math.pi / 8.0)
    whole = round(eighths)
    if whole and abs(eighths - whole) < 1e-6:
        return "π/8" if whole == 1 else f"{whole}π/8"
    return f"{math.degrees(theta):.1f}°"


def estimate_text(e: Estimate) -> str:
    """'520.83 ± 0.02 N m²', 'not determined (the fit ended at its bound 0.8 GPa)'; without a
    deviation where the data leave it free."""
    unit = shown_unit(e.value, e.unit)
    if e.undetermined:
        where = "its bound " if e.at_bound else ""
        value = format_value(e.value * unit.factor, 0.0, unit.name)
        return f"not determined (the fit ended at {where}{value})"
    return format_value(e.value * unit.factor, e.std * unit.factor, unit.name)


def equals(e: Estimate) -> str:
    """What stands between a symbol and `estimate_text`."""
    return "is" if e.undetermined else "="


def size_text(symbol: str, e: Estimate) -> str:
    """'f_c1 = 1.201 ± 0.001 N m', 'f_v2 is not determined (the fit ended at 0.013 N m s/rad)'."""
    return f"{symbol} {equals(e)} {estimate_text(e)}"


SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
DOT = "\N{COMBINING DOT ABOVE}"
BAR = "\N{COMBINING MACRON}"

STEMS = {
    "theta": "θ", "dtheta": "θ" + DOT, "y": "y", "ydot": "y" + BAR, "z": "z", "zdot": "z" + DOT,
    "u": "u", "i": "i", "deflection": "δ", "torque": "u", "epsilon": "ε",
}  # fmt: skip


def split_name(name: str) -> tuple[str, str]:
    """'theta12' -> ('theta', '12')."""
    match = re.fullmatch(r"(.*?)_?(\d*)", name)
    return (match[1], match[2]) if match else (name, "")


SLIDING = {"theta": "q", "dtheta": "q" + DOT}
"""Symbols of a joint that slides; θ is an angle."""
OF_SLIDES = ("m", "m/s")


@lru_cache(1024)
def channel_symbol(channel: str, unit: str = "") -> str:
    """'ydot1' -> 'ȳ₁'; with the SI unit of what it measures 'theta1' of a slide, in m, -> 'q₁'. An
    unknown channel keeps its name."""
    stem, number = split_name(channel)
    symbols = STEMS | SLIDING if unit in OF_SLIDES else STEMS
    return symbols[stem] + number.translate(SUBSCRIPTS) if stem in symbols else channel


def reference_symbol(channel: str, unit: str = "") -> str:
    """The same with a star for a reference: 'dtheta1_ref' -> 'θ̇₁*'."""
    measured = channel.removesuffix("_ref")
    return channel_symbol(measured, unit) + ("" if measured == channel else "*")
