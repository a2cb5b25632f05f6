"""Which experiments to make next: the strongest that the limits allow, chosen by what they tell.

Every trial is simulated with the fitted model and made as strong as the limits allow. Those are
chosen, one after the other, that narrow the wanted parameters most (the sum of the logarithms of
their deviations), or that tell two effects apart (core.diagnose.next_experiment).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import savgol_filter

from core.diagnose.data import Data, Hypothesis
from core.diagnose.facts import final_parameters
from core.diagnose.groups import TIE
from core.diagnose.next_experiment import Known, on_data, score_on
from core.diagnose.next_experiment import information as fixed_by
from core.diagnose.planned import NAME, data_of, expected_recording
from core.diagnose.refit import Refit, refit_with, settled
from core.diagnose.screen import screen
from core.diagnose.start import Begun
from core.diagnose.verdict import remains
from core.effects import catalogue
from core.errors import InputError
from core.experiments.allowed import Allowed, allowed
from core.experiments.information import Information, information, narrowed
from core.experiments.trial import Trial, played, played_to, strongest, trials
from core.identify.predictor import on_all_cores
from core.identify.prepared import make_task
from core.model import Model
from core.progress import Progress
from core.results import Estimate
from core.scenario.rig_limits import LimitsSpec
from core.sentences import did_you_mean
from core.trajectory import Trajectory

SECONDS = 60.0
"""s that a person has, where nothing else is said: some runs between two coffees."""

LONGEST, SHORTEST = 10.0, 1.0
"""s of one experiment: as long as the recordings there are, within these."""

TRUSTED = 6
"""Recordings that tell how far the model can be trusted to say what a reference does."""

FEWEST, MOST_STEPS = 4, 64
"""Steps per sample."""
CLOSE = 0.02
"""Of a peak: a tenth of what is kept free of a limit, and a little."""

SMOOTHED = 5
"""Samples of an encoder whose slope is a speed: a count more or less is no motion."""

UNSURE = 0.05
"""Two deviations over the value, from which on a limit must hold wherever the value may be: below,
the motion hardly depends on it."""

MOST = 12
"""Experiments of one plan."""


@dataclass(frozen=True)
class Wish:
    """What a person asks of the next experiments."""

    seconds: float = SECONDS
    """s, of all experiments together."""
    parameters: tuple[str, ...] = ()
    """Those to be known better; empty: all that are estimated."""
    between: tuple[str, ...] = ()
    """Ids of two effects to tell apart; empty: none."""
    limits: LimitsSpec = LimitsSpec()


@dataclass(frozen=True)
class Candidate:
    """A trial as strong as it may be, and what it would tell."""

    trial: Trial
    told: Information
    score: float
    """By which the two effects are told apart; 0 without them."""


@dataclass(frozen=True)
class Deviation:
    """A parameter, and how well it is known before and after."""

    estimate: Estimate
    before: float
    after: float


@dataclass(frozen=True)
class Design:
    """The experiments to make, in the order of what each tells, and what they decide."""

    chosen: tuple[Candidate, ...]
    fitted: Hypothesis
    limits: Allowed
    deviations: tuple[Deviation, ...]
    rivals: tuple[str, ...] = ()
    """Titles of the two effects that are to be told apart."""
    score: float = 0.0
    """Expected, of all experiments together; above TIE decides."""

    @property
    def decides(self) -> bool:
        """Whether the two effects are told apart."""
        return self.score > TIE


@dataclass(frozen=True)
class _Fitted:
    """The model on the recordings there are, and what they tell."""

    begun: Begun

    @property
    def h(self) -> Hypothesis:
        return self.begun.base.hypothesis

    @property
    def data(self) -> Data:
        return self.begun.data

    @property
    def motions(self) -> list[Trajectory]:
        """Of the model along each recording."""
        everything = range(len(self.h.residuals.experiments))
        found = self.h.residuals.predictor.trajectories([(self.h.vector, everything)])[0]
        return [motion for motion, _, _ in found]

    @cached_property
    def doubt(self) -> np.ndarray:
        """(joints,) by which share of its motion the model missed each joint where the references
        of the recordings there are were played to it. Torques without a loop let it drift, and
        nothing damps what they excite."""
        model = played_to(self.h)
        worst = np.zeros(model.arm.joints)
        for e in self.data.experiments[:TRUSTED]:
            motion = played(self.h, make_task(model, e.recording), self.steps)
            for k in range(model.arm.joints):
                place = e.recording.channels.get(f"theta{k + 1}")
                if place is not None:
                    miss = _missed(place, motion.q[:, k], motion.v[:, k], e.recording.sample_time)
                    worst[k] = max(worst[k], miss)
        return worst

    @cached_property
    def steps(self) -> int:
        """Per sample, such that twice as many move no peak by more than CLOSE."""
        recording = self.data.experiments[0].recording
        task, steps = make_task(played_to(self.h), recording), FEWEST
        peaks = _peaks(played(self.h, task, steps))
        while steps < MOST_STEPS:
            finer = _peaks(played(self.h, task, 2 * steps))
            if np.all(np.abs(finer - peaks) <= CLOSE * peaks):
                break
            steps, peaks = 2 * steps, finer
        return steps

    @cached_property
    def models(self) -> list[Hypothesis]:
        """The fitted model, and where it might as well stand in what is hardly known."""
        labels, found = self.h.unknowns.labels, [self.h]
        for name, e in self.estimates.items():
            far = 2.0 * e.std if math.isfinite(e.std) else 0.0
            if far > UNSURE * abs(e.value):
                for value in (max(e.value - far, e.lower), min(e.value + far, e.upper)):
                    x = self.h.vector.copy()
                    x[labels.index(name)] = value
                    found.append(self.h.at(x))
        return found

    @cached_property
    def errors(self) -> dict[str, float]:
        """channel -> rms error in floors."""
        return remains(self.data.experiments, self.begun.base.errors).by_channel

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """Shared parameters that are estimated, by name."""
        labels = self.h.unknowns.labels
        listed = final_parameters(settled(self.begun.base))
        return {e.name: e for e in listed if e.name in labels}

    def there(self, trial: Trial) -> Data:
        """Its data."""
        model, like = played_to(self.h), self.data.experiments[0].recording
        task, point = trial.task(model)
        return data_of(
            self.data, expected_recording(model, task, point, trial.motion(self.h), like)
        )


def design(begun: Begun, wish: Wish, progress: Progress) -> Design:
    """The experiments that a person should make next.

    Args:
        begun: the model fitted to the recordings there are.
        wish: the time there is, what is to be known, and the limits.
        progress: hears what is done.

    Raises:
        InputError: a parameter or an effect that is not known, limits that leave no motion, or a
            rig whose drive nothing can be played to.
    """
    fitted = _Fitted(begun)
    _check_drive(fitted.h.model)
    names = _wanted(fitted, wish.parameters)
    limits = allowed(wish.limits, fitted.motions)
    rivals = _pair(fitted, wish.between, progress)
    progress.stage("Simulating the experiments that the limits allow")
    found = _candidates(fitted, limits, wish, rivals, progress)
    chosen = _chosen(fitted, found, names, wish, bool(rivals))
    known = information(fitted.h, fitted.errors)
    after = _with(known, [c.told for c in chosen])
    before = {name: fitted.estimates[name].std for name in names}
    will = narrowed(before, known, after, names)
    return Design(
        chosen=tuple(chosen),
        fitted=fitted.h,
        limits=limits,
        deviations=tuple(Deviation(fitted.estimates[n], before[n], will[n]) for n in names),
        rivals=tuple(catalogue()[kind].title for kind in wish.between),
        score=sum(c.score for c in chosen),
    )


def _missed(place: np.ndarray, said: np.ndarray, speed: np.ndarray, dt: float) -> float:
    """Share of its peaks, of position and speed, by which a joint (N,) was elsewhere than said."""
    rate = savgol_filter(place, SMOOTHED, 2, deriv=1, delta=dt)
    moved, fast = np.abs(said - said[0]).max(), np.abs(speed).max()
    if not moved > 0.0 or not fast > 0.0:
        return 0.0
    apart = np.abs((place - place[0]) - (said - said[0])).max()
    faster = max(float(np.abs(rate).max() - fast), 0.0)
    return float(max(apart / moved, faster / fast))


def _peaks(motion: Trajectory) -> np.ndarray:
    """Of places and speeds of all coordinates."""
    return np.concatenate([np.ptp(motion.q, axis=0), np.abs(motion.v).max(axis=0)])


def _check_drive(model: Model) -> None:
    if not model.drive.torque_known:
        raise InputError(
            f"Nothing can be played to this rig: what leads its joints is not known "
            f"([drive] kind {model.drive.kind!r}); state the loop that the rig has, such as "
            f"velocity_loop."
        )


def _wanted(fitted: _Fitted, names: Sequence[str]) -> list[str]:
    """The parameters to be known better; those that nothing fixes cannot be counted on."""
    known = {n: e for n, e in fitted.estimates.items() if math.isfinite(e.std) and e.std > 0.0}
    for name in names:
        if name not in fitted.estimates:
            raise InputError(
                f"--for {name}: it is not estimated; {did_you_mean(name, fitted.estimates)}"
            )
    return [n for n in (names or known) if n in known]


def _pair(fitted: _Fitted, kinds: Sequence[str], progress: Progress) -> list[Hypothesis]:
    """The model with the one effect and with the other, fitted to the recordings there are."""
    if not kinds:
        return []
    for kind in kinds:
        if kind not in catalogue():
            raise InputError(f"--between {kind}: {did_you_mean(kind, catalogue())}")
    data, h, stopped = fitted.data, fitted.h, progress.stopped
    present = list(h.model.effects)
    progress.stage("Fitting both effects")
    seen = screen(data, h, present, [catalogue()[kind] for kind in kinds], lambda _: stopped())

    def with_it(kind: str) -> Refit:
        s = next((c for c in seen.candidates if c.effect.kind == kind), None)
        if s is None:
            raise InputError(f"--between {kind}: these recordings cannot show it.")
        return refit_with(
            data, h, [*present, s.effect], s.values, seen.whitener, seen.slopes, s.scanned, stopped
        )

    return [one.hypothesis for one in on_all_cores(with_it, kinds)]


def _candidates(
    fitted: _Fitted, limits: Allowed, wish: Wish, rivals: list[Hypothesis], progress: Progress
) -> list[Candidate]:
    first = fitted.data.experiments[0].recording
    length = (len(first.time) - 1) * first.sample_time
    seconds = min(max(length, SHORTEST), LONGEST, wish.seconds)
    dt = first.sample_time
    begun, doubt, steps = _sizes(fitted), fitted.doubt, fitted.steps
    known: list[Known] = list(on_all_cores(fixed_by, rivals))

    def one(trial: Trial) -> Candidate | None:
        if progress.stopped():
            return None
        strong = strongest(trial, fitted.models, limits, begun, doubt, steps)
        progress.advance(text=trial.form)
        if strong is None:
            return None
        there = fitted.there(strong)
        score = score_on(there, rivals[0], rivals[1], known) if rivals else 0.0
        return Candidate(strong, information(on_data(there, fitted.h), fitted.errors), score)

    tried = trials(limits, round(seconds / dt) * dt, dt)
    found = [c for c in on_all_cores(one, tried) if c is not None]
    if not found and not progress.stopped():
        raise InputError(
            "No experiment keeps within the limits: from where the joints start none of them may "
            "move; widen [limits] position, speed or torque."
        )
    return found


def _sizes(fitted: _Fitted) -> np.ndarray:
    """(joints,) half the range of each joint's references so far: where the search begins."""
    model, first = fitted.data.bare, fitted.data.experiments[0].recording
    names = model.drive.reference_channels(model.arm)[: model.arm.joints]
    spans = np.array([np.ptp(first[name]) / 2.0 for name in names])
    usual = float(spans.max()) or 1.0
    return np.where(spans > 0.0, spans, usual)


