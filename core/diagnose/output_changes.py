"""How each candidate changes the outputs: sensitivities, or secants where no sensitivity exists."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arm.arm import Arm, Structure
from ..arm.compiled import is_compiled
from ..effects import effect
from ..effects.effect import Effect, EffectParameter
from ..estimate.problem import FitData, Problem, problem_of
from ..identify.defect_correction import with_steps
from ..identify.predictor import simulate_together
from ..identify.unknowns import Unknown
from ..least_squares import DIVERGED

SLOPE_SHARE = 0.1
"""Of a plausible size: small enough for a linear response, large enough to stand above rounding."""


TRIAL_SUBSTEPS = 0.5
"""Share of the steps per sample for output changes: only their direction matters."""


@dataclass(frozen=True)
class Trial:
    """A set of parameter values at which a candidate is simulated."""

    effect: Effect
    parameter: str
    values: Mapping[str, float]
    sizes: Mapping[str, float]
    """Distance of each size from neutral; a coefficient multiplies it."""
    one_sided: bool
    """Whether the sign of the size is fixed."""
    scanned: bool
    """Whether the size is one of a grid, because the response is not linear from neutral on."""
    force_shape: tuple[tuple[str, float], ...]
    """Shape parameters: only changes of one force shape are combined."""


@dataclass(frozen=True)
class OutputChange(Trial):
    """One direction in which an effect moves the outputs."""

    blocks: tuple[np.ndarray, ...]
    """(M, k) per recording, in noise floors: change of the outputs from neutral to `values`; zero
    if the simulation diverged."""
    diverged: bool = False
    """Whether the simulation diverged at every size that was tried."""


Changes = Sequence[OutputChange]


def trials(base: Problem, candidate: Effect, data: FitData) -> list[Trial]:
    """The trials of one candidate."""
    arm = candidate.changed_arm(base.model.arm, {})
    effect_parameters = candidate.parameters(arm, base.model.drive, data.sizes)
    primary = [k for k in effect_parameters if not k.secondary]
    sought = [k for k in primary if candidate.is_searched(k, data.rig)]
    planned = []
    for shape in _shapes([k for k in effect_parameters if k.secondary]):
        for item in sought:
            p, name = item.parameter, item.parameter.name
            for value in _sizes(item):
                values = {other.parameter.name: other.neutral for other in primary}
                values |= dict(shape) | {name: value}
                size = {name: value - item.neutral}
                fixed = p.lower >= item.neutral or p.upper <= item.neutral
                planned.append(Trial(candidate, name, values, size, fixed, bool(item.grid), shape))
    return planned


def needs_compilation(trial: Trial, arm: Arm) -> bool:
    """Whether the trial needs an arm that was never compiled here, which takes seconds."""
    changed = Structure.of(trial.effect.changed_arm(arm, trial.values))
    return changed != Structure.of(arm) and not is_compiled(changed)


def _sizes(item: EffectParameter) -> tuple[float, ...]:
    if item.grid:
        return item.grid
    return (item.neutral + SLOPE_SHARE * (item.parameter.value - item.neutral),)


def _shapes(secondary: Sequence[EffectParameter]) -> list[tuple[tuple[str, float], ...]]:
    """Grids of secondary parameters; all take the same index."""
    longest = max((len(k.grid) for k in secondary), default=0)
    if not longest:
        return [tuple((k.parameter.name, k.parameter.value) for k in secondary)]
    return [
        tuple(
            (k.parameter.name, k.grid[min(i, len(k.grid) - 1)] if k.grid else k.parameter.value)
            for k in secondary
        )
        for i in range(longest)
    ]


@dataclass
class BaseErrors:
    """Errors (M, k) per recording of the base model by steps per sample; changes are differences
    from them. Both are simulated equally coarsely, so that the error of the steps cancels."""

    base: Problem
    by_substeps: dict[int, list[np.ndarray]] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def at(self, steps: int) -> list[np.ndarray]:
        """Errors with so many steps per sample."""
        with self.lock:
            if steps not in self.by_substeps:
                residuals = with_steps(self.base.residuals, steps)
                self.by_substeps[steps] = residuals.blocks(self.base.vector)
            return self.by_substeps[steps]


SMALLER_TRIES = 5
"""Sizes tried for a sensitivity; the second suffices unless a vibration is far out of phase."""

LARGEST_CHANGE = 0.3
"""Largest change of the outputs over the error of the base. The remainder of a linear response
grows with the square; here it is a tenth."""

SIZE_MARGIN = 0.5
"""Of the size that linear extrapolation gives; a curved response needs less."""

SMALLEST_SHARE = 1e-2
"""Smallest next size, over the size before it."""


def simulate_output_changes(
    data: FitData, base: Problem, accepted: Sequence[Effect],
    planned: Sequence[Trial], base_errors: BaseErrors,
) -> list[OutputChange]:  # fmt: skip
    """The output changes of some trials, simulated side by side with TRIAL_SUBSTEPS of the steps.

    A sensitivity is taken at a size that changes the outputs by less than the error of the base. A
    larger size can put a vibration out of phase. Diverging simulations are repeated at smaller
    sizes.
    """
    finished: dict[int, OutputChange] = {}
    waiting = dict(enumerate(planned))
    for tries in range(SMALLER_TRIES):
        is_last, models = tries == SMALLER_TRIES - 1, {}
        for i, trial in waiting.items():
            models[i] = _trial_model(data, base, accepted, trial)
        simulate_together(
            [(problem.residuals.predictor, problem.vector) for problem in models.values()]
        )
        for i, trial in list(waiting.items()):
            change, share = _output_change(trial, models[i], base_errors)
            if is_last or not share < 1.0:
                finished[i] = change
                del waiting[i]
            else:
                waiting[i] = _smaller(trial, max(share, SMALLEST_SHARE))
        if not waiting:
            break
    return [finished[i] for i in range(len(planned))]


def _output_change(
    trial: Trial, model: Problem, base_errors: BaseErrors
) -> tuple[OutputChange, float]:
    """Change of the outputs by a trial, and the share of its size that is small enough."""
    # As coarse as the zero, so that steps cancel.
    errors = replace(model.residuals, anchor=None).blocks(model.vector)
    zero = base_errors.at(model.residuals.predictor.steps)
    blocks = [a - b for a, b in zip(zero, errors, strict=True)]
    if not all(np.all(np.abs(b) < DIVERGED) for b in blocks):
        nothing = tuple(np.zeros_like(b) for b in blocks)
        return OutputChange(**vars(trial), blocks=nothing, diverged=True), 0.0
    largest = LARGEST_CHANGE * _rms(zero) / max(_rms(blocks), 1e-300)
    share = 1.0 if trial.scanned or not largest < 1.0 else SIZE_MARGIN * largest
    return OutputChange(**vars(trial), blocks=tuple(blocks)), share


def _trial_model(data: FitData, base: Problem, accepted: Sequence[Effect], trial: Trial) -> Problem:
    """The base with the effect of a trial at its values."""
    own = [u for u in base.unknowns.items if u.parameter.name in base.model.effect_values]
    changed = _included_neutral(base, data, trial) | dict(trial.values)
    kept: list[Unknown] = [u for u in own if u.parameter.name not in changed]
    values = {**base.all_values(), **changed}
    nuisance = tuple(u for u in data.nuisance if u.parameter.name not in changed)
    return problem_of(
        replace(data, nuisance=nuisance), [*accepted, trial.effect], values, freed=kept,
        refine=TRIAL_SUBSTEPS,
    )  # fmt: skip


def _included_neutral(base: Problem, data: FitData, trial: Trial) -> dict[str, float]:
    """Neutral sizes of what the effect of a sensitivity includes and the base lacks: that has
    sensitivities of its own."""
    if trial.scanned:
        return {}
    have = {e.kind for e in base.model.effects}
    parts = [effect(kind) for kind in trial.effect.includes if kind not in have]
    arm, drive = base.model.arm, base.model.drive
    sizes = [k for part in parts for k in part.parameters(arm, drive, data.sizes)]
    return {k.parameter.name: k.neutral for k in sizes if not k.secondary}


def as_small_as(trial: Trial, finished: Iterable[OutputChange]) -> Trial:
    """The trial of a sensitivity at the size that another shape of the same force needed, so that
    it seldom needs a second simulation."""
    for change in finished:
        if change.effect is trial.effect and change.parameter == trial.parameter:
            for name, size in trial.sizes.items():
                if not trial.scanned and abs(change.sizes[name]) < abs(size):
                    return _smaller(trial, change.sizes[name] / size)
    return trial


def _smaller(trial: Trial, share: float) -> Trial:
    """The trial with `share` times its distance from neutral, which stays what it is exactly."""
    sizes = {n: share * x for n, x in trial.sizes.items()}
    neutral = {n: trial.values[n] - x for n, x in trial.sizes.items()}
    changed = {n: neutral[n] + x for n, x in sizes.items()}
    return replace(trial, values={**trial.values, **changed}, sizes=sizes)


def _rms(blocks: Sequence[np.ndarray]) -> float:
    """Rms of all recordings together; infinite if one diverged."""
    rms = math.sqrt(sum(float(np.sum(b**2)) for b in blocks) / sum(b.size for b in blocks))
    return rms if math.isfinite(rms) else math.inf


def nearer_to_neutral(
    effect: Effect, arm: Arm, data: FitData, values: Mapping[str, float]
) -> dict[str, float]:
    """The values, with the sizes of one effect at SMALLEST_SHARE of their distance from neutral."""
    own = effect.parameters(arm, data.bare.drive, data.sizes)
    neutral = {k.parameter.name: k.neutral for k in own if not k.secondary}
    return {
        n: neutral[n] + SMALLEST_SHARE * (v - neutral[n]) if n in neutral else v
        for n, v in values.items()
    }
