"""What is to be said in red of a model that is far from the noise floor."""

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
