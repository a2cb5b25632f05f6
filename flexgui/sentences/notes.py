"""How a result came about, a sentence each."""

from __future__ import annotations

from flexgui.core.results import LevelChoice, Outcome, Repeated
from flexgui.sentences.written import format_number


def notes(outcome: Outcome) -> tuple[str, ...]:
    """The chosen level, how it was done, and how well parameters repeat between runs."""
    chosen = () if outcome.chosen_level is None else (_level(outcome.chosen_level),)
    return (*chosen, *outcome.notes, *_repeats(outcome.repeated))


def _level(chosen: LevelChoice) -> str:
    number = format_number(chosen.ratio, 2)
    if chosen.level == "lpv":
        return (
            f"Model level: linear parameter-varying; on these motions it is within {number} times "
            f"the noise floor of the full equations."
        )
    if not chosen.channel:
        return "Model level: full equations, which this rig needs."
    return (
        f"Model level: full equations; the linear model misses {chosen.channel} by {number} times "
        f"the noise floor on these motions."
    )


def _repeats(found: tuple[Repeated, ...]) -> tuple[str, ...]:
    """How well each parameter repeats, then the runs that disagree."""
    return (
        *(
            f"{one.name} repeats to {_percent(one.between, one.mean)} between runs; one run knows "
            f"it to {_percent(one.within, one.mean)}."
            for one in found
        ),
        *(
            f"Run {each.run} differs in {one.name} by {100.0 * each.share:+.2g} %: temperature, "
            f"load or gain."
            for one in found
            for each in one.disagreeing
        ),
    )


def _percent(deviation: float, value: float) -> str:
    return f"{100.0 * deviation / abs(value):.2g} %" if value else f"{deviation:.2g}"
