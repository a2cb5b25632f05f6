"""Final results of a model: parameters, their origins, comparisons with the recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..diagnose.base_fit import BaseFit
from ..diagnose.ladder_steps import estimates
from ..effects import with_included
from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, robust_covariance
from ..estimate.fitted_model import FittedModel
from ..estimate.problem import FitData, Problem
from ..identify import identifiability
from ..identify.compare import compare_many
from ..identify.estimates import derived_estimates
from ..least_squares import SEEN, as_finite, triangular
from ..missing_torque import missing_torque
from ..results import Estimate, RecordingComparison
from ..results.comparison import DIAGNOSIS_FIT


def final_parameters(refit: FitResult) -> tuple[Estimate, ...]:
    """All shared unknowns of a fitted model and the quantities derived from them, with what the
    data determine."""
    problem = refit.problem
    x, unknowns = problem.vector, problem.unknowns
    if not len(unknowns):
        return ()
    slopes = [as_finite(S) for S in problem.residuals.slopes(x)]
    jacobian = triangular(slopes)
    _, _, null = identifiability.analyse(unknowns, x, jacobian)
    identified = identifiability.identified(null, len(unknowns))
    shared = [i for i, u in enumerate(unknowns.items) if u.recording is None]
    # What sits at a bound may be there because nothing else holds it.
    covariance = robust_covariance(refit, SEEN, ignore_bounds=True)
    whole_std = np.sqrt(np.maximum(np.diag(robust_covariance(refit, ignore_bounds=True)), 0.0))
    free = {unknowns.items[i].parameter.name: float(whole_std[i]) for i in shared}
    determined = identifiability.determined(unknowns, x, covariance, null)
    shown = {unknowns.items[i].parameter.name: bool(determined[i]) for i in shared if identified[i]}
    # What another parameter imitates varies with it, at least as much as noise was seen to move it.
    wider = {name: 0.0 if is_determined else free[name] for name, is_determined in shown.items()}
    listed = [
        replace(e, identifiable=shown[e.name], std=float(np.fmax(e.std, wider[e.name])))
        if e.name in shown
        else replace(e, std=float("nan"), identifiable=False)
        for e in estimates(refit)
    ]
    return (*listed, *derived_estimates(problem.model, unknowns, x, covariance, null))


def parameter_origins(refit: FitResult) -> dict[str, str]:
    """Name of a parameter -> arm, drive, sensor, or the id of its effect."""
    names = {u.parameter.name for u in refit.problem.unknowns.items}
    return {name: refit.problem.model.origin(name) for name in sorted(names)}


def effect_settings(last: FittedModel, given: Sequence[Effect]) -> list[dict[str, object]]:
    """The effects of a model beside the `given` ones, with those that they include, as [model]
    effects of a scenario."""
    model, data = last.refit.problem.model, last.data
    values = {**model.effect_values, **last.refit.problem.values()}
    stated = {e.kind for e in with_included(given)}
    listed: list[dict[str, object]] = []
    for effect in with_included(last.effects[len(given) :]):
        if effect.kind in stated:
            continue
        entry: dict[str, object] = {"id": effect.kind}
        for effect_parameter in effect.parameters(model.arm, model.drive, data.sizes):
            name = effect_parameter.parameter.name
            if not effect.is_searched(effect_parameter, data.rig):
                continue
            entry[name] = {
                "start": float(values.get(name, effect_parameter.parameter.value)),
                "vary": name not in data.fixed_effect_values,
            }
        listed.append(entry)
    return listed


def compare_with_recordings(base_fit: BaseFit) -> tuple[RecordingComparison, ...]:
    """Comparisons of all recordings: the fitted ones, then the validation ones with their own
    starts."""
    pairs = [(base_fit.base.problem, base_fit.data)]
    if (later := base_fit.validation_fit) is not None:
        pairs.append((later.problem, later.data))
    comparisons: list[RecordingComparison] = []
    agility: float | None = None  # once chosen it serves all
    for problem, data in pairs:
        for i, comparison in enumerate(_compare_each(problem, data)):
            missing, agility = missing_torque(problem, i, comparison, data.floors, agility)
            comparisons.append(
                replace(comparison, missing_torque=missing) if missing else comparison
            )
    return tuple(comparisons)


def _compare_each(problem: Problem, data: FitData) -> tuple[RecordingComparison, ...]:
    fixed, unknowns = problem.residuals.predictor.fixed, problem.unknowns
    chosen = [
        (
            e.recording,
            {**fixed, **unknowns.values_for(e.recording.name, problem.vector)},
            DIAGNOSIS_FIT,
        )
        for e in data.experiments
    ]
    first = data.experiments[0]
    return tuple(
        compare_many(problem.model, chosen, first.outputs, first.processing, data.result_substeps)
    )
