"""How a study's quantities are called."""

from __future__ import annotations

import math

from core.written import format_number

SYMBOLS = {"epsilon": ("ε", "GPa", 1e-9), "d": ("d", "mm", 1e3)}
"""name -> symbol, shown unit, factor."""

RATES = {
    "tip": "J at the tip's own angles",
    "encoders": "J at the encoders' angles",
    "working point": "J at the working point",
}
EXCITATIONS = {"prbs": "plain PRBS", "prbs_balanced": "balanced PRBS"}


def snr(snr_db: float | None) -> str:
    """'SNR ∞' or '20 dB'."""
    return "SNR ∞" if snr_db is None else f"{snr_db:g} dB"


def shown(name: str) -> tuple[str, str, float]:
    """(symbol, unit, factor) of a parameter."""
    return SYMBOLS.get(name, (name, "SI", 1.0))


def fit_name(label: str, theta2: float | None) -> str:
    """'local π/8' for the first working point of the paper."""
    return label if theta2 is None else f"local {angle(theta2)}"


def angle(theta2: float) -> str:
    """'3π/8' where that is what it is, else degrees."""
    eighths = theta2 / (math.pi / 8.0)
    whole = round(eighths)
    if whole and abs(eighths - whole) < 1e-6:
        return "π/8" if whole == 1 else f"{whole}π/8"
    return f"{math.degrees(theta2):.1f}°"


def percent(share: float, digits: int = 3) -> str:
    """'0.123 %'"""
    return f"{format_number(100.0 * share, digits)} %" if math.isfinite(share) else "–"


def signed(share: float) -> str:
    """'+0.12 %'"""
    if not math.isfinite(share):
        return "–"
    text = f"{100.0 * share:+.2f}"
    return f"{text[1:] if float(text) == 0.0 else text.replace('-', '−')} %"
