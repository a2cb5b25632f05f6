"""Measured against the fit that a diagnosis looks at: what its ladder counts, sample by sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from core.diagnose.data import Data, Hypothesis, hypothesis
from core.diagnose.descent import descend
from core.diagnose.start import Begun
from core.identify.compare import compare
from core.identify.unknowns import Unknown
from core.results import RecordingComparison
from flexgui.jobs.missing import missing_torque

LABEL = "the diagnosis, starts free"
"""Of the fit; an identification holds the starts on the encoders' first samples."""

FEW = 4
"""Iterations: starts and zeros of a recording enter almost linearly."""


def compared(begun: Begun, validation: Data | None) -> tuple[RecordingComparison, ...]:
    """All recordings: those fitted, then those that no fit saw, with starts of their own."""
    pairs = [(begun.base.hypothesis, begun.data)]
    if validation is not None:
        pairs.append(_started(begun, validation))
    found: list[RecordingComparison] = []
    agility: float | None = None  # once chosen it serves all
    for h, data in pairs:
        for i, one in enumerate(_each(h, data)):
            missing, agility = missing_torque(h, i, one, data.floors, agility)
            found.append(replace(one, missing_torque=missing) if missing else one)
    return tuple(found)


def _each(h: Hypothesis, data: Data) -> tuple[RecordingComparison, ...]:
    predictor = h.residuals.predictor
    found = []
    for e in data.experiments:
        own = h.unknowns.values_for(e.recording.name, h.vector)
        values = {**predictor.fixed, **own}
        found.append(
            compare(
                h.model, e.recording, e.outputs, e.processing, values, LABEL,
                steps=predictor.steps,
            )
        )  # fmt: skip
    return tuple(found)


def _started(begun: Begun, validation: Data) -> tuple[Hypothesis, Data]:
    """The fitted model on other recordings: only what belongs to these is fitted."""
    h = begun.base.hypothesis
    anew = _anew(h, validation)
    names = {u.parameter.name for u in anew}
    shared: Mapping[str, float] = {
        k: v for k, v in h.values().items() if "@" not in k and k not in names
    }
    own = tuple(u for u in validation.nuisance if u.recording is not None)
    fixed = {**validation.fixed, **shared}
    held = replace(validation, nuisance=own, fixed=fixed, steps=h.steps)
    values = {**h.model.effect_values, **h.values()}
    tried = hypothesis(held, h.model.effects, values, freed=anew)
    ended = descend(tried.errors, tried.slopes, tried.vector, tried.limits, most=FEW)
    return tried.at(ended.vector), held


def _anew(h: Hypothesis, validation: Data) -> Sequence[Unknown]:
    """Sizes of effects that belong to the validation's own rig."""
    own = [one for one in h.model.effects if one.kind in validation.per_recording]
    names = {
        knob.parameter.name
        for one in own
        for knob in one.knobs(h.model.arm, h.model.drive, validation.sizes)
    }
    return tuple(u for u in h.unknowns.items if u.parameter.name in names)
