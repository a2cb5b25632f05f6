"""What a diagnosis looks at: the recordings, how they are compared, and the floors."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arm.arm import Structure
from ..diagnose.noise_floor import Floor
from ..effects import with_included
from ..effects.effect import Effect, Rig
from ..effects.sizes import Sizes, typical
from ..identify.defect_correction import Anchor
from ..identify.held import steps_needed
from ..identify.predictor import KnownMotions, Motion, Predictor, coarser
from ..identify.prepared import Prepared, make_task
from ..identify.residuals import Residuals
from ..identify.unknowns import Unknown, Unknowns
from ..least_squares import Limits, limits_of
from ..model import Model


class NeededSteps:
    """Steps per sample that the arm needs with more bending modes than it was given; found once.

    A further mode swings several times as fast, and what few steps miss of it is nothing that an
    `Anchor` on the model without it knows.
    """

    def __init__(self) -> None:
        self._found: dict[tuple[int, ...], int] = {}
        self._lock = threading.Lock()

    def of(self, modes: tuple[int, ...], find: Callable[[], int]) -> int:
        """Those of an arm with so many modes per segment; `find` counts them the first time."""
        with self._lock:
            if modes not in self._found:
                self._found[modes] = find()
            return self._found[modes]


@dataclass(frozen=True)
class Data:
    """Prepared recordings of the bare model with the nuisance unknowns that every model has."""

    bare: Model
    """With the virtual servo where one is used."""
    experiments: tuple[Prepared, ...]
    nuisance: tuple[Unknown, ...]
    """Nominal parameters, starts, offsets: what may explain an error without any effect."""
    weights: tuple[np.ndarray, ...]
    """(k,) per recording: one over the floor of each channel."""
    floors: Mapping[str, float]
    fixed: Mapping[str, float]
    sizes: Sizes
    steps: int | None
    """Steps per sample of the search; None: not known yet."""
    few: int | None = None
    """The same for models of the arm whose steps' error the anchor takes off; None: as many."""
    fine: int | None = None
    """Steps per sample from which on more change nothing: for what is stated."""
    per_recording: tuple[str, ...] = ()
    """Effects whose sizes belong to these recordings alone."""
    anchor: Anchor | None = None
    """What few steps per sample miss, as found on one model; None: nothing is taken off."""
    floor_sources: Mapping[str, str] = field(default_factory=dict)
    """channel -> where its noise comes from: repetition, stated or estimated."""
    floors_within: Mapping[str, float] = field(default_factory=dict)
    """channel -> the factor within which its floor is known."""
    idealised: Mapping[str, float] = field(default_factory=dict)
    """channel -> mean square, in floors, that the laws of the effects in the model may miss."""
    noise_ratios: tuple[np.ndarray, ...] = ()
    """(k,) per recording: times those floors, where recordings have a noise of their own."""
    held: Mapping[str, float] = field(default_factory=dict)
    """Parameters of the effects in the model as given that are not estimated, and their values."""
    known: KnownMotions = field(default_factory=KnownMotions)
    """Of the model that others are compared with: what a sensor does, or a force at a held joint,
    moves nothing."""
    needed: NeededSteps | None = None
    """Of arms with other modes; None: as many as `steps`."""
    limited: frozenset[str] = frozenset()
    """Parameters of those effects with bounds, a prior or recordings of their own: they stay as
    they are among `nuisance`."""
    stated_rig: Mapping[str, str] = field(default_factory=dict)
    """What is known of the rig beforehand: `RigSpec.statements`."""

    def weights_at(self, floors: Mapping[str, float]) -> tuple[np.ndarray, ...]:
        """(k,) per recording: one over the floor of each channel there."""
        own = self.noise_ratios or [np.ones(len(e.channels)) for e in self.experiments]
        return tuple(
            np.array([1.0 / floors[n] for n, _ in e.channels]) / times
            for e, times in zip(self.experiments, own, strict=True)
        )

    def in_floors(self, floors: Mapping[str, Floor]) -> Data:
        """The same recordings in other floors, which no model is anchored in yet."""
        values = {n: f.value for n, f in floors.items()}
        return replace(
            self, weights=self.weights_at(values), floors=values, anchor=None,
            floor_sources={n: f.source for n, f in floors.items()},
            floors_within={n: f.within for n, f in floors.items()}, known=KnownMotions(),
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Samples that count."""
        return int(sum(e.counted.sum() for e in self.experiments))

    @property
    def rig(self) -> Rig:
        """What these recordings can show."""
        kinds = tuple(s.kind for s in self.experiments[0].outputs)
        servo = self.bare.steering is not None
        model = self.bare
        return Rig(model.arm, model.drive, model.level, kinds, servo, self.stated_rig)


@dataclass(frozen=True)
class Hypothesis:
    """A model with effects, its unknowns, and where they stand."""

    model: Model
    unknowns: Unknowns
    residuals: Residuals
    vector: np.ndarray

    @property
    def limits(self) -> Limits:
        """Bounds of the unknowns."""
        return limits_of(self.unknowns.parameters)

    @property
    def steps(self) -> int | None:
        """Per sample; None where they are not known yet."""
        return self.residuals.predictor.steps

    def errors(self, vector: np.ndarray) -> list[np.ndarray]:
        """Weighted errors (M, k) per recording."""
        return self.errors_of([vector])[0]

    def errors_of(self, vectors: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
        """The errors at each of several vectors (P,), simulated together."""
        return self.residuals.blocks_of(vectors)

    def slopes(self, vector: np.ndarray) -> list[np.ndarray]:
        """Their derivatives (M, k, P) per recording, with half the steps: a direction need not be
        as exact as the error that it lowers."""
        return self.coarse.residuals.sensitivities(vector, central=False)

    def exact_slopes(self, vector: np.ndarray) -> list[np.ndarray]:
        """The same with all steps."""
        return self.residuals.sensitivities(vector, central=False)

    def slopes_with(
        self, vector: np.ndarray, known: Mapping[str, tuple[np.ndarray, ...]]
    ) -> list[np.ndarray]:
        """The same, with the columns (M, k) per recording of the unknowns in `known` as given."""
        labels = self.unknowns.labels
        fresh = [j for j, label in enumerate(labels) if label not in known]
        found = self.coarse.residuals.sensitivities(vector, central=False, only=fresh)
        for j, label in enumerate(labels):
            for S, column in zip(found, known.get(label, ()), strict=False):
                S[:, :, j] = column
        return found

    @cached_property
    def coarse(self) -> Hypothesis:
        """With half the steps per sample."""
        fine = self.residuals.predictor
        if fine.steps is None:
            return self
        predictor = coarser(fine, max(fine.steps // 2, 1))
        return replace(self, residuals=replace(self.residuals, predictor=predictor))

    def values(self) -> dict[str, float]:
        """label -> value."""
        return dict(zip(self.unknowns.labels, (float(v) for v in self.vector), strict=True))

    def motions(self) -> list[Motion]:
        """(motion, numbers, values) along each recording."""
        everything = range(len(self.residuals.experiments))
        return self.residuals.predictor.trajectories([(self.vector, everything)])[0]

    def at(self, vector: np.ndarray) -> Hypothesis:
        """The same hypothesis at another point of its unknowns."""
        return replace(self, vector=np.asarray(vector, dtype=float))


LOOSE = 2.0
"""Times the longest step of an effect while models are compared: with the steps' error of the base
taken off, friction with steps of 0.5 ms is within 0.01 mm of steps of 16 us."""


def hypothesis(
    data: Data,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    *,
    freed: Sequence[Unknown] | None = None,
    secondary: bool = True,
    finer: float = 1,
) -> Hypothesis:
    """The bare model with `effects`, its nuisance unknowns and the effects' parameters.

    `values` label -> start, for nuisance and effects alike; `freed` replaces the effects'
    unknowns; without `secondary` only sizes are unknown, not what shapes them. `finer` times as
    many steps are taken.
    """
    plain = {k: v for k, v in values.items() if "@" not in k} | dict(data.held)
    hidden = unseen(data, effects)
    model = data.bare.with_effects(effects, plain, data.sizes)
    held = {name: x for name, x in hidden.items() if name in model.effect_values}
    model = replace(model, effect_values={**model.effect_values, **held}) if held else model
    own = effect_unknowns(model, data.sizes, secondary) if freed is None else tuple(freed)
    theirs = {*hidden, *data.held, *(data.limited if freed is None else ())}
    own = tuple(u for u in own if u.parameter.name not in theirs)
    names = {u.parameter.name for u in own}
    nuisance = tuple(u for u in data.nuisance if u.parameter.name not in names)
    items = tuple(_started(u, values) for u in (*nuisance, *own))
    unknowns = Unknowns(items)
    experiments = [moved(e, model) for e in data.experiments]
    steps = None
    if data.steps is not None:
        dt = max(e.recording.sample_time for e in data.experiments)
        loose = 1.0 if data.anchor is None else LOOSE
        steps = max(int(steps_needed(model, dt, _fewest(data, model), loose) * finer), 1)
    predictor = Predictor(experiments, unknowns, data.fixed, steps=steps, known=data.known)
    residuals = Residuals(predictor, list(data.weights), data.anchor)
    return Hypothesis(model, unknowns, residuals, unknowns.parameters.vector())


def _fewest(data: Data, model: Model) -> int:
    """Steps per sample of the search, on the arm of a model."""
    assert data.steps is not None
    if data.needed is None or model.arm.modes == data.bare.arm.modes:
        anchored = data.anchor and Structure.of(data.anchor.arm) == Structure.of(model.arm)
        return data.few if anchored and data.few else data.steps
    # Whoever asks first, the answer is that of the nominal values and the modes alone.
    shapes = [one for one in model.effects if one.resolution]
    alone = replace(data, needed=None, anchor=None)
    found = data.needed.of(model.arm.modes, lambda: enough_steps(alone, shapes, {}, UNKNOWN))
    return max(found, data.steps)


CLOSE = 0.6
"""In noise floors, rms: what few steps may miss in the search. `Anchor` takes it off and leaves
about a tenth of it (measured with friction, elastic joints, lag and damping)."""

ANCHORED = 2.4
"""The same where the anchor is of the same arm. What is compared is simulated with twice as many
steps (core.diagnose.refit.EXACT), which miss a quarter, so that as little is left of it. An arm
with other vibrations has an error of its own that no anchor knows."""

UNKNOWN = 0.2
"""The same of arms with other bending shapes, of whose steps no anchor knows the error: squared it
is no relevant part of the noise. With three times as much a further shape, near the noise, lost by
its steps all that it explained."""

MOST_STEPS = 64
"""Per sample: beyond it a simulation takes minutes."""


def enough_steps(
    data: Data,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    close: float = CLOSE,
    least: int = 1,
) -> int:
    """Steps per sample, from `least` on, such that twice as many move the outputs by less than
    `close` floors."""

    def errors_with(steps: int) -> list[np.ndarray]:
        h = hypothesis(replace(data, steps=steps), effects, values)
        return h.errors(h.vector)

    steps, coarse = least, errors_with(least)
    while steps < MOST_STEPS:
        fine = errors_with(2 * steps)
        apart = [a - b for a, b in zip(coarse, fine, strict=True)]
        change = float(np.sqrt(np.mean(np.concatenate([x.ravel() for x in apart]) ** 2)))
        if change < close:
            break
        steps, coarse = 2 * steps, fine
    return steps


def again(
    data: Data, h: Hypothesis, values: Mapping[str, float] | None = None, *, finer: float
) -> Hypothesis:
    """The same model and unknowns, with some other `values` and as many times the steps."""
    # Not by the model's effects: one that ended at neutral has left it, its unknowns have not.
    nominal = {u.parameter.name for u in data.nuisance}
    own = tuple(u for u in h.unknowns.items if u.parameter.name not in nominal)
    start = {**h.model.effect_values, **h.values(), **(values or {})}
    return hypothesis(data, h.model.effects, start, freed=own, finer=finer)


def sharing_motions(data: Data, h: Hypothesis) -> Data:
    """The data with the motions of a hypothesis, for the models that are compared with it; with its
    steps and with half of them, as directions are taken."""
    if h.steps is None:
        return data
    fine, coarse = (one.residuals.predictor.simulated_at(h.vector) for one in (h, h.coarse))
    return replace(data, known=KnownMotions({**fine.motions, **coarse.motions}, fine.recordings))


def moved(experiment: Prepared, model: Model) -> Prepared:
    """The same recording for another model."""
    if experiment.model is model:
        return experiment
    return replace(experiment, model=model, task=make_task(model, experiment.recording))


def unseen(data: Data, effects: Sequence[Effect]) -> dict[str, float]:
    """Parameters of the effects that these recordings cannot show or that cannot be, at their
    neutral values."""
    return {
        effect_parameter.parameter.name: effect_parameter.neutral
        for one in effects
        for effect_parameter in one.parameters(data.bare.arm, data.bare.drive, data.sizes)
        if not one.sought(effect_parameter, data.rig)
    }


def effect_unknowns(model: Model, sizes: Sizes | None, secondary: bool) -> tuple[Unknown, ...]:
    """The parameters of a model's effects as unknowns shared by all recordings."""
    found: dict[str, Unknown] = {}
    for one in model.effects:
        for own in one.parameters(model.arm, model.drive, sizes or typical(model.arm)):
            if secondary or not own.secondary:
                found[own.parameter.name] = Unknown(own.parameter)
    return tuple(found.values())


def names_of(one: Effect, model: Model, sizes: Sizes) -> tuple[str, ...]:
    """The parameters of an effect, with those of the effects that it includes."""
    each = (part.parameters(model.arm, model.drive, sizes) for part in with_included([one]))
    return tuple(e.parameter.name for some in each for e in some)


def _started(unknown: Unknown, values: Mapping[str, float]) -> Unknown:
    p = unknown.parameter
    value = float(np.clip(values.get(unknown.label, p.value), p.lower, p.upper))
    return replace(unknown, parameter=replace(p, value=value))
