"""The base fit: compared outputs, nuisance unknowns, noise floors, and the converged base model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..effects.sizes import sizes_of, typical
from ..errors import InputError
from ..estimate.fit_result import FitResult
from ..estimate.minimum import converge, with_enough_substeps
from ..estimate.problem import FitData, problem_of
from ..estimate.validation import ValidationFit, fit_validation
from ..identify.fit import minimum_from_starts
from ..identify.fit_unknowns import unknowns_with_starts
from ..identify.prepared_recording import Prepared, can_measure, prepare
from ..identify.processing import Processing
from ..identify.setup import measured_sensors
from ..identify.unknowns import Unknown, Unknowns, fixed_values
from ..model import Model
from ..noise.noise_floor import channel_floors
from ..progress import Progress, Silent
from ..recording.recording import Recording
from ..scenario.schema import IdentifySpec
from ..sensors.sensor import Sensor


@dataclass(frozen=True)
class BaseFit:
    """The base model, fitted; the ladder starts there."""

    data: FitData
    base: FitResult
    validation: FitData | None = None
    """Validation recordings, which no fit uses."""
    cached_fit: ValidationFit | None = None
    """The base model on them, if known already."""

    @cached_property
    def validation_fit(self) -> ValidationFit | None:
        """The base model on the validation recordings."""
        return self.cached_fit or fit_validation(self.validation, self.base)

    def validation_data(
        self, processing: Processing, spec: IdentifySpec, recordings: Sequence[Recording]
    ) -> FitData | None:
        """The same comparison on validation recordings; None if they have none of its outputs."""
        outputs = self.data.experiments[0].outputs
        model = self.base.problem.model
        usable = [r for r in recordings if any(can_measure(model, r, s) for s in outputs)]
        experiments = tuple(prepare(self.data.bare, r, outputs, processing) for r in usable)
        if not experiments:
            return None
        nuisance = unknowns_with_starts(model, spec, usable, outputs).items
        others = replace(
            self.data, experiments=experiments, nuisance=nuisance, anchor=None, noise_ratios=()
        )
        return replace(others, weights=others.weights_at(self.data.floors))


def compared_outputs(model: Model, fitted: Sequence[Sensor], recordings: Sequence[Recording]):  # type: ignore[no-untyped-def]
    """The fitted outputs with a virtual servo; else all measured outputs, or the fitted ones if
    none."""
    if model.steering is not None:
        return tuple(fitted)
    return measured_sensors(model, recordings) or tuple(fitted)


def fit_base(
    model: Model, fitted: Sequence[Sensor], processing: Processing, spec: IdentifySpec,
    recordings: Sequence[Recording], stated: Mapping[str, float], fidelity: float,
    progress: Progress | None = None, identified: Mapping[str, float] | None = None,
    stated_rig: Mapping[str, str] | None = None,
) -> BaseFit:  # fmt: skip
    """Fit the base model with the full equations until it converges.

    It starts at the nominal values and at `identified` (label -> value) and keeps the better fit.
    `fidelity`: relative modelling tolerance; `stated_rig`: what is stated of the rig.
    """
    model, progress = full_equations(model), progress or Silent()
    outputs = compared_outputs(model, fitted, recordings)
    experiments = tuple(prepare(model, r, outputs, processing) for r in recordings)
    _check_counted(experiments)
    nuisance = unknowns_with_starts(model, spec, recordings, outputs).items
    fixed = fixed_values(model, spec, Unknowns(nuisance))
    weights = tuple(_spread_weights(e) for e in experiments)
    effects, bare = model.effects, model.bare or model
    data = FitData(bare, experiments, nuisance, weights, {}, fixed, typical(model.arm), 1)
    bounded = _fixed_and_bounded(model, spec, nuisance)
    data = replace(data, stated_rig=stated_rig or {}, **bounded)
    start = {**model.effect_values}
    first, second = (problem_of(data, effects, {**start, **x}) for x in ({}, identified or {}))
    end = minimum_from_starts(first.residuals, [first.vector, second.vector], False, progress)
    if end.servo is not None:
        data = data.for_bare(bare.steered_by(end.servo))
    rough = replace(first, residuals=end.residuals).at(end.fit.vector)
    motions = rough.motions()
    pairs = zip(rough.errors(rough.vector), weights, strict=True)
    prepared, unweighted = end.residuals.experiments, [b / w for b, w in pairs]
    floors = channel_floors(prepared, unweighted, motions, stated, fidelity)
    sizes = sizes_of([m for m, _, _ in motions])
    data = replace(data, sizes=sizes).in_floors(floors)
    values = {**start, **rough.values()}
    data = with_enough_substeps(data, effects, values)
    data, base = converge(data, problem_of(data, effects, values), None, progress.stopped)
    return BaseFit(data, base)


def _check_counted(experiments: Sequence[Prepared]) -> None:
    """InputError if no sample of a channel counts in any recording."""
    counts = np.array([e.counted.sum(axis=0) for e in experiments]).sum(axis=0)
    names = [name for name, _ in experiments[0].channels]
    empty = [name for name, count in zip(names, counts, strict=True) if not count]
    if empty:
        raise InputError(
            f"No sample of {', '.join(empty)} counts in any recording; check mask and window, or "
            f"select other channels with [diagnose] output."
        )


def _fixed_and_bounded(
    model: Model, spec: IdentifySpec, nuisance: Sequence[Unknown]
) -> dict[str, Any]:
    """The user's settings for stated effects: parameters that are not estimated keep their values,
    and stated bounds and priors replace those of the effect."""
    own = set(model.effect_parameters)
    free = {u.parameter.name for u in nuisance}
    bounded = own & free & {*spec.bounds, *spec.prior, *spec.per_recording}
    fixed = {name: float(model.effect_values[name]) for name in sorted(own - free)}
    return {"fixed_effect_values": fixed, "bounded": frozenset(bounded)}


def full_equations(model: Model) -> Model:
    """The model with the full equations."""
    bare = None if model.bare is None else model.bare.at_level("nonlinear")
    return replace(model.at_level("nonlinear"), bare=bare)


def _spread_weights(e: Prepared) -> np.ndarray:
    """(k,) one over the spread of each channel, before the noise floors are known."""
    columns = [e.measured[e.counted[:, k], k] for k in range(e.measured.shape[1])]
    spread = [float(np.std(y)) if y.size else 0.0 for y in columns]
    return np.array([1.0 / s if s > 0.0 else 1.0 for s in spread])
