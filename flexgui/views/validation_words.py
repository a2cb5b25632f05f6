"""What it means that a model fails on recordings to which it was not fitted."""

from __future__ import annotations

from flexgui.views.numbers import format_number

MUCH = 3.0
"""Times the error of the fitted recordings: less is no news."""


def validation_words(estimation: float, validation: float) -> str:
    """One sentence, '' where there is nothing to say. Both errors in floors, rms."""
    if not validation > MUCH * max(estimation, 1.0):
        return ""
    fitted, other = (format_number(x, 2, keep_zeros=True) for x in (estimation, validation))
    return (
        f"On the validation recording the error is {other} times the noise floor, {fitted} times "
        "on those that the model was fitted to: its motion and postures differ, and there a "
        "fit cannot compensate for what the model lacks."
    )
