"""How each candidate would change the outputs: sensitivities, and secants where there are none."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arm.arm import Arm, Structure
from ..arm.compiled import is_compiled
from ..diagnose.fit_problem import Data, Hypothesis, hypothesis
from ..effects.effect import Effect, EffectParameter
from ..identify.defect_correction import with_steps
from ..identify.unknowns import Unknown

SLOPE_SHARE = 0.1
"""Of a plausible size: small enough to be a slope, large enough to stand above rounding."""


COARSE = 0.5
"""Share of the steps per sample for columns: they need a direction, not the error's exactness."""


@dataclass(frozen=True)
class Trial:
    """A set of parameter values at which a candidate is simulated."""

    effect: Effect
    parameter: str
    values: Mapping[str, float]
    sizes: Mapping[str, float]
    """How far each size is from neutral: what a coefficient multiplies."""
    one_sided: bool
    """Whether the sign of the size is fixed."""
    scanned: bool
    """Whether the size is one of a grid: the response is no line through neutral."""
    shape: tuple[tuple[str, float], ...]
    """Secondary values: columns of one effect are combined only within one shape."""


@dataclass(frozen=True)
class Column(Trial):
    """One direction in which an effect moves the outputs."""

    blocks: tuple[np.ndarray, ...]
    """(M, k) per recording, in floors: by how much the outputs change when the parameters go from
    neutral to `values`; zero where it diverged."""
    diverged: bool = False
    """Whether the simulation came apart at every size that was tried."""


def trials(base: Hypothesis, candidate: Effect, data: Data) -> list[Trial]:
    """What is simulated for one candidate."""
    arm = candidate.changed_arm(base.model.arm, {})
    effect_parameters = candidate.parameters(arm, base.model.drive, data.sizes)
    if not effect_parameters:
        return [Trial(candidate, "", {}, {"": 1.0}, True, True, ())]
    primary = [k for k in effect_parameters if not k.secondary]
    sought = [k for k in primary if candidate.sought(k, data.rig)]
    found = []
    for shape in _shapes([k for k in effect_parameters if k.secondary]):
        for one in sought:
            p, name = one.parameter, one.parameter.name
            for value in _sizes(one):
                values = {other.parameter.name: other.neutral for other in primary}
                values |= dict(shape) | {name: value}
                size = {name: value - one.neutral}
                fixed = p.lower >= one.neutral or p.upper <= one.neutral
                found.append(Trial(candidate, name, values, size, fixed, bool(one.grid), shape))
    return found


def must_compile(trial: Trial, arm: Arm) -> bool:
    """Whether the trial is of an arm that this machine has never compiled, which takes seconds."""
    changed = Structure.of(trial.effect.changed_arm(arm, trial.values))
    return changed != Structure.of(arm) and not is_compiled(changed)


def _sizes(one: EffectParameter) -> tuple[float, ...]:
    if one.grid:
        return one.grid
    return (one.neutral + SLOPE_SHARE * (one.parameter.value - one.neutral),)


def _shapes(secondary: Sequence[EffectParameter]) -> list[tuple[tuple[str, float], ...]]:
    """Grids of secondary parameters, varied together by their place in the grid."""
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
class Zeros:
    """The base's errors (M, k) per recording by steps per sample: what columns are taken from.

    Simulated as coarsely as the trial, so that the steps' own error cancels.
    """

    base: Hypothesis
    found: dict[int | None, list[np.ndarray]] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def at(self, steps: int | None) -> list[np.ndarray]:
        """With that many steps."""
        with self.lock:
            if steps not in self.found:
                residuals = replace(self.base.residuals, anchor=None)
                if steps is not None:
                    residuals = with_steps(residuals, steps)
                self.found[steps] = residuals.blocks(self.base.vector)
            return self.found[steps]


SMALLER_TRIES = 5
"""Sizes of a slope that are tried; the second one suffices unless the first is far out of step."""

WITHIN = 0.3
"""Of what the outputs are off: what a straight line leaves out grows with the square, so it is a
tenth where it is as much as the line at what they are off."""

MARGIN = 0.5
"""Of the size that a straight line asks for: one that bends asks for less."""

SMALLEST_SHARE = 1e-2
"""Of the size before it."""


def simulated(
    data: Data,
    base: Hypothesis,
    accepted: Sequence[Effect],
    trial: Trial,
    zeros: Zeros,
) -> Column:
    """The column of one trial, with COARSE of the steps.

    A slope is asked for at a size that moves the outputs by less than they are off: where a
    vibration falls out of step, a line through a larger size says nothing of the smaller ones. A
    simulation that comes apart is tried at smaller sizes, too.
    """
    for _ in range(SMALLER_TRIES):
        blocks, zero = _moved(data, base, accepted, trial, zeros)
        held = all(np.all(np.abs(b) < FAR_OFF) for b in blocks)
        share = WITHIN * _rms(zero) / max(_rms(blocks), 1e-300)
        if held and (trial.scanned or not share < 1.0) or not trial.values:
            break
        trial = _smaller(trial, max(MARGIN * share if held else 0.0, SMALLEST_SHARE))
    blocks = blocks if held else [np.zeros_like(b) for b in blocks]
    return Column(**vars(trial), blocks=tuple(blocks), diverged=not held)


def _moved(
    data: Data, base: Hypothesis, accepted: Sequence[Effect], trial: Trial, zeros: Zeros
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """By how much a trial changes the outputs, and the base's errors, both (M, k) per recording."""
    own = [u for u in base.unknowns.items if u.parameter.name in base.model.effect_values]
    changed = dict(trial.values)
    kept: list[Unknown] = [u for u in own if u.parameter.name not in changed]
    values = {**base.model.effect_values, **base.values(), **changed}
    nuisance = tuple(u for u in data.nuisance if u.parameter.name not in changed)
    tried = hypothesis(
        replace(data, nuisance=nuisance), [*accepted, trial.effect], values, freed=kept,
        finer=COARSE,
    )  # fmt: skip
    # As coarse as the zero, so that steps cancel.
    errors = replace(tried.residuals, anchor=None).blocks(tried.vector)
    zero = zeros.at(tried.residuals.predictor.steps)
    return [a - b for a, b in zip(zero, errors, strict=True)], zero


def _smaller(trial: Trial, share: float) -> Trial:
    """The same with its size that many times as far from neutral."""
    changed = {n: v - (1.0 - share) * trial.sizes.get(n, 0.0) for n, v in trial.values.items()}
    return replace(trial, values=changed, sizes={n: share * x for n, x in trial.sizes.items()})


def _rms(blocks: Sequence[np.ndarray]) -> float:
    """Of all recordings together, infinite where one came apart."""
    found = math.sqrt(sum(float(np.sum(b**2)) for b in blocks) / sum(b.size for b in blocks))
    return found if math.isfinite(found) else math.inf


FAR_OFF = 1e7
"""In noise floors: a trial that moves an output this far has come apart."""


def nearer_to_neutral(
    effect: Effect, arm: Arm, data: Data, values: Mapping[str, float]
) -> dict[str, float]:
    """The values with those of an effect at SMALLEST_SHARE of their distance from neutral."""
    own = effect.parameters(arm, data.bare.drive, data.sizes)
    neutral = {k.parameter.name: k.neutral for k in own if not k.secondary}
    return {
        n: neutral[n] + SMALLEST_SHARE * (v - neutral[n]) if n in neutral else v
        for n, v in values.items()
    }
