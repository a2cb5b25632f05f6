"""What is to be said in red of a model that is far from the noise floor."""

from __future__ import annotations

from flexgui.views.numbers import format_number

DOUBTFUL = 2.0
"""Times the noise floor: above it most of the error is not noise, so that what rests on the model's
completeness (the verdict, the floor, ± values) says so in red."""


def doubt(error: float) -> str:
    """Of a model whose error is so many times the noise floor; empty where it is near it."""
    if not error > DOUBTFUL:
        return ""
    times = format_number(error, 2, keep_zeros=True)
    return (
        "Verdict, noise floor and ± values hold only if the model is complete; its error is "
        f"{times} times the noise floor."
    )
