"""The fits of a scenario, over all its recordings or one each, and each recording against them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .arm.build import build_arm
from .identify.compare import compare_many
from .identify.fit import Fitted, identify
from .identify.fit_unknowns import unknowns_with_starts
from .identify.loop_rate import FASTER_LOOP
from .identify.prepared_recording import prepare
from .identify.setup import Setup, make_setup
from .identify.unknowns import Unknowns, fixed_values
from .progress import Progress, Silent
from .recording.recording import Recording
from .results import RecordingComparison, Variant
from .scenario.schema import CompareSpec, IdentifySpec, Scenario
from .scenario.stated_effects import (
    bare_model,
    fitting,
    with_effect_parameters,
    with_stated_effects,
)

MEAN_LABEL = "mean of the local fits"


def fit_all(
    setup: Setup, recordings: Sequence[Recording], spec: IdentifySpec, progress: Progress
) -> list[Fitted]:
    """One fit over all estimation recordings, or one per recording."""
    chosen = [r for r in recordings if r.role == "estimate"]
    groups = [[r] for r in chosen] if spec.method == "local" else [chosen]
    stated = "generations" in spec.model_fields_set or setup.model.level == "lpv"
    generations = spec.generations * len(groups) if stated else 0
    progress.stage("Identifying", generations or None)
    return [fit_group(setup, group, spec, progress, len(groups) > 1) for group in groups]


def fit_group(
    setup: Setup,
    group: Sequence[Recording],
    spec: IdentifySpec,
    progress: Progress,
    named: bool,
    fixed: Mapping[str, float] | None = None,
    unknowns: Unknowns | None = None,
) -> Fitted:
    """One fit over a group of recordings.

    `fixed`: values that are held, else those that the scenario states; `unknowns`: what is
    estimated, else what the scenario asks for; `named`: whether it has its first recording's name.
    """
    model = setup.model
    if unknowns is None:
        unknowns = unknowns_with_starts(model, spec, group, setup.outputs)
    fixed_here = dict(fixed_values(model, spec, unknowns)) if fixed is None else dict(fixed)
    experiments = [prepare(model, r, setup.outputs, setup.processing) for r in group]
    label = group[0].name if named or len(group) == 1 else "all recordings"
    return identify(label, experiments, unknowns, spec, fixed_here, progress)


def setup_of_fits(setup: Setup, fits: Sequence[Fitted]) -> Setup:
    """The setup with the virtual servo of the fits, where all agree on it and were not stopped, and
    a note on its loop."""
    first, *others = [f.residuals.experiments[0].model.steering for f in fits]
    stopped = any(f.fit.stopped for f in fits)
    if stopped or first in (None, setup.model.steering) or any(s != first for s in others):
        return setup
    model = setup.model.steered_by(first)
    return replace(setup, model=model, notes=(*setup.notes, FASTER_LOOP))


def shared_by_fits(fits: Sequence[Fitted]) -> dict[str, float]:
    """Shared values of the fit; the mean over local fits."""
    shared = [
        {**f.residuals.predictor.fixed, **f.residuals.unknowns.values_for(None, f.vector)}
        for f in fits
    ]
    return {name: float(np.mean([values[name] for values in shared])) for name in shared[0]}


def compare_all(
    setup: Setup,
    recordings: Sequence[Recording],
    fits: Sequence[Fitted],
    spec: IdentifySpec,
    progress: Progress,
) -> tuple[RecordingComparison, ...]:
    """Each recording against the fit that saw it, the others against all fits."""
    model, outputs, processing = setup.model, setup.outputs, setup.processing
    notes = {}
    by_steps: dict[int | None, list[tuple[Recording, Mapping[str, float], str]]] = {}
    for r in recordings:
        own = next((f for f in fits if r.name in f.fit.recordings), None)
        values, label, notes[r.name] = _values_for(setup, r, own, fits, spec)
        steps = _steps_compared(own or fits[0])
        by_steps.setdefault(steps, []).append((r, values, label))
    compared = {
        c.recording: replace(c, note=f"{notes[c.recording]} {c.note}".strip())
        for steps, chosen in by_steps.items()
        for c in compare_many(model, chosen, outputs, processing, steps)
    }
    progress.advance(len(recordings))
    return tuple(compared[r.name] for r in recordings)


def _steps_compared(fitted: Fitted) -> int:
    """Steps per sample of a comparison: twice those of the fit, which miss a quarter of what these
    do. What was stopped is shown as its fit simulated it: nobody waits for more."""
    steps = fitted.residuals.predictor.steps
    return steps if fitted.fit.stopped else 2 * steps


def _values_for(
    setup: Setup, recording: Recording, own: Fitted | None, fits: Sequence[Fitted],
    spec: IdentifySpec,
) -> tuple[dict[str, float], str, str]:  # fmt: skip
    """(values, label of the fit, note): those of its own fit; a recording that no fit saw gets the
    shared values, and what belongs to a recording (zeros, the friction of another bench) is fitted
    to it alone."""
    if own is not None:
        fixed, unknowns = own.residuals.predictor.fixed, own.residuals.unknowns
        return {**fixed, **unknowns.values_for(recording.name, own.vector)}, own.fit.label, ""
    label = fits[0].fit.label if len(fits) == 1 else MEAN_LABEL
    values = shared_by_fits(fits)
    items = unknowns_with_starts(setup.model, spec, [recording], setup.outputs).items
    extra = Unknowns(tuple(item for item in items if item.recording is not None))
    if not len(extra):
        return values, label, ""
    alone = fit_group(
        setup, [recording], spec.model_copy(update={"generations": 0}), Silent(), True, values,
        extra,
    )  # fmt: skip
    names = ", ".join(item.parameter.name for item in extra.items)
    values |= extra.values_for(recording.name, alone.vector)
    return values, label, f"Fitted to this recording alone: {names}."


def compared_variant(
    scenario: Scenario,
    index: int,
    spec: CompareSpec,
    recordings: Sequence[Recording],
    progress: Progress,
) -> Variant:
    """Another arm on the same data, at its stated values or identified."""
    progress.stage(f"Comparing with: {spec.title}")
    arm = build_arm(scenario.arm)
    if spec.arm is not None:
        arm = build_arm(spec.arm, arm, f"[[compare]] {index + 1} arm")
    chosen = [replace(r, logger_filters={}) if spec.drop_logger_filters else r for r in recordings]
    bare = bare_model(scenario, arm)
    effects = fitting(bare, scenario.model)
    model = with_stated_effects(bare, effects)
    identify_spec = with_effect_parameters(scenario.identify, model, effects)
    identify_spec = _variant_spec(identify_spec, spec)
    setup = make_setup(model, identify_spec, chosen)
    fits = fit_all(setup, chosen, identify_spec, Silent())
    setup = setup_of_fits(setup, fits)
    comparisons = compare_all(setup, chosen, fits, identify_spec, Silent())
    estimates = tuple(e for f in fits for e in f.fit.estimates)
    return Variant(spec.title, estimates, comparisons)


def _variant_spec(spec: IdentifySpec, variant: CompareSpec) -> IdentifySpec:
    """The variant's own parameters; none but what belongs to a recording where it is not fitted."""
    names = spec.parameters if variant.parameters is None else variant.parameters
    if not variant.identify:
        names = tuple(n for n in names if n in spec.per_recording)
    stays = {*names, *spec.per_recording}
    bounds = {k: v for k, v in spec.bounds.items() if k in stays}
    prior = {k: v for k, v in spec.prior.items() if k in stays}
    update = {"parameters": names, "bounds": bounds, "prior": prior}
    return spec.model_copy(update=update)
