"""Which experiments to make next, within the limits, by their information.

Every trial is simulated with the fitted model and made as strong as the limits allow. They are
chosen one after the other: those that reduce the standard deviations of the wanted parameters most
(sum of logarithms), or that distinguish two effects (core.diagnose.next_experiment).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.base_fit import BaseFit
from ..diagnose.evidence import TIE
from ..diagnose.linear_screen import screen
from ..diagnose.next_experiment import (
    NAME,
    NormalMatrix,
    problem_on,
    score_on_data,
    shared_normal_matrix,
)
from ..effects import catalogue
from ..errors import InputError
from ..estimate.fit_result import FitResult, refit_with
from ..estimate.problem import Problem
from ..experiments.identified_model import IdentifiedModel
from ..experiments.information import Information, expected
from ..experiments.rig_limits import RigLimits, rig_limits
from ..experiments.trial import Trial, strongest, trials
from ..identify.predictor import on_all_cores
from ..model import Model
from ..progress import Progress
from ..results import Estimate
from ..scenario.rig_spec import LimitsSpec
from ..sentences import did_you_mean

SECONDS_AVAILABLE = 60.0
"""s available, if nothing else is stated."""

LONGEST_EXPERIMENT, SHORTEST_EXPERIMENT = 10.0, 1.0
"""s of one experiment: as long as the existing recordings, within these."""

MOST_EXPERIMENTS = 12
"""Experiments of one plan."""


@dataclass(frozen=True)
class ExperimentRequest:
    """What a user wants of the next experiments."""

    seconds: float = SECONDS_AVAILABLE
    """s, of all experiments together."""
    parameters: tuple[str, ...] = ()
    """Parameters to be determined better; empty: all that are estimated."""
    between: tuple[str, ...] = ()
    """Ids of two effects to distinguish; empty: none."""
    limits: LimitsSpec = LimitsSpec()


@dataclass(frozen=True)
class Candidate:
    """A trial as strong as allowed, and its information."""

    trial: Trial
    information: Information
    score: float
    """Score for distinguishing the two effects; 0 without them."""


@dataclass(frozen=True)
class ParameterDeviation:
    """A parameter, and its standard deviation before and after."""

    estimate: Estimate
    before: float
    after: float


@dataclass(frozen=True)
class Design:
    """The experiments to make, most informative first."""

    chosen: tuple[Candidate, ...]
    fitted: Problem
    limits: RigLimits
    deviations: tuple[ParameterDeviation, ...]
    competing: tuple[str, ...] = ()
    """Titles of the two effects to distinguish."""
    score: float = 0.0
    """Expected score of all experiments; above TIE decides."""

    @property
    def decides(self) -> bool:
        """Whether the two effects are distinguished."""
        return self.score > TIE


def design(base_fit: BaseFit, request: ExperimentRequest, progress: Progress) -> Design:
    """The experiments that a person should make next. InputError where nothing is to be known, a
    parameter or an effect is not known, the limits leave no motion, or the rig's drive can be
    played nothing."""
    fitted = IdentifiedModel(base_fit)
    _check_drive(fitted.problem.model)
    names = _parameters_of(fitted, request.parameters)
    if not names and not request.between:
        raise InputError(
            "Experiments can improve no estimated parameter. Select others with [identify] "
            "parameters, or two effects to distinguish."
        )
    limits = rig_limits(request.limits, fitted.motions)
    competing = _pair(fitted, request.between, progress)
    candidates = _candidates(fitted, limits, request, competing, progress)
    chosen = _chosen(fitted, candidates, names, request, bool(competing))
    return Design(
        chosen=tuple(chosen),
        fitted=fitted.problem,
        limits=limits,
        deviations=_deviations(fitted, chosen, names),
        competing=tuple(catalogue()[kind].title for kind in request.between),
        score=sum(c.score for c in chosen),
    )


def _check_drive(model: Model) -> None:
    if not model.drive.torque_known:
        raise InputError(
            f"No reference can be played on this rig: [drive] kind {model.drive.kind!r} states no "
            f"control loop. State the rig's loop, such as velocity_loop."
        )


def _parameters_of(fitted: IdentifiedModel, names: Sequence[str]) -> list[str]:
    """The parameters to be determined better, without those that nothing determines."""
    determined = {n: e for n, e in fitted.estimates.items() if math.isfinite(e.std) and e.std > 0.0}
    for name in names:
        if name not in fitted.estimates:
            raise InputError(
                f"--for {name}: it is not estimated; {did_you_mean(name, fitted.estimates)}"
            )
    return [n for n in (names or determined) if n in determined]


def _pair(fitted: IdentifiedModel, kinds: Sequence[str], progress: Progress) -> list[Problem]:
    """The model with each of the two effects, fitted to the existing recordings."""
    if not kinds:
        return []
    for kind in kinds:
        if kind not in catalogue():
            raise InputError(f"--between {kind}: {did_you_mean(kind, catalogue())}")
    data, problem, stopped = fitted.data, fitted.problem, progress.stopped
    present = list(problem.model.effects)
    progress.stage("Fitting both effects")
    screened = screen(
        data, problem, present, [catalogue()[kind] for kind in kinds], lambda _: stopped()
    )

    def with_it(kind: str) -> FitResult:
        s = next((c for c in screened.candidates if c.effect.kind == kind), None)
        if s is None:
            raise InputError(f"--between {kind}: these recordings cannot show it.")
        return refit_with(
            data, problem, [*present, s.effect], s.values, screened.whitener, screened.slopes,
            s.scanned, stopped,
        )  # fmt: skip

    return [refit.problem for refit in on_all_cores(with_it, kinds)]


def _candidates(
    fitted: IdentifiedModel, limits: RigLimits, request: ExperimentRequest,
    competing: list[Problem],
    progress: Progress,
) -> list[Candidate]:  # fmt: skip
    first = fitted.data.experiments[0].recording
    length = (len(first.time) - 1) * first.sample_time
    seconds = min(max(length, SHORTEST_EXPERIMENT), LONGEST_EXPERIMENT, request.seconds)
    dt = first.sample_time
    first_sizes, doubt, steps = _sizes(fitted), fitted.motion_errors, fitted.steps
    normal: list[NormalMatrix] = list(on_all_cores(shared_normal_matrix, competing))

    def simulate(trial: Trial) -> Candidate | None:
        if progress.stopped():
            return None
        strong = strongest(trial, fitted.models, limits, first_sizes, doubt, steps)
        progress.advance(text=trial.form)
        if strong is None:
            return None
        planned = fitted.data_for(strong)
        score = score_on_data(planned, competing[0], competing[1], normal) if competing else 0.0
        return Candidate(
            strong, expected(problem_on(planned, fitted.problem), fitted.errors), score
        )

    tried = trials(limits, round(seconds / dt) * dt, dt)
    progress.stage("Simulating the experiments that the limits allow", len(tried))
    candidates = [c for c in on_all_cores(simulate, tried) if c is not None]
    if not candidates and not progress.stopped():
        raise InputError(
            "No experiment stays within the limits: no joint may move from its start. State wider "
            "[limits] of position, speed or torque (default: the largest values in the estimation "
            "data)."
        )
    return candidates


def _sizes(fitted: IdentifiedModel) -> np.ndarray:
    """(joints,) half the range of each joint's recorded references: first sizes."""
    model, first = fitted.data.bare, fitted.data.experiments[0].recording
    names = model.drive.reference_channels(model.arm)[: model.arm.joints]
    spans = np.array([np.ptp(first[name]) / 2.0 for name in names])
    usual = float(spans.max()) or 1.0
    return np.where(spans > 0.0, spans, usual)


