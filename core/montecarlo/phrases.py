"""Pieces of the sentences that a study writes."""

from __future__ import annotations


def snr_words(snr_db: float | None) -> str:
    """'SNR ∞' or '20 dB'."""
    return "SNR ∞" if snr_db is None else f"{snr_db:g} dB"


def signed(value: float, digits: int) -> str:
    """'+0.03', with a true minus, and no sign before a zero."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")
