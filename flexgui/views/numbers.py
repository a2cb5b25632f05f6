"""Numbers with as many digits as they deserve."""

from __future__ import annotations

import math

from core.written import format_number, format_value, with_unit

__all__ = ["format_number", "format_percent", "format_value", "with_unit"]


def format_percent(value: float) -> str:
    """'97.12', two decimals: a FIT differs between models in the second."""
    return f"{value:.2f}" if math.isfinite(value) else "–"
