"""What a design says to the person who will make the experiments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.diagnose.evidence import TIE
from core.experiments.design import Candidate, Design, Deviation
from core.experiments.trial import KEPT
from core.recording.channels import channel_kind
from core.sentences import listed
from core.written import format_number, quantity

LITTLE = 0.95
"""Share of the deviation before from which on an experiment is not worth its time for it."""


def unit_of(design: Design) -> str:
    """Of the references that are played."""
    model = design.fitted.model
    return channel_kind(model.drive.reference_channels(model.arm)[0]).units[0]


def words(design: Design) -> tuple[str, ...]:
    """One paragraph each: what to play, what it tells, what it decides."""
    count = len(design.chosen)
    if not count:
        return ("The search was stopped before an experiment was chosen.",)
    seconds = sum(c.trial.seconds for c in design.chosen)
    opening = (
        f"Record {count} experiment{'s' if count > 1 else ''}, {format_number(seconds, 3)} s in "
        f"all. By the fitted model each uses at most {100 * KEPT:.0f} % of every limit."
    )
    lines = [_line(n, c, design) for n, c in enumerate(design.chosen, start=1)]
    return (opening, *lines, _narrowed(design.deviations), *_decided(design))


def _line(number: int, c: Candidate, design: Design) -> str:
    starts = listed(
        [f"θ{chr(0x2081 + k)} = {format_number(x, 4)}" for k, x in enumerate(c.trial.start)]
    )
    unit = unit_of(design)
    return f"{number}. Start at rest at {starts} (rad, m on a slide). {c.trial.described(unit)}."


def _narrowed(deviations: Sequence[Deviation]) -> str:
    narrowed = [d for d in deviations if d.after < LITTLE * d.before]
    if not narrowed:
        return "No parameter becomes known better by these experiments."
    parts = [
        f"{d.estimate.name} {_deviation(d.before, d)} to {_deviation(d.after, d)}" for d in narrowed
    ]
    rest = [d.estimate.name for d in deviations if d not in narrowed]
    more = f" Not narrowed: {listed(rest)}." if rest else ""
    return (
        "Expected standard deviations, before and after, of a fit to all channels as a diagnosis "
        f"makes it: {listed(parts)}.{more}"
    )


def _deviation(value: float, d: Deviation) -> str:
    return quantity(value, d.estimate.unit, 2)


def _decided(design: Design) -> tuple[str, ...]:
    if not design.competing:
        return ()
    names, score = listed(list(design.competing)), format_number(design.score, 2)
    if design.decides:
        return (
            f"Between {names}, the wrong one would be worse by an expected score of {score}, where "
            f"above {TIE:g} decides.",
        )
    return (
        f"These limits leave no experiment that tells {names} apart: an expected score of {score}, "
        f"where above {TIE:g} decides.",
    )


def tightest(c: Candidate, design: Design) -> float:
    """Share of the tightest limit that an experiment uses, by the fitted model."""
    own, tip = design.limits.used(c.trial.motion(design.fitted))
    return float(max(np.max(own), tip))
