"""The fit problem of a diagnosis: recordings, unknowns, noise floors, and models with effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arm.arm import Structure
from ..effects import with_included
from ..effects.effect import Effect, Rig
from ..effects.sizes import Sizes
from ..identify.defect_correction import Anchor
from ..identify.predictor import Motion, MotionCache, Predictor
from ..identify.prepared_recording import Prepared, for_model
from ..identify.prescribed_joint_forces import steps_between_points
from ..identify.residuals import Residuals
from ..identify.unknown_gains import gains_of
from ..identify.unknowns import Unknown, Unknowns, with_first_states_of
from ..least_squares import BoundsAndPrior, bounds_and_prior, cost_of
from ..model import Model
from ..noise.noise_floor import Floor, squares_by_channel
from ..results import ABOVE, ABOVE_IN_ONE


@dataclass(frozen=True)
class FitData:
    """Prepared recordings of the bare model, with the nuisance unknowns of every model."""

    bare: Model
    """The model without effects; with the virtual servo where one is used."""
    experiments: tuple[Prepared, ...]
    nuisance: tuple[Unknown, ...]
    """Nominal parameters, starts, offsets: they may explain an error without any effect."""
    weights: tuple[np.ndarray, ...]
    """(k,) per recording: one over the noise floor of each channel."""
    floors: Mapping[str, float]
    fixed: Mapping[str, float]
    sizes: Sizes
    substeps: int
    """Integration steps per sample in the search."""
    anchored_substeps: int = 1
    """The same for arms whose step error the anchor corrects."""
    result_substeps: int = 1
    """Steps per sample beyond which nothing changes, as far as known: for results that are stated.
    """
    per_recording: tuple[str, ...] = ()
    """Effects whose sizes belong to these recordings alone."""
    anchor: Anchor | None = None
    """Correction of the error of few substeps, computed at one model; None: none."""
    floor_sources: Mapping[str, str] = field(default_factory=dict)
    """channel -> source of its noise: repetition, stated or estimated."""
    floor_uncertainty: Mapping[str, float] = field(default_factory=dict)
    """channel -> factor within which its noise floor is known."""
    law_errors: Mapping[str, float] = field(default_factory=dict)
    """channel -> mean square, in noise floors, that the idealised laws of the model's effects may
    miss."""
    tolerances: Mapping[str, float] = field(default_factory=dict)
    """channel -> mean square, in noise floors, that a person allows a model to miss beside them;
    empty where the floors contain it."""
    noise_ratios: tuple[np.ndarray, ...] = ()
    """(k,) per recording: factor of those floors, if recordings have a noise of their own."""
    fixed_effect_values: Mapping[str, float] = field(default_factory=dict)
    """Parameters of stated effects that are not estimated, and their values."""
    motion_cache: MotionCache = field(default_factory=MotionCache)
    """Motions of the base model. Sensor effects and forces at prescribed joints do not change
    them."""
    bounded: frozenset[str] = frozenset()
    """Parameters of stated effects with bounds, a prior or recordings of their own; they stay in
    `nuisance`."""
    stated_rig: Mapping[str, str] = field(default_factory=dict)
    """What is stated of the rig: `RigSpec.statements`."""

    def weights_at(self, floors: Mapping[str, float]) -> tuple[np.ndarray, ...]:
        """(k,) per recording: one over these noise floors of its channels."""
        own = self.noise_ratios or [np.ones(len(e.channels)) for e in self.experiments]
        return tuple(
            np.array([1.0 / floors[n] for n, _ in e.channels]) / times
            for e, times in zip(self.experiments, own, strict=True)
        )

    def for_bare(self, bare: Model) -> FitData:
        """The same recordings for a bare model with other bending shapes or another servo, without
        an anchor."""
        if bare is self.bare:
            return self
        fastest = min(e.recording.sample_time for e in self.experiments)
        return replace(
            self, bare=bare, experiments=tuple(for_model(e, bare) for e in self.experiments),
            nuisance=with_first_states_of(self.nuisance, bare, fastest), anchor=None,
            motion_cache=MotionCache(), result_substeps=1,
        )  # fmt: skip

    def in_floors(
        self, floors: Mapping[str, Floor], tolerances: Mapping[str, float] | None = None
    ) -> FitData:
        """The same data with other noise floors, without an anchor; `tolerances`: channel -> mean
        square, in these floors, that a model may miss beside them."""
        values = {n: f.value for n, f in floors.items()}
        equal = all(set(f.ratios) <= {1.0} for f in floors.values())
        ratios = () if equal else tuple(
            np.array([floors[n].ratios[i] for n, _ in e.channels])
            for i, e in enumerate(self.experiments)
        )  # fmt: skip
        other = replace(
            self, floors=values, noise_ratios=ratios, anchor=None, motion_cache=MotionCache(),
            floor_sources={n: f.source for n, f in floors.items()},
            floor_uncertainty={n: f.uncertainty for n, f in floors.items()},
            tolerances=tolerances or {},
        )  # fmt: skip
        return replace(other, weights=other.weights_at(values))

    @property
    def count(self) -> int:
        """Number of samples that count."""
        return int(sum(e.counted.sum() for e in self.experiments))

    @property
    def rig(self) -> Rig:
        """The rig: what these recordings can show."""
        kinds = tuple(s.kind for s in self.experiments[0].outputs)
        servo = self.bare.steering is not None
        model, names = self.bare, {u.parameter.name for u in self.nuisance}
        gains = gains_of(model, self.experiments[0].outputs)
        estimated = frozenset(channel for channel, gain in gains.items() if gain.name in names)
        return Rig(model.arm, model.drive, model.level, kinds, servo, self.stated_rig, estimated)


@dataclass(frozen=True)
class Problem:
    """A model with effects, its unknowns and their values."""

    model: Model
    unknowns: Unknowns
    residuals: Residuals
    vector: np.ndarray

    @property
    def limits(self) -> BoundsAndPrior:
        """Bounds of the unknowns."""
        return bounds_and_prior(self.unknowns.parameters)

    @property
    def substeps(self) -> int:
        """Integration steps per sample."""
        return self.residuals.predictor.steps

    def errors(self, vector: np.ndarray) -> list[np.ndarray]:
        """Weighted errors (M, k) per recording at a `vector` (P,)."""
        return self.errors_at([vector])[0]

    def errors_at(self, vectors: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
        """Errors at each of several vectors (P,), simulated together."""
        return self.residuals.blocks_of(vectors)

    def slopes(self, vector: np.ndarray) -> list[np.ndarray]:
        """Derivatives (M, k, P) of the errors per recording at a `vector` (P,), with half the
        steps: directions need less accuracy than errors."""
        return self.slopes_reusing(vector, {})

    def exact_slopes(self, vector: np.ndarray) -> list[np.ndarray]:
        """The same derivatives at a `vector` (P,), with all steps."""
        return self.residuals.slopes(vector, central=False)

    def slopes_reusing(
        self, vector: np.ndarray, reused: Mapping[str, tuple[np.ndarray, ...]]
    ) -> list[np.ndarray]:
        """The same derivatives at a `vector` (P,); `reused` gives the columns (M, k) per recording
        of some unknowns."""
        labels = self.unknowns.labels
        computed = [j for j, label in enumerate(labels) if label not in reused]
        slopes = self.half_substeps.residuals.slopes(vector, central=False, only=computed)
        if not all(np.isfinite(S).all() for S in slopes):  # half the steps do not hold together
            slopes = self.residuals.slopes(vector, central=False, only=computed)
        for j, label in enumerate(labels):
            for S, column in zip(slopes, reused.get(label, ()), strict=False):
                S[:, :, j] = column
        return slopes

    @cached_property
    def half_substeps(self) -> Problem:
        """The model with half the steps per sample."""
        predictor = self.residuals.predictor
        predictor = predictor.with_steps(max(predictor.steps // 2, 1))
        return replace(self, residuals=replace(self.residuals, predictor=predictor))

    def values(self) -> dict[str, float]:
        """label -> value."""
        return dict(zip(self.unknowns.labels, (float(v) for v in self.vector), strict=True))

    def all_values(self) -> dict[str, float]:
        """The same with the parameters of its effects that are not estimated."""
        return {**self.model.effect_values, **self.values()}

    def motions(self) -> list[Motion]:
        """(motion, numbers, values) of each recording."""
        everything = range(len(self.residuals.experiments))
        return self.residuals.predictor.trajectories([(self.vector, everything)])[0]

    def at(self, vector: np.ndarray) -> Problem:
        """The same model at another vector (P,)."""
        return replace(self, vector=np.asarray(vector, dtype=float))


def problem_of(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float], *,
    freed: Sequence[Unknown] | None = None, refine: float = 1,
) -> Problem:  # fmt: skip
    """The bare model with `effects`, its nuisance unknowns and the parameters of the effects.

    `values`: label -> start. `freed` replaces the unknowns of the effects. `refine`: factor on the
    number of steps.
    """
    plain = {k: v for k, v in values.items() if "@" not in k} | dict(data.fixed_effect_values)
    undetectable = undetectable_parameters(data, effects)
    model = data.bare.with_effects(effects, plain, data.sizes)
    neutral_values = {name: x for name, x in undetectable.items() if name in model.effect_values}
    if neutral_values:
        model = replace(model, effect_values={**model.effect_values, **neutral_values})
    own = effect_unknowns(model, data.sizes) if freed is None else tuple(freed)
    theirs = {*undetectable, *data.fixed_effect_values, *(data.bounded if freed is None else ())}
    own = tuple(u for u in own if u.parameter.name not in theirs)
    named = {u.parameter.name: u for u in own}
    # In one order, whoever names the unknowns of an effect that the nuisance has too.
    nuisance = (named.get(u.parameter.name, u) for u in data.nuisance)
    items = tuple(_with_start(u, values) for u in dict.fromkeys((*nuisance, *own)))
    unknowns = Unknowns(items)
    experiments = [for_model(e, model) for e in data.experiments]
    dt = max(e.recording.sample_time for e in data.experiments)
    steps = steps_between_points(model, dt, _search_substeps(data, model))
    steps = max(int(steps * refine), 1)
    predictor = Predictor(
        experiments, unknowns, data.fixed, steps=steps, motion_cache=data.motion_cache
    )
    residuals = Residuals(predictor, list(data.weights), data.anchor)
    return Problem(model, unknowns, residuals, unknowns.parameters.vector())


def _search_substeps(data: FitData, model: Model) -> int:
    """Steps per sample of the search for a model's arm. The anchor does not know the step error of
    an arm with other vibrations."""
    anchored = data.anchor and Structure.of(data.anchor.arm) == Structure.of(model.arm)
    return data.anchored_substeps if anchored else data.substeps


def with_values(
    data: FitData,
    problem: Problem,
    values: Mapping[str, float] | None = None,
    *,
    refine: float,
) -> Problem:
    """The same model and unknowns, with some other `values` and `refine` times the steps."""
    # Not by the model's effects: one that ended at neutral has left it, its unknowns have not.
    nominal = {u.parameter.name for u in data.nuisance}
    own = tuple(u for u in problem.unknowns.items if u.parameter.name not in nominal)
    start = {**problem.all_values(), **(values or {})}
    return problem_of(data, problem.model.effects, start, freed=own, refine=refine)


def with_shared_motions(data: FitData, problem: Problem) -> FitData:
    """The data with the motions of a model, with its steps and half of them, for models
    compared with it."""
    fine, coarse = (
        x.residuals.predictor.simulated_at(problem.vector) for x in (problem, problem.half_substeps)
    )
    return replace(
        data, motion_cache=MotionCache({**fine.motions, **coarse.motions}, fine.recordings)
    )


def undetectable_parameters(data: FitData, effects: Sequence[Effect]) -> dict[str, float]:
    """Parameters of the effects that these recordings cannot show or that the rig rules out, at
    neutral."""
    return {
        effect_parameter.parameter.name: effect_parameter.neutral
        for e in effects
        for effect_parameter in e.parameters(data.bare.arm, data.bare.drive, data.sizes)
        if not e.is_searched(effect_parameter, data.rig)
    }


def effect_unknowns(model: Model, sizes: Sizes) -> tuple[Unknown, ...]:
    """The parameters of a model's effects, as unknowns shared by all recordings."""
    unknowns: dict[str, Unknown] = {}
    for effect in model.effects:
        for item in effect.parameters(model.arm, model.drive, sizes):
            unknowns[item.parameter.name] = Unknown(item.parameter)
    return tuple(unknowns.values())


