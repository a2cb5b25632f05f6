"""A challenge: recordings of an arm with hidden effects, and what is hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..challenge.challenge_rig import (
    CHANNELS,
    GAINS,
    STDS,
    Experiment,
    bare_model,
    readings,
    recording,
    simulate_exactly,
    with_noise,
)
from ..challenge.detectability import Detectability, UnreachableError
from ..challenge.hidden_effect import candidates, hide_effect
from ..challenge.truth import LEVELS, Truth
from ..drives.velocity_loop import VelocityLoop
from ..effects import effect
from ..errors import InputError
from ..model import Model
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..scenario.schema import Scenario
from ..sentences import did_you_mean

MOVE_SECONDS, SWEEP_SECONDS = 2.0, 5.0

STIFFNESS = 0.05
"""Largest relative difference of the beams' true stiffness from nominal."""

RESOLUTION = 8
"""Digits after the point, in SI: a good sensor's, for small files."""

ATTEMPTS = 20


@dataclass(frozen=True)
class Challenge:
    """A scenario whose files are the recordings, and what is hidden in them."""

    scenario: Scenario
    recordings: tuple[Recording, ...]
    """In the scenario's order."""
    truth: Truth


def make_challenge(seed: int, level: str = "easy") -> Challenge:
    """One hidden effect (easy) or two (hard) of random kinds and sizes; same seed, same data.
    InputError for another level or an impossible seed."""
    if level not in LEVELS:
        raise InputError(f"level {level!r} is not known; {did_you_mean(level, LEVELS)}")
    if not 0 <= seed < 2**32:
        raise InputError(f"seed {seed} is not possible; give a whole number below 2^32.")
    rng = np.random.default_rng([seed, *map(ord, level)])
    experiments = _experiments(rng)
    bare = _as_built(rng)
    model, truth = _hidden(level, bare, experiments, rng)
    clean = [_recorded(e, model) for e in experiments]
    recordings = [_rounded(r) for r in with_noise(clean, "white", [seed, len(level)])[0]]
    return Challenge(_scenario(seed, recordings), tuple(recordings), truth)


def _experiments(rng: np.random.Generator) -> list[Experiment]:
    """Seven working points to estimate on, a sweep through all of them to validate."""
    seeds = rng.integers(1, 2**31, 8)
    points = [
        Experiment(
            f"th{k}",
            SimulateSpec(theta2=float(k * np.pi / 8), seconds=MOVE_SECONDS, seed=int(seeds[k - 1])),
        )
        for k in range(1, 8)
    ]
    ends = (float(np.pi / 8), float(7 * np.pi / 8))
    sweep = SimulateSpec(sweep=ends, seconds=SWEEP_SECONDS, excitation="prbs", seed=int(seeds[7]))
    return [*points, Experiment("sweep", sweep)]


def _as_built(rng: np.random.Generator) -> Model:
    """No beam is exactly as stiff as its drawing says."""
    nominal = bare_model()
    factor = 1.0 + STIFFNESS * rng.uniform(-1.0, 1.0)
    segments = tuple(
        s.model_copy(update={"young_modulus": (s.young_modulus or 0.0) * factor})
        for s in nominal.arm.segments
    )
    return replace(nominal, arm=nominal.arm.model_copy(update={"segments": segments}))


def _hidden(
    level: str, bare: Model, experiments: Sequence[Experiment], rng: np.random.Generator
) -> tuple[Model, Truth]:
    """The model with random effects, drawn until their sizes can be reached."""
    count, low, high = LEVELS[level]
    points = [e for e in experiments if e.spec.sweep is None][::3]
    detectability = Detectability(bare, points)
    for _ in range(ATTEMPTS):
        kinds = _kinds(count, rng)
        sizes = [float(np.exp(rng.uniform(np.log(low), np.log(high)))) for _ in kinds]
        try:
            effects = [
                hide_effect(effect(kind), detectability, size, rng)
                for kind, size in zip(kinds, sizes, strict=True)
            ]
        except UnreachableError:
            continue
        values = {name: float(x) for h in effects for name, x in h.values.items()}
        shown = {h.effect.kind: h.level for h in effects}
        truth = Truth(shown, values, float(bare.parameters["EI"].value))
        return bare.with_effects([h.effect for h in effects], values), truth
    raise InputError("No challenge can be made from this seed; try another.")


def _kinds(count: int, rng: np.random.Generator) -> list[str]:
    """Kinds of effects at different locations."""
    chosen: list[str] = []
    while len(chosen) < count:
        taken = {effect(kind).location for kind in chosen}
        free = [kind for kind, e in sorted(candidates().items()) if e.location not in taken]
        chosen.append(str(rng.choice(free)))
    return chosen


def _recorded(experiment: Experiment, model: Model) -> Recording:
    task = experiment.task(model)
    role = "estimate" if experiment.spec.sweep is None else "validate"
    return recording(experiment, task, model, readings(model, simulate_exactly(model, task)), role)


def _rounded(r: Recording) -> Recording:
    channels = {
        name: np.round(x, RESOLUTION) if name in CHANNELS else x for name, x in r.channels.items()
    }
    return replace(r, time=np.round(r.time, RESOLUTION), channels=channels)


def _scenario(seed: int, recordings: Sequence[Recording]) -> Scenario:
    """The scenario to start with: the nominal arm without effects."""
    stated = [
        {"file": f"{r.name}.csv", "role": r.role}
        | ({} if r.theta2 is None else {"theta2": float(r.theta2)})
        for r in recordings
    ]
    return Scenario.model_validate({
        "title": f"Challenge {seed}: what is missing?",
        "arm": {"preset": "paper"},
        "drive": {"kind": VelocityLoop.kind, "gains": list(GAINS)},
        "model": {"level": "nonlinear"},
        "sensors": {"camera_noise": STDS["z1"], "encoder_noise": STDS["theta1"]},
        "identify": {"parameters": ["EI"], "output": ["z"], "generations": 0},
        "diagnose": {"max_effects": 3},
        "recordings": stated,
    })  # fmt: skip
