"""Numbers with as many digits as they deserve."""

from __future__ import annotations

import math

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LARGE, SMALL = 1e6, 1e-3
"""Outside these sizes a number is written with a power of ten."""


def format_value(value: float, std: float, unit: str = "") -> str:
    """'520.83 ± 0.02 N m²': the value, rounded to its standard deviation.

    The deviation keeps one digit, or two where the first is a 1. Without a finite deviation the
    value keeps four digits and no '±' is claimed.
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
    if decimals >= 0:
        return f"{value:.{decimals}f} ± {std:.{decimals}f}"
    step = 10.0**-decimals
    return f"{round(value / step) * step:.0f} ± {round(std / step) * step:.0f}"


def _power(size: float) -> int:
    """The power of ten to write apart, 0 for ordinary sizes."""
    return 0 if SMALL <= size < LARGE else math.floor(math.log10(size))


def format_number(value: float, digits: int = 4, keep_zeros: bool = False) -> str:
    """A number with `digits` significant digits, '–' where there is none.

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


def format_percent(value: float) -> str:
    """'97.12', two decimals: a FIT differs between models in the second."""
    return f"{value:.2f}" if math.isfinite(value) else "–"


def with_unit(text: str, unit: str) -> str:
    """The text and its unit with a space that does not break."""
    return f"{text}\N{NO-BREAK SPACE}{unit}" if unit else text
