"""Sentences about planned experiments: one that distinguishes two effects, and a whole plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from flexgui.core.recording.channels import channel_kind
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import PlannedExperiment
from flexgui.core.sentences import listed
from flexgui.sentences.figures import VERY_STRONG
from flexgui.sentences.written import format_number, quantity

if TYPE_CHECKING:
    from flexgui.core.experiments.design import Candidate, Design, ParameterDeviation

SCORE = "expected score {} (above {:g} decides)"

LITTLE = 0.95
"""A standard deviation above this share of the one before counts as not improved."""


def experiment_title(experiment: PlannedExperiment) -> str:
    """'3 s at θ₂ = 90° with ±0.6 rad/s, each level held for 0.1 s'."""
    spec = SimulateSpec.model_validate(experiment.simulate)
    return (
        f"{_long_at(spec.seconds, spec.theta2)} with ±{format_number(spec.amplitude, 2)} "
        f"{experiment.unit}, each level held for {format_number(spec.hold, 2)} s"
    )


def _long_at(seconds: float, theta2: float | None) -> str:
    place = "" if theta2 is None else f" at θ₂ = {math.degrees(theta2):.0f}°"
    return f"{format_number(seconds, 3)} s{place}"


def experiment_sentence(experiment: PlannedExperiment) -> str:
    """Whether it would distinguish two effects."""
    text, names = experiment_title(experiment), listed(experiment.between)
    score = format_number(experiment.score, 2)
    if experiment.score < VERY_STRONG:
        return f"{text} would not distinguish {names} (expected score {score})."
    return f"To distinguish {names}, record {text}: {SCORE.format(score, VERY_STRONG)}."


def plan_paragraphs(design: Design) -> tuple[str, ...]:
    """One paragraph each: the references, the standard deviations, the effects distinguished."""
    from flexgui.core.experiments.trial import USED_SHARE

    count = len(design.chosen)
    if not count:
        return ("The search was stopped before an experiment was chosen.",)
    seconds = sum(c.trial.seconds for c in design.chosen)
    opening = (
        f"Record {count} experiment{'s' if count > 1 else ''}, {format_number(seconds, 3)} s in "
        f"total. By the fitted model each uses at most {100 * USED_SHARE:.0f} % of every limit."
    )
    lines = [_references(n, c, design) for n, c in enumerate(design.chosen, start=1)]
    return (opening, *lines, _improved(design.deviations), *_distinguished(design))


def _references(number: int, candidate: Candidate, design: Design) -> str:
    trial, model = candidate.trial, design.fitted.model
    units = ["m" if s.joint == "prismatic" else "rad" for s in model.arm.segments]
    starts = listed(
        [f"θ{chr(0x2081 + k)} = {format_number(x, 4)} {units[k]}"
         for k, x in enumerate(trial.start)]
    )  # fmt: skip
    unit = channel_kind(model.drive.reference_channels(model.arm)[0]).units[0]
    sizes = " and ".join(f"±{format_number(a, 2)}" for a in trial.amplitudes)
    return (
        f"{number}. Start at rest at {starts}. "
        f"{_long_at(trial.seconds, trial.start[1] if len(trial.start) > 1 else None)} with {sizes} "
        f"{unit}, {trial.form}."
    )


def _improved(deviations: Sequence[ParameterDeviation]) -> str:
    improved = [d for d in deviations if d.after < LITTLE * d.before]
    if not improved:
        return "These experiments improve no estimate."
    parts = [
        f"{d.estimate.name} {quantity(d.before, d.estimate.unit, 2)} to "
        f"{quantity(d.after, d.estimate.unit, 2)}"
        for d in improved
    ]
    others = [d.estimate.name for d in deviations if d not in improved]
    more = f" Not improved: {listed(others)}." if others else ""
    return (
        "Expected standard deviations, before and after, in a fit to all channels: "
        f"{listed(parts)}.{more}"
    )


def _distinguished(design: Design) -> tuple[str, ...]:
    if not design.competing:
        return ()
    names = listed(list(design.competing))
    score = SCORE.format(format_number(design.score, 2), VERY_STRONG)
    if design.decides:
        return (f"They distinguish {names}: {score}.",)
    return (f"No experiment within these limits distinguishes {names}: {score}.",)
