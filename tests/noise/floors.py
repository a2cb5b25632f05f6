"""Recordings with a noise that is known, and the floors that are found of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknowns
from flexgui.core.model import Model
from flexgui.core.noise.noise_floor import Floor, channel_floors
from flexgui.core.noise.sensor_noise import autoregressive_noise
from flexgui.core.recording.recording import LoggerFilter, Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from tests.helpers import PAPER, looped

BARE = looped(PAPER)

MANY = 40
"""Draws of the noise that the truth is taken from."""


@dataclass(frozen=True)
class Case:
    """How a recording comes about, and how it is looked at."""

    cutoff: float | None = None
    """Hz"""
    output_cutoff: float | None = None
    ar_coefficient: float = 0.0
    quantum: float = 0.0
    dt: float = 1e-3
    seconds: float = 2.0
    excitation: str = "prbs"
    decimate: int = 1
    logger: LoggerFilter | None = None
    std: float = 3e-5
    wrong: float = 1.0
    """Times the true stiffness: of the model that is compared."""

    @property
    def processing(self) -> Processing:
        first, second = (
            None if hz is None else ZeroPhaseLowPass(cutoff_hz=hz)
            for hz in (self.cutoff, self.output_cutoff)
        )
        return Processing(first, self.decimate, second)


@cache
def clean(dt: float, seconds: float, excitation: str, seed: int) -> Recording:
    spec = SimulateSpec(
        theta2=1.2, seconds=seconds, sample_time=dt, seed=seed, amplitude=0.3, hold=0.02,
        excitation=excitation,
    )  # fmt: skip
    return simulate_recording(BARE, spec, f"r{seed}")


def noisy(case: Case, recording: Recording, rng: np.random.Generator) -> Recording:
    """With noise of the case on camera and encoders; rounded to its step."""
    from flexgui.core.recording.recording import apply_logger_filter

    channels, logged = dict(recording.channels), {}
    for name in ("z1", "z2", "theta1", "theta2"):
        x = channels[name] + case.std * autoregressive_noise(
            rng, len(recording.time), case.ar_coefficient
        )
        x = np.round(x / case.quantum) * case.quantum if case.quantum else x
        if case.logger is not None:
            x, logged[name] = apply_logger_filter(x, case.dt, case.logger), case.logger
        channels[name] = x
    return replace(recording, channels=channels, logger_filters=logged)


def truth(case: Case, recording: Recording, outputs: Sequence[str]) -> dict[str, float]:
    """channel -> rms of what the noise is after the processing, over many draws."""
    rng = np.random.default_rng(99)
    quiet = replace(case, std=0.0, quantum=0.0)
    sensors = [sensor(kind) for kind in outputs]

    def processed(r: Recording) -> np.ndarray:
        return prepare(BARE, r, sensors, case.processing).measured

    without = processed(noisy(quiet, recording, rng))
    apart = [processed(noisy(case, recording, rng)) - without for _ in range(MANY)]
    names = [c.name for s in sensors for c in s.channels(PAPER)]
    return dict(zip(names, np.sqrt(np.mean(np.square(apart), axis=(0, 1))), strict=True))


def model_of(case: Case) -> Model:
    """The model that is compared."""
    segments = tuple(
        s.model_copy(update={"young_modulus": (s.young_modulus or 0.0) * case.wrong})
        for s in PAPER.segments
    )
    return replace(BARE, arm=PAPER.model_copy(update={"segments": segments}))


def floors(
    model: Model,
    recordings: Sequence[Recording],
    outputs: Sequence[str],
    processing: Processing,
    stated: dict[str, float] | None = None,
) -> dict[str, Floor]:
    """With nothing asked of the model's fidelity."""
    experiments = [prepare(model, r, [sensor(k) for k in outputs], processing) for r in recordings]
    predictor = Predictor(experiments, Unknowns(()), {}, steps=4)
    vector, which = np.zeros(0), range(len(experiments))
    motions = predictor.trajectories([(vector, which)])[0]
    errors = [e.measured - p for e, p in zip(experiments, predictor.predict(vector), strict=True)]
    return channel_floors(experiments, errors, motions, stated or {}, 0.0)


def found_and_true(
    case: Case, outputs: tuple[str, ...] = ("z", "encoder"), stated: bool = False, count: int = 3
) -> tuple[dict[str, Floor], dict[str, float]]:
    """channel -> the floor that is found of some recordings; channel -> the true noise."""
    plain = [clean(case.dt, case.seconds, case.excitation, seed) for seed in range(1, count + 1)]
    rng = np.random.default_rng(7)
    recordings = [noisy(case, r, rng) for r in plain]
    names = ("z1", "z2", "theta1", "theta2")
    known = dict.fromkeys(names, case.std) if stated else {}
    found = floors(model_of(case), recordings, outputs, case.processing, known)
    return found, true_of(case, outputs)


@cache
def true_of(case: Case, outputs: tuple[str, ...]) -> dict[str, float]:
    """Of a case's first recording: the same whether the noise is stated or estimated."""
    return truth(case, clean(case.dt, case.seconds, case.excitation, 1), outputs)
