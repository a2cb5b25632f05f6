"""The rig of one study: its models, and the noise-free recordings that its cases share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from ..arm.slots import STIFFNESS, slot
from ..errors import InputError
from ..identify.compare import predictor_of
from ..identify.prepared_recording import Prepared, prepare
from ..identify.processing import Processing
from ..model import Model
from ..montecarlo.settings import PRIOR, StudySettings, settings_of
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..scenario.stated_effects import base_model
from ..sensors import sensor
from ..simulate.experiment import simulate_recording

REMEMBERED = 128
"""Recordings kept; one of 3 s takes a third of a megabyte."""

OUTPUTS = ("ydot1", "ydot2")

OF_SECTION = ("EI", "epsilon", "d")
"""Parameters that a stiffness follows from; with a number they belong to one segment."""


@dataclass
class Rig:
    """Models of a study and what they were asked to do before."""

    settings: StudySettings
    _recordings: dict[str, Recording] = field(default_factory=dict)

    @cached_property
    def truth(self) -> Model:
        """The non-linear arm that all recordings come from; InputError for one without ydot."""
        model = base_model(self.settings.scenario)
        if not model.arm.two_revolute:
            raise InputError(
                "A study needs an arm with two revolute joints, because it compares ydot."
            )
        return model.at_level("nonlinear")

    @cached_property
    def model(self) -> Model:
        """The LPV model that is identified."""
        return self.truth.at_level("lpv")

    @cached_property
    def rigid(self) -> Model:
        """The same arm with segments that do not bend."""
        arm = self.model.arm
        stiff = tuple(s.model_copy(update={"modes": 0}) for s in arm.segments)
        return replace(self.model, arm=arm.model_copy(update={"segments": stiff}))

    @cached_property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Nominal value plus and minus the prior's share, for each estimated parameter."""
        bounds = {}
        for name in self._names:
            value = self.model.parameter(name).value
            ends = sorted(((1.0 - PRIOR) * value, (1.0 + PRIOR) * value))
            bounds[name] = (float(ends[0]), float(ends[1]))
        return bounds | dict(self.settings.scenario.identify.bounds)

    def recording(self, spec: SimulateSpec, name: str) -> Recording:
        """What the true arm does, without noise."""
        spec = spec.model_copy(update={"snr_db": None})
        key = f"{name} {spec.model_dump_json()}"
        if key not in self._recordings:
            while len(self._recordings) >= REMEMBERED:
                self._recordings.pop(next(iter(self._recordings)))
            self._recordings[key] = simulate_recording(self.truth, spec, name)
        return self._recordings[key]

    def experiments(self) -> list[Recording]:
        """One per working point, without noise."""
        return [self.recording(e.simulate, e.name) for e in self.settings.experiments if e.simulate]

    def prepared(self, recording: Recording, model: Model | None = None) -> Prepared:
        """A recording ready to be compared with the paper's output."""
        return prepare(model or self.model, recording, [sensor("ydot")], Processing())

    def predict(
        self, model: Model, recordings: Sequence[Recording], values: dict[str, float]
    ) -> list[np.ndarray]:
        """ydot (N, 2) of each recording."""
        experiments = [self.prepared(r, model) for r in recordings]
        return predictor_of(experiments, values).predict(np.zeros(0))

    def stiffness(self, values: dict[str, float]) -> list[float]:
        """EI in N m² of each segment that bends; one number where all always are the same."""
        stiffnesses = self._stiffness(values)
        return stiffnesses[:1] if self._one_stiffness else stiffnesses

    def _stiffness(self, values: dict[str, float]) -> list[float]:
        p, arm = self.model.numbers(values).p, self.model.arm
        return [float(p[slot(k, STIFFNESS)]) for k in range(arm.joints) if arm.modes[k]]

    @cached_property
    def _one_stiffness(self) -> bool:
        """Whether the segments start alike and no estimated parameter belongs to one of them."""
        stems = {n.rstrip("0123456789") for n in self._names if n[-1:].isdigit()}
        return len(set(self._stiffness({}))) == 1 and not stems & set(OF_SECTION)

    @property
    def _names(self) -> tuple[str, ...]:
        return self.settings.scenario.identify.parameters


@lru_cache(maxsize=2)
def rig_of(text: str) -> Rig:
    """The rig of settings as they travel; a worker makes it once."""
    return Rig(settings_of(text))


def outputs(recording: Recording) -> np.ndarray:
    """ydot (N, 2) in rad/s."""
    return np.column_stack([recording[name] for name in OUTPUTS])


def with_outputs(recording: Recording, y: np.ndarray) -> Recording:
    """The recording with other ydot y (N, 2) in rad/s."""
    both = {name: y[:, k] for k, name in enumerate(OUTPUTS)}
    return replace(recording, channels={**recording.channels, **both})


def noisy(recording: Recording, snr_db: float | None, seed: np.random.SeedSequence) -> Recording:
    """White noise on ydot with `snr_db` = 10 log10(cov y / cov noise) in dB, per channel."""
    if snr_db is None:
        return recording
    y = outputs(recording)
    std = noise_std(y, snr_db)
    return with_outputs(recording, y + std * np.random.default_rng(seed).standard_normal(y.shape))


def noise_std(y: np.ndarray, snr_db: float) -> np.ndarray:
    """(2,) rad/s from ydot y (N, 2) in rad/s and `snr_db` in dB."""
    return np.asarray(y.std(axis=0) * 10.0 ** (-snr_db / 20.0))


def fit_percent(measured: np.ndarray, model: np.ndarray) -> list[float]:
    """FIT = 100 max(1 - |y - yhat| / |y - mean y|, 0) of each channel, y `measured` and yhat
    `model`, both (N, k)."""
    error = np.linalg.norm(measured - model, axis=0)
    spread = np.linalg.norm(measured - measured.mean(axis=0), axis=0)
    return [float(f) for f in 100.0 * np.maximum(1.0 - error / spread, 0.0)]
