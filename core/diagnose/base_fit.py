"""The data of a diagnosis: what is compared, the nuisance, the floors, and a converged base fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..diagnose.cost_minimum import converged, missed_by_laws
from ..diagnose.fit_problem import (
    ANCHORED,
    MOST_STEPS,
    Data,
    NeededSteps,
    enough_steps,
    hypothesis,
)
from ..diagnose.ladder_steps import Validated, validated
from ..diagnose.noise_floor import Floor, channel_floors
from ..diagnose.refit import Refit, fit
from ..effects.effect import Effect
from ..effects.sizes import sizes_of, typical
from ..errors import InputError
from ..identify.held import points_led
from ..identify.prepared import Prepared, can_measure, prepare
from ..identify.processing import Processing
from ..identify.setup import primary_sensors
from ..identify.unknowns import (
    START,
    Unknown,
    Unknowns,
    collect_unknowns,
    fixed_values,
    starts_unknown,
)
from ..least_squares import MOST_ITERATIONS
from ..model import Model
from ..recording.recording import Recording
from ..scenario.schema import IdentifySpec
from ..sensors import Sensor

START_BOUND = 0.05
"""rad (m): how far an encoder's first sample may be from the truth."""


@dataclass(frozen=True)
class Begun:
    """Where the ladder starts."""

    data: Data
    base: Refit
    validation: Data | None = None
    """Recordings that no fit sees."""
    known: Validated | None = None
    """The base on them, where it was asked before."""

    @cached_property
    def validated(self) -> Validated | None:
        """The base on them."""
        return self.known or validated(self.validation, self.base)

    def for_others(
        self, processing: Processing, spec: IdentifySpec, recordings: Sequence[Recording]
    ) -> Data | None:
        """The same comparison on recordings that no fit sees; None where they lack an output."""
        outputs = self.data.experiments[0].outputs
        model = self.base.hypothesis.model
        able = [r for r in recordings if all(can_measure(model, r, s) for s in outputs)]
        experiments = tuple(prepare(self.data.bare, r, outputs, processing) for r in able)
        if not experiments:
            return None
        nuisance = tuple(nuisance_of(model, spec, able))
        others = replace(
            self.data, experiments=experiments, nuisance=nuisance, anchor=None, noise_ratios=()
        )
        return replace(others, weights=others.weights_at(self.data.floors))


def outputs_of(model: Model, fitted: Sequence[Sensor], recordings: Sequence[Recording]):  # type: ignore[no-untyped-def]
    """With a servo what is fitted; otherwise all that was measured, else what is fitted."""
    if model.steering is not None:
        return tuple(fitted)
    found = tuple(s for s in primary_sensors() if all(s.direct(r, model.arm) for r in recordings))
    return found or tuple(fitted)


def nuisance_of(model: Model, spec: IdentifySpec, recordings: Sequence[Recording]) -> list[Unknown]:
    """Nominal parameters within the user's bounds or physical ones, and each recording's start."""
    found = list(collect_unknowns(model, spec, recordings).items)
    resting = [r for r in recordings if not starts_unknown(spec, r)]
    if model.steering is None and resting:
        starts = [f"{START}theta{k + 1}" for k in range(model.arm.joints)]
        starting = spec.model_copy(
            update={"parameters": (), "bounds": {}, "prior": {}, "offsets": ()}
        ).model_copy(update={"per_recording": tuple(starts)})
        found += [_near(u) for u in collect_unknowns(model, starting, resting).items]
    return found


def _near(u: Unknown) -> Unknown:
    parameter = replace(u.parameter, lower=-START_BOUND, upper=START_BOUND)
    return replace(u, parameter=parameter)


def begin(
    model: Model,
    fitted: Sequence[Sensor],
    processing: Processing,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    stated: Mapping[str, float],
    fidelity: float,
    stopped: Callable[[], bool] = lambda: False,
    identified: Mapping[str, float] | None = None,
    stated_rig: Mapping[str, str] | None = None,
) -> Begun:
    """Fits the model as given until converged, with the full equations.

    Begins at the nominal values and where the identification ended (`identified`: label ->
    value), and keeps the better. `stated_rig`: what is known of the rig beforehand.
    """
    model = full_equations(model)
    outputs = outputs_of(model, fitted, recordings)
    experiments = tuple(prepare(model, r, outputs, processing) for r in recordings)
    _check_counted(experiments)
    nuisance = tuple(nuisance_of(model, spec, recordings))
    held = fixed_values(model, spec, Unknowns(nuisance))
    ones = tuple(_spread_weights(e) for e in experiments)
    effects, bare = model.effects, model.bare or model
    dt = max(e.recording.sample_time for e in experiments)
    steps = max(int(np.ceil(dt / points_led(model, dt) / FIRST_STEP)), 1)
    data = Data(bare, experiments, nuisance, ones, {}, held, typical(model.arm), steps)
    limited = _held_and_limited(model, spec, nuisance)
    data = replace(data, stated_rig=stated_rig or {}, **limited)
    rough = _better_start(data, effects, model.effect_values, identified or {}, stopped)
    motions = rough.hypothesis.motions()
    unweighted = [b / w for b, w in zip(rough.errors, ones, strict=True)]
    prepared = rough.hypothesis.residuals.experiments
    known = channel_floors(prepared, unweighted, motions, stated, fidelity)
    sizes = sizes_of([m for m, _, _ in motions])
    data = replace(data, sizes=sizes, noise_ratios=_noise_ratios(known, experiments))
    data = data.in_floors(known)
    values = {**model.effect_values, **rough.hypothesis.values()}
    few = enough_steps(data, effects, values, ANCHORED)
    few = steps_for_directions(data, effects, values, few)
    steps = enough_steps(data, effects, values, least=few)
    data = replace(data, steps=steps, few=few, needed=NeededSteps())
    data, base = converged(data, hypothesis(data, effects, values), None, stopped)
    return Begun(replace(data, idealised=missed_by_laws(data, base)), base)