def _chosen(
    fitted: _Fitted, found: Sequence[Candidate], names: Sequence[str], wish: Wish, apart: bool
) -> list[Candidate]:
    """One after the other, the one that tells most beside those that were chosen before."""
    if not found:
        return []
    count = min(max(int(wish.seconds / found[0].trial.seconds + 1e-9), 1), MOST)
    told = information(fitted.h, fitted.errors)
    chosen: list[Candidate] = []
    left = list(found)
    while left and len(chosen) < count:
        best = max(left, key=_worth(told, names, apart, len(chosen)))
        told = told.plus(best.told.named(f"{NAME} {len(chosen) + 1}"))
        chosen.append(best)
        left.remove(best)
    return chosen


def _worth(
    told: Information, names: Sequence[str], apart: bool, number: int
) -> Callable[[Candidate], float]:
    """How good a candidate is beside what is known."""

    def worth(c: Candidate) -> float:
        if apart:
            return c.score
        after = told.plus(c.told.named(f"{NAME} {number + 1}")).deviations()
        return -sum(math.log(max(after[n], 1e-300)) for n in names)

    return worth


def _with(known: Information, more: Sequence[Information]) -> Information:
    for number, one in enumerate(more, start=1):
        known = known.plus(one.named(f"{NAME} {number}"))
    return known