def parameter_names(effect: Effect, model: Model, sizes: Sizes) -> tuple[str, ...]:
    """Names of the parameters of an effect and of the effects that it includes."""
    each = (part.parameters(model.arm, model.drive, sizes) for part in with_included([effect]))
    return tuple(e.parameter.name for some in each for e in some)


def _with_start(unknown: Unknown, values: Mapping[str, float]) -> Unknown:
    p = unknown.parameter
    value = float(np.clip(values.get(unknown.label, p.value), p.lower, p.upper))
    return replace(unknown, parameter=replace(p, value=value))


def within_tolerance(data: FitData, errors: Sequence[np.ndarray]) -> bool:
    """Whether errors (M, k) per recording, in floors of noise alone, are within what a person
    allows a model to miss beside it."""
    names = {name for e in data.experiments for name, _ in e.channels}
    laws, allowed = data.law_errors, data.tolerances
    both = {n: laws.get(n, 0.0) + allowed.get(n, 0.0) for n in names}
    return bool(allowed) and within_noise(replace(data, law_errors=both), errors)


def within_noise(data: FitData, errors: Sequence[np.ndarray]) -> bool:
    """Whether errors (M, k) per recording, in noise floors, are within noise: over all channels and
    in each. The idealised laws of the model's effects may miss a stated share.

    With a virtual servo, encoder noise excites the links. A sharper limit than the verdict's would
    find effects that imitate it: damped links follow noise less.
    """
    share = ABOVE**2 if data.rig.servo else 1.0
    each = squares_by_channel(data.experiments, errors)
    missed = sum(data.law_errors.get(n, 0.0) * len(x) for n, x in each.items())
    if not cost_of(errors) <= share * data.count + missed:
        return False
    return all(np.mean(x) <= ABOVE_IN_ONE**2 + data.law_errors.get(n, 0.0) for n, x in each.items())