def _noise_ratios(
    floors: Mapping[str, Floor], experiments: Sequence[Prepared]
) -> tuple[np.ndarray, ...]:
    """`Data.noise_ratios`."""
    if all(set(floor.ratios) <= {1.0} for floor in floors.values()):
        return ()
    return tuple(
        np.array([floors[n].ratios[i] for n, _ in e.channels]) for i, e in enumerate(experiments)
    )


def _check_counted(experiments: Sequence[Prepared]) -> None:
    """InputError where a channel has no sample that counts in any recording."""
    counts = np.array([e.counted.sum(axis=0) for e in experiments]).sum(axis=0)
    names = [name for name, _ in experiments[0].channels]
    empty = [name for name, count in zip(names, counts, strict=True) if not count]
    if empty:
        raise InputError(
            f"No sample of {', '.join(empty)} counts in any recording; check mask and window, or "
            f"name what is to be compared with [diagnose] output."
        )


def _held_and_limited(
    model: Model, spec: IdentifySpec, nuisance: Sequence[Unknown]
) -> dict[str, Any]:
    """What a user says of the effects in the model counts here too: what is not estimated is held
    where it stands, and stated bounds and priors replace those of the effect."""
    own = set(model.effect_parameters)
    free = {u.parameter.name for u in nuisance}
    limited = own & free & {*spec.bounds, *spec.prior, *spec.per_recording}
    held = {name: float(model.effect_values[name]) for name in sorted(own - free)}
    return {"held": held, "limited": frozenset(limited)}


def full_equations(model: Model) -> Model:
    """The same model without its linearisation."""
    bare = None if model.bare is None else model.bare.at_level("nonlinear")
    return replace(model.at_level("nonlinear"), bare=bare)


ALIGNED = 0.9
"""Cosine between what an unknown does to the outputs with some steps and with twice as many: along
a direction that is so far off a step still takes eight tenths (its square) of what there is to
take. A descent ends where none that it knows leads further down: with a link that swings at half
the sampling rate, one step per sample and a cosine of -0.2, a stiffness stopped 8 per cent off, and
a soft base was found for what was left."""


def steps_for_directions(
    data: Data, effects: Sequence[Effect], values: Mapping[str, float], least: int
) -> int:
    """Steps per sample, from `least` on, with which a descent knows its directions: what all
    recordings share moves the outputs alike with twice as many."""
    half = max(least // 2, 1)  # of the steps are what directions are taken with
    slopes = _slopes(data, effects, values, half)
    while 2 * half < MOST_STEPS:
        finer = _slopes(data, effects, values, 2 * half)
        if _least_cosine(slopes, finer) > ALIGNED:
            break
        half, slopes = 2 * half, finer
    return max(least, 2 * half) if half > 1 else least


def _slopes(
    data: Data, effects: Sequence[Effect], values: Mapping[str, float], steps: int
) -> list[np.ndarray]:
    """(N,) of each unknown that all recordings share, with so many steps per sample."""
    h = hypothesis(replace(data, steps=steps), effects, values)
    shared = [k for k, u in enumerate(h.unknowns.items) if u.recording is None]
    if not shared:
        return []
    found = h.residuals.sensitivities(h.vector, central=False, only=shared)
    return [np.concatenate([S[:, :, k].ravel() for S in found]) for k in shared]


def _least_cosine(first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> float:
    """Of vectors (N,) that are not zero; one where there are none."""
    sizes = [np.linalg.norm(a) * np.linalg.norm(b) for a, b in zip(first, second, strict=True)]
    cosines = [a @ b / s for a, b, s in zip(first, second, sizes, strict=True) if s > 0.0]
    return float(min(cosines, default=1.0))


FIRST_STEP = 5e-4
"""s: of the very first fit, before it is known what the errors are measured against."""

LOOK = 4
"""Iterations from each start before the one that is ahead goes on alone."""


def _better_start(
    data: Data, effects: Sequence[Effect], values: Mapping[str, float],
    identified: Mapping[str, float], stopped: Callable[[], bool],
) -> Refit:  # fmt: skip
    """A first fit from the start that leads further."""
    starts = [dict(values)]
    labels = {u.label: u.parameter.value for u in data.nuisance}
    if any(labels.get(k, v) != v for k, v in identified.items()):
        starts.append({**values, **identified})
    looks = [fit(hypothesis(data, effects, s), None, stopped, LOOK) for s in starts]
    best = min(looks, key=lambda one: one.cost)
    return fit(best.hypothesis, None, stopped, MOST_ITERATIONS)


def _spread_weights(e: Prepared) -> np.ndarray:
    """(k,) one over the spread of each channel, before the floors are known."""
    spread = [float(np.std(e.measured[e.counted[:, k], k])) for k in range(e.measured.shape[1])]
    return np.array([1.0 / s if s > 0.0 else 1.0 for s in spread])
