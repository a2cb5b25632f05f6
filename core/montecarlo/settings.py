"""What a study does: the paper's settings unless something else is said."""

from __future__ import annotations

import hashlib
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError, model_validator

from ..errors import InputError
from ..recording.spec import RecordingSpec, Settings, SimulateSpec, Whole
from ..scenario.schema import IdentifySpec, Scenario
from ..sentences import validation_sentence

Count = Annotated[Whole, Field(ge=1, le=100_000)]
Ratio = Annotated[float, Field(allow_inf_nan=False, ge=-100.0, le=300.0)] | None
"""Signal-to-noise ratio in dB; None: no noise."""

PRIOR = 0.2
"""Share of the nominal value: the paper's initial population and, by choice, the bounds."""

SWEEP_SECONDS, SWEEP_SEED = 10.0, 101
SWEEP = (float(np.pi / 8.0), float(7.0 * np.pi / 8.0))
"""rad"""

COUNTS = {"runs", "snr_db", "sweeps", "baseline_snr_db", "baseline_points", "bias_seeds"}
"""How much is done. More of it goes on from what is there, so it is no part of the identity."""


class StudySettings(Settings):
    """A scenario of simulated recordings at working points, and how much is done with it."""

    scenario: Scenario
    runs: Count = 20
    """Each with fresh noise and a fresh population; the excitation is that of the recordings."""
    snr_db: tuple[Ratio, ...] = (None, 20.0)
    sweeps: Whole = 10
    baseline_snr_db: tuple[Ratio, ...] = (None, 30.0, 20.0, 10.0)
    baseline_points: tuple[Annotated[Whole, Field(ge=2, le=63)], ...] = (3, 5, 7, 15)
    bias_seeds: Whole = 20
    seed: Whole = 1

    @model_validator(mode="after")
    def _can_be_studied(self) -> StudySettings:
        experiments = self.experiments
        if len(experiments) < 2:
            raise ValueError("needs two estimation recordings at least, one per working point.")
        for spec in self.scenario.recordings:
            if spec.simulate is None:
                raise ValueError(
                    f"cannot repeat recording {spec.name!r}, which is a file; a study needs "
                    f"recordings with simulate = {{...}}."
                )
            if spec.hidden:
                raise ValueError(
                    f"repeats the identification of a complete model; recording {spec.name!r} has "
                    "a hidden effect."
                )
        for spec in experiments:
            assert spec.simulate is not None
            if spec.simulate.theta2 is None:
                raise ValueError(f"needs simulate.theta2, the working point, in {spec.name!r}.")
        if not self.scenario.identify.parameters:
            raise ValueError('needs [identify] parameters, such as ["epsilon", "d"].')
        if self.scenario.identify.output not in (None, ("ydot",)):
            raise ValueError('compares the velocities of the rigid arm: output = "ydot".')
        return self

    @property
    def experiments(self) -> tuple[RecordingSpec, ...]:
        """One per working point."""
        return tuple(r for r in self.scenario.recordings if r.role == "estimate")

    @property
    def points(self) -> tuple[float, ...]:
        """rad"""
        return tuple(float(e.simulate.theta2 or 0.0) for e in self.experiments if e.simulate)

    @property
    def noisy_snr(self) -> float | None:
        """The ratio of the data whose estimates are validated and predicted."""
        return next((snr for snr in self.snr_db if snr is not None), None)

    def sweep(self, number: int) -> SimulateSpec:
        """The number-th sweep (from 1): those of the scenario, then more of the same kind."""
        stated = [r.simulate for r in self.scenario.recordings if r.role == "validate"]
        own = [s for s in stated if s is not None and s.sweep is not None]
        like = (
            own[0] if own else SimulateSpec(sweep=SWEEP, seconds=SWEEP_SECONDS, excitation="prbs")
        )
        seed = (like.seed if own else SWEEP_SEED) + number - 1
        return like.model_copy(update={"seed": seed, "snr_db": None})

    def identify(self, bounds: dict[str, tuple[float, float]], seed: int) -> IdentifySpec:
        """How one fit is made: evolution alone, as in the paper, with a population of its own."""
        stated = self.scenario.identify
        both = {**bounds, **stated.bounds}
        update = {"output": ("ydot",), "refine": False, "seed": seed, "bounds": both}
        return stated.model_copy(update=update)

    @property
    def identity(self) -> str:
        """A digest of all but how much is done: what results must share to be put together."""
        text = self.model_dump_json(exclude=COUNTS)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def make_settings(scenario: Scenario, **settings: object) -> StudySettings:
    """InputError where a study cannot be made of the scenario."""
    try:
        return StudySettings.model_validate({"scenario": scenario, **settings})
    except ValidationError as error:
        sentence = validation_sentence(error, StudySettings)
        raise InputError(f"The study {sentence.removeprefix('The document ')}") from None


def settings_of(text: str) -> StudySettings:
    """From `model_dump_json`, as workers receive it."""
    return StudySettings.model_validate_json(text)


def seeds(settings: StudySettings, *numbers: int) -> np.random.SeedSequence:
    """An independent stream for each use: which part, run, ratio, working point."""
    return np.random.SeedSequence([settings.seed, *numbers])


def snr_code(snr_db: float | None) -> int:
    """A whole number per `snr_db` in dB, the same whatever the order in which these are listed."""
    return 0 if snr_db is None else 1_000_000 + round(1000.0 * snr_db)


def snr_name(snr_db: float | None) -> str:
    """'inf' or '20dB' from `snr_db` in dB, for keys and file names."""
    return "inf" if snr_db is None else f"{snr_db:g}dB"
