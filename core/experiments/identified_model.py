"""A model fitted to the existing recordings: information and reliability."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ..diagnose.base_fit import BaseFit
from ..diagnose.next_experiment import data_for_recording, expected_recording
from ..diagnose.stated_results import final_parameters
from ..estimate.fit_result import with_robust_covariance
from ..estimate.problem import FitData, Problem
from ..experiments.information import Information, information
from ..experiments.trial import Trial, model_without_servo, simulate_reference
from ..identify.estimates import derived_estimates
from ..identify.prepared_recording import make_task
from ..identify.uncertainty import Autocovariance, autocovariance
from ..results import Estimate
from ..trajectory import Trajectory

TRUSTED = 6
"""Recordings used to measure the model's reliability."""

FEWEST_STEPS, MOST_STEPS = 4, 64
"""Steps per sample."""
CLOSE = 0.02
"""Share of a peak: a tenth of the margin to a limit."""

SMOOTHED = 5
"""Samples for a speed from an encoder: one count is no motion."""

UNSURE = 0.05
"""Two standard deviations over the value, above which limits must hold for the whole interval;
below, the motion hardly depends on it."""


@dataclass(frozen=True)
class IdentifiedModel:
    """The model on the existing recordings, and their information."""

    base_fit: BaseFit

    @property
    def problem(self) -> Problem:
        """At its minimum."""
        return self.base_fit.base.problem

    @property
    def data(self) -> FitData:
        """The existing recordings."""
        return self.base_fit.data

    @property
    def motions(self) -> list[Trajectory]:
        """Motions of the model along each recording."""
        return [motion for motion, _, _ in self.problem.motions()]

    @cached_property
    def motion_errors(self) -> np.ndarray:
        """(joints,) relative error of the model's motion when the recorded references are
        simulated; torques without a loop let it drift."""
        model = model_without_servo(self.problem)
        worst = np.zeros(model.arm.joints)
        for e in self.data.experiments[:TRUSTED]:
            motion = simulate_reference(self.problem, make_task(model, e.recording), self.steps)
            for k in range(model.arm.joints):
                place = e.recording.channels.get(f"theta{k + 1}")
                if place is not None:
                    miss = _missed(place, motion.q[:, k], motion.v[:, k], e.recording.sample_time)
                    worst[k] = max(worst[k], miss)
        return worst

    @cached_property
    def steps(self) -> int:
        """Steps per sample, such that twice as many change no peak by more than CLOSE."""
        recording = self.data.experiments[0].recording
        task, steps = make_task(model_without_servo(self.problem), recording), FEWEST_STEPS
        peaks = _peaks(simulate_reference(self.problem, task, steps))
        while steps < MOST_STEPS:
            finer = _peaks(simulate_reference(self.problem, task, 2 * steps))
            if np.all(np.abs(finer - peaks) <= CLOSE * peaks):
                break
            steps, peaks = 2 * steps, finer
        return steps

    @cached_property
    def models(self) -> list[Problem]:
        """The fitted model, and variants at the ends of uncertain intervals."""
        labels, variants = self.problem.unknowns.labels, [self.problem]
        for name, e in self.estimates.items():
            if name not in labels:
                continue
            far = 2.0 * e.std if math.isfinite(e.std) else 0.0
            if far > UNSURE * abs(e.value):
                for value in (max(e.value - far, e.lower), min(e.value + far, e.upper)):
                    x = self.problem.vector.copy()
                    x[labels.index(name)] = value
                    variants.append(self.problem.at(x))
        return variants

    @cached_property
    def errors(self) -> Autocovariance:
        """Autocovariance of the errors; new recordings are expected to have the same."""
        pairs = zip(self.base_fit.base.errors, self.problem.residuals.counted, strict=True)
        return autocovariance(*pairs)

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """Shared parameters that are estimated, and what follows from them, by name."""
        return {e.name: e for e in final_parameters(with_robust_covariance(self.base_fit.base))}

    @cached_property
    def known(self) -> Information:
        """Information of the existing recordings."""
        base = self.base_fit.base
        counted = self.problem.residuals.counted
        own = [autocovariance(each) for each in zip(base.errors, counted, strict=True)]
        return information(self.problem.unknowns.labels, base.descended.slopes, own)

    def deviations(self, shown: Information) -> dict[str, float]:
        """Parameter name -> standard deviation, SI, for given information."""
        problem, labels = self.problem, self.problem.unknowns.labels
        covariance = shown.covariance(labels)
        own = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        derived = derived_estimates(
            problem.model, problem.unknowns, problem.vector, covariance, None
        )
        by_name = dict(zip(labels, map(float, own), strict=True))
        return by_name | {e.name: e.std for e in derived}

    def data_for(self, trial: Trial) -> FitData:
        """The data of a planned trial."""
        model, like = model_without_servo(self.problem), self.data.experiments[0].recording
        task, point = trial.task(model)
        return data_for_recording(
            self.data, expected_recording(model, task, point, trial.motion(self.problem), like)
        )


def _missed(place: np.ndarray, modelled: np.ndarray, speed: np.ndarray, dt: float) -> float:
    """Relative error of a joint's (N,) peaks of position and speed."""
    rate = scipy.signal.savgol_filter(place, SMOOTHED, 2, deriv=1, delta=dt)
    moved, fast = np.abs(modelled - modelled[0]).max(), np.abs(speed).max()
    if not moved > 0.0 or not fast > 0.0:
        return 0.0
    difference = np.abs((place - place[0]) - (modelled - modelled[0])).max()
    faster = max(float(np.abs(rate).max() - fast), 0.0)
    return float(max(difference / moved, faster / fast))


def _peaks(motion: Trajectory) -> np.ndarray:
    """Peaks of positions and speeds of all coordinates."""
    return np.concatenate([np.ptp(motion.q, axis=0), np.abs(motion.v).max(axis=0)])
