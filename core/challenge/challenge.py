"""A challenge: recordings of an arm with hidden effects, and what is hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..challenge.challenge_rig import GAINS, STDS, bare_model
from ..challenge.detectability import Detectability, UnreachableError
from ..challenge.hidden_effect import HiddenEffect, candidates, hide_effect
from ..challenge.truth import LEVELS, Truth
from ..drives.velocity_loop import VelocityLoop
from ..effects import effect
from ..errors import InputError
from ..loading import load_recordings
from ..model import Model
from ..progress import Progress
from ..recording.recording import Recording
from ..recording.spec import RecordingSpec, SimulateSpec
from ..scenario.schema import Scenario
from ..sentences import did_you_mean

MOVE_SECONDS, SWEEP_SECONDS = 2.0, 5.0

STIFFNESS = 0.05
"""Largest relative difference of the beams' true stiffness from nominal."""

ATTEMPTS = 20


@dataclass(frozen=True)
class Challenge:
    """A scenario whose files are the recordings, and what is hidden in them."""

    scenario: Scenario
    recordings: tuple[Recording, ...]
    """In the scenario's order."""
    truth: Truth


def make_challenge(seed: int, level: str, progress: Progress) -> Challenge:
    """One hidden effect (easy) or two (hard) of random kinds and sizes; same seed, same data.
    InputError for another level or an impossible seed."""
    if level not in LEVELS:
        raise InputError(f"level {level!r} is not known; {did_you_mean(level, LEVELS)}")
    if not 0 <= seed < 2**32:
        raise InputError(f"seed {seed} is not possible; give a whole number below 2^32.")
    rng = np.random.default_rng([seed, *map(ord, level)])
    experiments, as_built = _experiments(rng), _as_built(rng)
    effects = _hidden(level, as_built, list(experiments.values())[:-1:3], rng)
    hidden = {h.effect.kind: dict(h.values) for h in effects}
    specs = [
        RecordingSpec(
            name=name, simulate=e, hidden=hidden, role="estimate" if e.sweep is None else "validate"
        )
        for name, e in experiments.items()
    ]
    simulated = load_recordings(_scenario(seed, specs), as_built, Path(), None, progress)
    files = [
        RecordingSpec(file=f"{spec.name}.csv", role=spec.role, theta2=r.theta2)
        for spec, r in zip(specs, simulated, strict=True)
    ]
    truth = Truth(
        {h.effect.kind: h.level for h in effects},
        {name: x for values in hidden.values() for name, x in values.items()},
        float(as_built.parameters["EI"].value),
    )
    return Challenge(_scenario(seed, files), tuple(map(_measured, simulated)), truth)


def _experiments(rng: np.random.Generator) -> dict[str, SimulateSpec]:
    """Seven working points to estimate on, a sweep through all of them to validate."""
    *seeds, last = (int(seed) for seed in rng.integers(1, 2**31, 8))
    places = [float(k * np.pi / 8) for k in range(1, 8)]
    points = {
        f"th{k}": SimulateSpec(theta2=theta2, seconds=MOVE_SECONDS, seed=seed)
        for k, (theta2, seed) in enumerate(zip(places, seeds, strict=True), 1)
    }
    ends = (places[0], places[-1])
    sweep = SimulateSpec(sweep=ends, seconds=SWEEP_SECONDS, excitation="prbs", seed=last)
    return {**points, "sweep": sweep}


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
    level: str, bare: Model, experiments: Sequence[SimulateSpec], rng: np.random.Generator
) -> list[HiddenEffect]:
    """Random effects, drawn until their sizes can be reached in these experiments."""
    count, low, high = LEVELS[level]
    detectability = Detectability(bare, experiments)
    for _ in range(ATTEMPTS):
        kinds = _kinds(count, rng)
        sizes = [float(np.exp(rng.uniform(np.log(low), np.log(high)))) for _ in kinds]
        try:
            return [
                hide_effect(effect(kind), detectability, size, rng)
                for kind, size in zip(kinds, sizes, strict=True)
            ]
        except UnreachableError:
            continue
    raise InputError("No challenge can be made from this seed; try another.")


def _kinds(count: int, rng: np.random.Generator) -> list[str]:
    """Kinds of effects at different locations."""
    chosen: list[str] = []
    while len(chosen) < count:
        taken = {effect(kind).location for kind in chosen}
        free = [kind for kind, e in sorted(candidates().items()) if e.location not in taken]
        chosen.append(str(rng.choice(free)))
    return chosen


def _measured(r: Recording) -> Recording:
    """The recording with the channels of references, camera and encoders only."""
    kept = {name: x for name, x in r.channels.items() if name in STDS or name.endswith("_ref")}
    return replace(r, channels=kept)


def _scenario(seed: int, recordings: Sequence[RecordingSpec]) -> Scenario:
    """The nominal arm without effects."""
    return Scenario.model_validate({
        "title": f"Challenge {seed}: what is missing?",
        "arm": {"preset": "paper"},
        "drive": {"kind": VelocityLoop.kind, "gains": list(GAINS)},
        "model": {"level": "nonlinear"},
        "sensors": {"camera_noise": STDS["z1"], "encoder_noise": STDS["theta1"]},
        "identify": {"parameters": ["EI"], "output": ["z"], "generations": 0},
        "diagnose": {"max_effects": 3},
        "recordings": recordings,
    })  # fmt: skip
