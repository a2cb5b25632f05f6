"""What is stated of fitted models: errors, deviations, comparisons, steps of the ladder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.base_fit import BaseFit
from ..effects import with_included
from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, identified_unknowns, robust_covariance
from ..estimate.fitted_model import FittedModel
from ..estimate.problem import FitData, Problem
from ..estimate.validation import ValidationFit
from ..identify import identifiability
from ..identify.compare import compare_many
from ..identify.estimates import derived_estimates
from ..identify.prepared_recording import Prepared
from ..least_squares import (
    SEEN,
    as_finite,
    normal_equations,
    pseudo_inverse,
    triangular,
    with_prior,
)
from ..missing_torque import missing_torque
from ..model import Model
from ..noise.noise_floor import channel_rms
from ..noise.whitening import Whitener, error_products, fit_whitener, whitened_rows
from ..results import ChannelError, ErrorProducts, Estimate, LadderStep, RecordingComparison
from ..results.comparison import DIAGNOSIS_FIT


@dataclass(frozen=True)
class Noise:
    """What whitens the errors of all models that are compared."""

    whitener: Whitener
    products: ErrorProducts

    @classmethod
    def of(cls, data: FitData, rest: Sequence[np.ndarray]) -> Noise:
        """Of what is left (M, k) per recording, in floors, where all is explained."""
        whitener = fit_whitener(rest, whitened_rows(data.experiments))
        return cls(whitener, error_products(data.experiments, rest, data.weights, 0))

    def left(self, data: FitData, refit: FitResult) -> ErrorProducts:
        """The errors of a model, by a linear step where the whitened ones are least."""
        problem, end = refit.problem, refit.descended
        blocks, slopes = (
            [self.whitener(i, x) for i, x in enumerate(each)] for each in (end.blocks, end.slopes)
        )
        A, b = with_prior(*normal_equations(blocks, slopes), problem.vector, problem.limits)
        free = np.flatnonzero(problem.limits.inside(problem.vector) & (np.diag(A) > 0.0))
        move = np.zeros(len(problem.vector))
        move[free] = -pseudo_inverse(A[np.ix_(free, free)]) @ b[free]
        moved = [r + S @ move for r, S in zip(end.blocks, end.slopes, strict=True)]
        prior = float(problem.limits.prior_cost(problem.vector + move))
        return error_products(data.experiments, moved, data.weights, len(move), prior)


def ladder_step(
    data: FitData, validation: ValidationFit | None, refit: FitResult, added: str | None,
    title: str, names: Sequence[str],
) -> LadderStep:  # fmt: skip
    """A ladder step; `names`: parameters of the added effect, listed first; if empty, all unknowns
    are listed."""
    errors = _by_channel(data, refit.errors)
    unseen = {} if validation is None else _by_channel(validation.data, validation.errors)
    listed, floors = estimates(refit), _floors(data, refit.errors, errors)
    return LadderStep(
        added=added,
        model=tuple(e.kind for e in refit.problem.model.effects),
        title=title,
        parameters=_sizes(listed, refit.problem.model, names),
        errors=tuple(
            ChannelError(
                name, unit, rms, floors.get(name, float("nan")),
                unseen.get(name, (unit, float("nan"), 0.0))[1],
                data.floor_sources.get(name, ""),
            )
            for name, (unit, rms, _) in errors.items()
        ),
        tip_rms=_tip_rms(errors),
        cost_per_sample=refit.descended.cost / data.count,
        fit_percent=tuple(f for _, _, f in errors.values()),
        validation_fit_percent=tuple(f for _, _, f in unseen.values()),
    )  # fmt: skip


def _floors(
    data: FitData, errors: Sequence[np.ndarray], figures: Mapping[str, tuple[str, float, float]]
) -> dict[str, float]:
    """channel -> its noise floor. If recordings have their own, the one with the same ratio: rms
    error over the rms of error over floor."""
    if not data.noise_ratios:
        return dict(data.floors)
    times = channel_rms(data.experiments, errors)
    return {
        n: rms / times[n] if times.get(n) else data.floors[n] for n, (_, rms, _) in figures.items()
    }


def _sizes(listed: Sequence[Estimate], model: Model, names: Sequence[str]) -> tuple[Estimate, ...]:
    """Current sizes of all effects, as later effects change earlier ones, then the arm's."""
    if not names:
        return tuple(listed)
    own = model.effect_parameters
    shared = [e for e in listed if e.name in own or e.recording is None]
    return tuple(sorted(shared, key=lambda e: (e.name not in own, e.name not in names)))


def _tip_rms(errors: Mapping[str, tuple[str, float, float]]) -> float | None:
    if "z1" not in errors or "z2" not in errors:
        return None
    return float(np.hypot(errors["z1"][1], errors["z2"][1]))


def _by_channel(data: FitData, errors: Sequence[np.ndarray]) -> dict[str, tuple[str, float, float]]:
    """channel -> (unit, rms of the error in SI, FIT in per cent)."""
    parts_of: dict[str, list[tuple[Prepared, int, np.ndarray]]] = {}
    for e, r, w in zip(data.experiments, errors, data.weights, strict=True):
        for k, _ in enumerate(e.channels):
            parts_of.setdefault(e.channels[k][0], []).append((e, k, r[:, k] / w[k]))
    return {name: _figures(parts) for name, parts in parts_of.items()}


def _figures(parts: Sequence[tuple[Prepared, int, np.ndarray]]) -> tuple[str, float, float]:
    unit = parts[0][0].channels[parts[0][1]][1]
    error = np.concatenate([r[e.counted[:, k]] for e, k, r in parts])
    y = [e.measured[e.counted[:, k], k] for e, k, _ in parts]
    spread = float(np.linalg.norm(np.concatenate([x - x.mean() for x in y if x.size])))
    fit = 100.0 * max(1.0 - float(np.linalg.norm(error)) / spread, 0.0) if spread else np.nan
    return unit, float(np.sqrt(np.mean(error**2))), float(fit)


def estimates(refit: FitResult) -> tuple[Estimate, ...]:
    """All shared unknowns with standard deviations under coloured noise; NaN where the data do not
    determine them."""
    problem = refit.problem
    identified, rows = identified_unknowns(refit), []
    for i, u in enumerate(problem.unknowns.items):
        item, value = u.parameter, float(problem.vector[i])
        variance = float(refit.covariance[i, i])
        std = float(np.sqrt(variance)) if identified[i] and variance >= 0.0 else float("nan")
        rows.append(
            Estimate(
                item.name, value, std, item.unit, bool(np.isfinite(std)), item.symbol,
                item.value, item.lower, item.upper, u.recording,
                item.at_bound(value), item.title,
            )
        )  # fmt: skip
    return tuple(e for e in rows if e.recording is None)


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