def _chosen(
    fitted: IdentifiedModel, candidates: Sequence[Candidate], names: Sequence[str],
    request: ExperimentRequest, distinguish: bool,
) -> list[Candidate]:  # fmt: skip
    """The most informative experiments, one after the other."""
    if not candidates:
        return []
    count = min(max(int(request.seconds / candidates[0].trial.seconds + 1e-9), 1), MOST_EXPERIMENTS)
    chosen: list[Candidate] = []
    remaining = list(candidates)

    def worth(c: Candidate) -> float:
        if distinguish:
            return c.score
        after = fitted.deviations(_with_candidates(fitted.known, [*chosen, c]))
        return -sum(math.log(max(after[n], 1e-300)) for n in names)

    while remaining and len(chosen) < count:
        best = max(remaining, key=worth)
        chosen.append(best)
        remaining.remove(best)
    return chosen


def _with_candidates(information: Information, more: Sequence[Candidate]) -> Information:
    for number, c in enumerate(more, start=1):
        information = information.plus(c.information.named(f"{NAME} {number}"))
    return information


EXACT = 0.05
"""Share by which more steps may change an experiment's information; its standard deviation changes
by half."""


def _deviations(
    fitted: IdentifiedModel, chosen: Sequence[Candidate], names: Sequence[str]
) -> tuple[ParameterDeviation, ...]:
    """Standard deviations of the fit, and with the chosen experiments."""
    exact = on_all_cores(
        lambda c: expected(
            problem_on(fitted.data_for(c.trial), fitted.problem), fitted.errors, EXACT
        ),
        chosen,
    )
    chosen = [replace(c, information=shown) for c, shown in zip(chosen, exact, strict=True)]
    before = fitted.deviations(fitted.known)
    after = fitted.deviations(_with_candidates(fitted.known, chosen))
    rows = []
    for name in names:
        e = fitted.estimates[name]
        share = after[name] / before[name] if before[name] > 0.0 else 1.0
        rows.append(ParameterDeviation(e, e.std, e.std * share))
    return tuple(rows)
