"""Which experiments to make next: the strongest that the limits allow, chosen by what they tell.

Every trial is simulated with the fitted model and made as strong as the limits allow. Those are
chosen, one after the other, that narrow the wanted parameters most (the sum of the logarithms of
their deviations), or that tell two effects apart (core.diagnose.next_experiment).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.base_fit import BaseFit
from ..diagnose.evidence import TIE
from ..diagnose.fit_problem import Hypothesis
from ..diagnose.linear_screen import screen
from ..diagnose.next_experiment import (
    NAME,
    NormalMatrix,
    hypothesis_on,
    score_on_data,
    shared_normal_matrix,
)
from ..diagnose.refit import Refit, refit_with
from ..effects import catalogue
from ..errors import InputError
from ..experiments.fitted_model import FittedModel
from ..experiments.information import Information, expected
from ..experiments.rig_limits import RigLimits, rig_limits
from ..experiments.trial import Trial, strongest, trials
from ..identify.predictor import on_all_cores
from ..model import Model
from ..progress import Progress
from ..results import Estimate
from ..scenario.rig_spec import LimitsSpec
from ..sentences import did_you_mean

SECONDS = 60.0
"""s that a person has, where nothing else is said: some runs between two coffees."""

LONGEST, SHORTEST = 10.0, 1.0
"""s of one experiment: as long as the recordings there are, within these."""

MOST = 12
"""Experiments of one plan."""


@dataclass(frozen=True)
class ExperimentRequest:
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
    shows: Information
    score: float
    """By which the two effects are told apart; 0 without them."""


@dataclass(frozen=True)
class ParameterDeviation:
    """A parameter, and how well it is known before and after."""

    estimate: Estimate
    before: float
    after: float


@dataclass(frozen=True)
class Design:
    """The experiments to make, in the order of what each tells, and what they decide."""

    chosen: tuple[Candidate, ...]
    fitted: Hypothesis
    limits: RigLimits
    deviations: tuple[ParameterDeviation, ...]
    competing: tuple[str, ...] = ()
    """Titles of the two effects that are to be told apart."""
    score: float = 0.0
    """Expected, of all experiments together; above TIE decides."""

    @property
    def decides(self) -> bool:
        """Whether the two effects are told apart."""
        return self.score > TIE


def design(begun: BaseFit, wish: ExperimentRequest, progress: Progress) -> Design:
    """The experiments that a person should make next.

    Args:
        begun: the model fitted to the recordings there are.
        wish: the time there is, what is to be known, and the limits.
        progress: hears what is done.

    Raises:
        InputError: nothing to be known, a parameter or an effect that is not known, limits that
            leave no motion, or a rig whose drive nothing can be played to.
    """
    fitted = FittedModel(begun)
    _check_drive(fitted.h.model)
    names = _parameters_of(fitted, wish.parameters)
    if not names and not wish.between:
        raise InputError(
            "No parameter is estimated that experiments could make known better; choose some to "
            "identify ([identify] parameters), or two effects to tell apart."
        )
    limits = rig_limits(wish.limits, fitted.motions)
    competing = _pair(fitted, wish.between, progress)
    progress.stage("Simulating the experiments that the limits allow")
    found = _candidates(fitted, limits, wish, competing, progress)
    chosen = _chosen(fitted, found, names, wish, bool(competing))
    return Design(
        chosen=tuple(chosen),
        fitted=fitted.h,
        limits=limits,
        deviations=_deviations(fitted, chosen, names),
        competing=tuple(catalogue()[kind].title for kind in wish.between),
        score=sum(c.score for c in chosen),
    )


def _check_drive(model: Model) -> None:
    if not model.drive.torque_known:
        raise InputError(
            f"Nothing can be played to this rig: what leads its joints is not known "
            f"([drive] kind {model.drive.kind!r}); state the loop that the rig has, such as "
            f"velocity_loop."
        )


def _parameters_of(fitted: FittedModel, names: Sequence[str]) -> list[str]:
    """The parameters to be known better; those that nothing fixes cannot be counted on."""
    known = {n: e for n, e in fitted.estimates.items() if math.isfinite(e.std) and e.std > 0.0}
    for name in names:
        if name not in fitted.estimates:
            raise InputError(
                f"--for {name}: it is not estimated; {did_you_mean(name, fitted.estimates)}"
            )
    return [n for n in (names or known) if n in known]


def _pair(fitted: FittedModel, kinds: Sequence[str], progress: Progress) -> list[Hypothesis]:
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
    fitted: FittedModel,
    limits: RigLimits,
    wish: ExperimentRequest,
    competing: list[Hypothesis],
    progress: Progress,
) -> list[Candidate]:
    first = fitted.data.experiments[0].recording
    length = (len(first.time) - 1) * first.sample_time
    seconds = min(max(length, SHORTEST), LONGEST, wish.seconds)
    dt = first.sample_time
    begun, doubt, steps = _sizes(fitted), fitted.doubt, fitted.steps
    known: list[NormalMatrix] = list(on_all_cores(shared_normal_matrix, competing))

    def one(trial: Trial) -> Candidate | None:
        if progress.stopped():
            return None
        strong = strongest(trial, fitted.models, limits, begun, doubt, steps)
        progress.advance(text=trial.form)
        if strong is None:
            return None
        there = fitted.there(strong)
        score = score_on_data(there, competing[0], competing[1], known) if competing else 0.0
        return Candidate(strong, expected(hypothesis_on(there, fitted.h), fitted.errors), score)

    tried = trials(limits, round(seconds / dt) * dt, dt)
    found = [c for c in on_all_cores(one, tried) if c is not None]
    if not found and not progress.stopped():
        raise InputError(
            "No experiment keeps within the limits: from where the joints start none of them may "
            "move; state wider [limits] of position, speed or torque (without them what the "
            "recordings used is the limit)."
        )
    return found


def _sizes(fitted: FittedModel) -> np.ndarray:
    """(joints,) half the range of each joint's references so far: where the search begins."""
    model, first = fitted.data.bare, fitted.data.experiments[0].recording
    names = model.drive.reference_channels(model.arm)[: model.arm.joints]
    spans = np.array([np.ptp(first[name]) / 2.0 for name in names])
    usual = float(spans.max()) or 1.0
    return np.where(spans > 0.0, spans, usual)


def _chosen(
    fitted: FittedModel,
    found: Sequence[Candidate],
    names: Sequence[str],
    wish: ExperimentRequest,
    apart: bool,
) -> list[Candidate]:
    """One after the other, the one that tells most beside those that were chosen before."""
    if not found:
        return []
    count = min(max(int(wish.seconds / found[0].trial.seconds + 1e-9), 1), MOST)
    chosen: list[Candidate] = []
    left = list(found)

    def worth(c: Candidate) -> float:
        if apart:
            return c.score
        after = fitted.deviations(_with_candidates(fitted.known, [*chosen, c]))
        return -sum(math.log(max(after[n], 1e-300)) for n in names)

    while left and len(chosen) < count:
        best = max(left, key=worth)
        chosen.append(best)
        left.remove(best)
    return chosen


def _with_candidates(known: Information, more: Sequence[Candidate]) -> Information:
    for number, c in enumerate(more, start=1):
        known = known.plus(c.shows.named(f"{NAME} {number}"))
    return known


EXACT = 0.05
"""Share by which more steps may change what a chosen experiment shows; its deviation changes by
half of that."""


def _deviations(
    fitted: FittedModel, chosen: Sequence[Candidate], names: Sequence[str]
) -> tuple[ParameterDeviation, ...]:
    """The fit's own deviations, and what the chosen experiments make of them."""
    exact = on_all_cores(
        lambda c: expected(hypothesis_on(fitted.there(c.trial), fitted.h), fitted.errors, EXACT),
        chosen,
    )
    chosen = [replace(c, shows=shown) for c, shown in zip(chosen, exact, strict=True)]
    was = fitted.deviations(fitted.known)
    will = fitted.deviations(_with_candidates(fitted.known, chosen))
    found = []
    for name in names:
        e = fitted.estimates[name]
        share = will[name] / was[name] if was[name] > 0.0 else 1.0
        found.append(ParameterDeviation(e, e.std, e.std * share))
    return tuple(found)
