"""Refinement of an effect's shape, joint by joint, once its sizes are known.

The screen chooses shapes by linear response of the bare model. A large part at one joint hides the
shape at another. A force that is a wave over the position fits nearly alike with hundreds of
orders: working points some distance apart share every wave with whole periods between them. So each
joint's part is removed in turn, shapes are fitted to the missing torque along the motion (a force
law is linear in its sizes there), and refits from the best shapes are compared.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import sympy as sp

from ..diagnose.gram_matrix import Explained, explained_by
from ..diagnose.output_changes import Changes, OutputChange
from ..effects.effect import Effect, EffectParameter
from ..estimate.fit_result import FitResult, fit
from ..estimate.problem import FitData, Problem, problem_of, with_values
from ..estimate.starts import ROUGH_ITERATIONS
from ..forces.element import Element
from ..forces.law import ForceLaw
from ..identify.prepared_recording import prepare
from ..identify.processing import Processing
from ..missing_torque import FIRST_FREQUENCY, ErrorResponse, error_response
from ..model import Model

ForceShapeValues = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class ShapedChanges:
    """The output changes of one effect that together explain most."""

    chosen: list[int]
    """One per parameter, in the shape of its joint."""
    explained: Explained
    trial_count: float
    """Choices of sizes and shapes among which this one is the best."""


def joint_number(name: str) -> str:
    """Number of the joint or segment at the end of a parameter's name; '' if none."""
    match = re.search(r"\d+$", name)
    return match[0] if match else ""


def joint_force_shape(change: OutputChange) -> dict[str, float]:
    """Shape values of the joint; another joint may have other ones."""
    at = joint_number(change.parameter)
    return {
        name: value
        for name, value in change.force_shape
        if joint_number(name) in (at, "") or not at
    }


def best_force_shape(candidate: Effect, changes: Changes, w: np.ndarray) -> ShapedChanges:
    """The shape of an effect that explains most at all joints, then the best shape of each joint.

    w (Q + 1, Q + 1) is the projected Gram matrix of all changes, of which some must be those of the
    effect. A response from neutral on is linear, so the sensitivities to what the effect includes,
    and the model lacks, are added to its own, unless these leave nothing to it.
    """
    mine = [i for i, c in enumerate(changes) if c.effect is candidate]
    slopes = () if any(changes[i].scanned for i in mine) else candidate.includes
    included = [i for i, c in enumerate(changes) if c.effect.kind in slopes and not c.scanned]
    shapes = list(dict.fromkeys(changes[i].force_shape for i in mine))
    places = list(dict.fromkeys(joint_number(changes[i].parameter) for i in mine))

    def taken(shape_at: Mapping[str, ForceShapeValues]) -> tuple[list[int], Explained]:
        fitting = [
            i
            for i in mine
            if changes[i].force_shape == shape_at[joint_number(changes[i].parameter)]
        ]
        own = _best_per_parameter(fitting, changes, w)
        chosen = [*own, *included]
        explained = explained_by(w, chosen, [changes[i].one_sided for i in chosen])
        if included and not np.any(explained.coefficients[: len(own)]):
            return own, explained_by(w, own, [changes[i].one_sided for i in own])
        return chosen, explained

    def reduction(shape_at: Mapping[str, ForceShapeValues]) -> float:
        return taken(shape_at)[1].cost_reduction

    at = max((dict.fromkeys(places, shape) for shape in shapes), key=reduction)
    for joint in places if len(places) > 1 else ():
        at = max([at, *({**at, joint: shape} for shape in shapes)], key=reduction)
    chosen, explained = taken(at)
    sizes = Counter(changes[i].parameter for i in mine if changes[i].force_shape == shapes[0])
    choices = math.prod(sizes.values()) * float(len(shapes)) ** len(places)
    return ShapedChanges(chosen, explained, choices)


def _best_per_parameter(mine: Sequence[int], changes: Changes, w: np.ndarray) -> list[int]:
    """The best size of each parameter on its own."""
    best: dict[str, tuple[float, int]] = {}
    for i in mine:
        reduction = explained_by(w, [i], [changes[i].one_sided]).cost_reduction
        if changes[i].parameter not in best or reduction > best[changes[i].parameter][0]:
            best[changes[i].parameter] = (reduction, i)
    return [i for _, i in best.values()]


StopCheck = Callable[[], bool]

MOST_STARTS = 4
"""Most shapes from which a descent starts."""


def refine_force_shape(
    data: FitData, refit: FitResult, effect: Effect, stopped: StopCheck
) -> FitResult:
    """The model with the best shape at each joint, if its cost is lower."""
    model, best = refit.problem.model, refit
    effect_parameters = effect.parameters(model.arm, model.drive, data.sizes)
    for shape in [
        k
        for k in effect_parameters
        if k.secondary and k.fine_grid and joint_number(k.parameter.name)
    ]:
        at = joint_number(shape.parameter.name)
        sizes = [
            k for k in effect_parameters if not k.secondary and joint_number(k.parameter.name) == at
        ]
        for start in _starts(data, best.problem, effect, sizes, shape):
            if not stopped():
                other = fit(start, None, stopped, most=ROUGH_ITERATIONS)
                best = other if other.cost < best.cost else best
    return best


NOISE = 4096
"""Samples of white noise to measure what filters pass, to a few per cent."""


def _unfiltered(data: FitData) -> FitData:
    """The recordings without filters: one linear model gives the response of outputs to a torque,
    not of filtered outputs. Noise floors grow as for white noise."""
    noise = np.random.default_rng(0).standard_normal((NOISE, 1))
    gains = [
        np.array([np.std(e.processing.apply(noise, e.recording.sample_time, [k])) for k in e.kinds])
        for e in data.experiments
    ]
    unfiltered = (prepare(e.model, e.recording, e.outputs, Processing()) for e in data.experiments)
    weights = tuple(w * share for w, share in zip(data.weights, gains, strict=True))
    return replace(data, experiments=tuple(unfiltered), weights=weights, anchor=None)


def _starts(
    data: FitData, problem: Problem, effect: Effect, sizes: Sequence[EffectParameter],
    shape: EffectParameter,
) -> list[Problem]:  # fmt: skip
    without = _without(data, problem, sizes, shape)
    motions = _error_responses(without, data)
    if not motions:
        return []
    values = problem.all_values()
    peaks = force_shape_peaks(
        JointForce(effect, problem.model, values, tuple(sizes), shape), motions, MOST_STARTS
    )
    return [with_values(data, problem, peak, refine=1) for peak in peaks]


def _without(
    data: FitData, problem: Problem, sizes: Sequence[EffectParameter], shape: EffectParameter
) -> Problem:
    """The model with these sizes at neutral; they and their shape are no unknowns."""
    fixed = {k.parameter.name for k in (*sizes, shape)}
    neutral = {k.parameter.name: k.neutral for k in sizes}
    free = set(problem.model.effect_parameters) - fixed
    own = [u for u in problem.unknowns.items if u.parameter.name in free]
    values = {**problem.all_values(), **neutral}
    return problem_of(data, problem.model.effects, values, freed=own, refine=1)


def _error_responses(problem: Problem, data: FitData) -> list[ErrorResponse]:
    """The response of each recording from which missing torque can be found."""
    responses: list[ErrorResponse] = []
    if not all(e.processing.nothing for e in data.experiments):
        data = _unfiltered(data)
        problem = with_values(data, problem, refine=1)
    errors, agility = problem.errors(problem.vector), None
    for i, block in enumerate(errors):
        w = data.weights[i]
        response, agility = error_response(problem, i, block / w, 1.0 / w, agility)
        responses += [] if response is None else [response]
    return responses


@dataclass(frozen=True)
class JointForce:
    """An effect's force at one joint: a shape, and sizes in which it is linear."""

    effect: Effect
    model: Model
    values: Mapping[str, float]
    sizes: tuple[EffectParameter, ...]
    shape: EffectParameter

    @property
    def joint(self) -> int:
        """From 0."""
        return int(joint_number(self.shape.parameter.name)) - 1

    @cached_property
    def _p(self) -> np.ndarray:
        return self.model.numbers().p

    def element(self, size: EffectParameter, shape: float) -> Element | None:
        """The force element of the joint with one size, and the `shape` in its parameter's unit;
        None if it has a state."""
        sizes = {k.parameter.name: k.neutral for k in self.sizes}
        sizes |= {size.parameter.name: size.parameter.value, self.shape.parameter.name: shape}
        for element in self.effect.elements(self.model.arm, self._p, {**self.values, **sizes}):
            mine = len(element.directions) == 1 and element.directions[0][self.joint]
            if mine and not element.law.states:
                return element
        return None


def force_shape_peaks(
    force: JointForce, motions: Sequence[ErrorResponse], most: int
) -> list[dict[str, float]]:
    """Values of shape and sizes that explain more of the error than their neighbours, best first;
    none if the effect is no force of position and speed."""
    shapes = force.shape.fine_grid
    if any(force.element(size, shapes[0]) is None for size in force.sizes):
        return []
    errors = np.concatenate([spectrum_of_error(m.error).ravel() for m in motions])

    def at(shape: float) -> Fit:
        return shape, *_least_squares(_responses(force, motions, shape), errors)

    fits = [at(shape) for shape in shapes]
    reductions = np.array([-np.inf, *(reduction for _, reduction, _ in fits), -np.inf])
    peaks = [
        i for i in range(len(fits)) if reductions[i + 1] >= max(reductions[i], reductions[i + 2])
    ]
    # A grid can miss a peak by more than peaks differ: more of them are refined than are returned.
    highest = sorted(peaks, key=lambda i: -reductions[i + 1])[: most**2]
    peak_fits = sorted((_refine_peak(fits, i, at) for i in highest), key=lambda f: -f[1])
    return [_values(force, shape, sizes) for shape, _, sizes in peak_fits[:most]]


Fit = tuple[float, float, np.ndarray]
"""A shape, the reduction of the squared error, and the sizes."""

BETWEEN = 9
"""Shapes tried between the neighbours of a peak."""


def _refine_peak(fits: Sequence[Fit], i: int, at: Callable[[float], Fit]) -> Fit:
    """The best fit around the i-th shape."""
    near = fits[max(i - 1, 0)][0], fits[min(i + 1, len(fits) - 1)][0]
    between = [at(float(shape)) for shape in np.linspace(*near, BETWEEN)]
    return max([fits[i], *between], key=lambda f: f[1])


def _values(force: JointForce, shape: float, coefficients: np.ndarray) -> dict[str, float]:
    values = {force.shape.parameter.name: shape}
    for size, coefficient in zip(force.sizes, coefficients, strict=True):
        p = size.parameter
        values[p.name] = float(np.clip(coefficient * p.value, p.lower, p.upper))
    return values


def _responses(force: JointForce, motions: Sequence[ErrorResponse], shape: float) -> np.ndarray:
    """(N, sizes), complex: response of the errors to the forces at the sizes' own values."""
    elements = [force.element(size, shape) for size in force.sizes]
    j, parts = force.joint, []
    for m in motions:
        x, v = m.place[:, j], m.speed[:, j]
        forces = [_force_function(e.law)(x, v, *e.values) + np.zeros(len(x)) for e in elements if e]
        torque = spectrum(np.column_stack(forces))
        parts.append((m.response[:, :, j, None] * torque[:, None, :]).reshape(-1, len(forces)))
    return np.concatenate(parts)


def spectrum(block: np.ndarray) -> np.ndarray:
    """(F, k) spectrum of a `block` (N, k), windowed."""
    window = np.hanning(len(block))[:, None]
    return np.asarray(np.fft.rfft((block - block.mean(axis=0)) * window, axis=0)[FIRST_FREQUENCY:])


def spectrum_of_error(error: np.ndarray) -> np.ndarray:
    """(F, k) spectrum of an `error` (N, k), comparable with the response to a windowed torque.

    The response of rates dies out within the window, that of positions never does: so differences
    are windowed, and summed again over the frequencies.
    """
    steps = np.diff(error, axis=0, prepend=error[:1])
    z = np.exp(-2j * np.pi * np.fft.rfftfreq(len(error))[FIRST_FREQUENCY:])
    return np.asarray(spectrum(steps) / (1.0 - z)[:, None])


def _least_squares(A: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray]:
    """Reduction of the squared error, and the coefficients of the responses."""
    normal, right = np.real(A.conj().T @ A), np.real(A.conj().T @ b)
    x = np.linalg.lstsq(normal, right, rcond=1e-10)[0]
    return float(right @ x), x


@cache
def _force_function(law: ForceLaw):  # type: ignore[no-untyped-def]
    """The first force as a function of arrays of position and speed."""
    return sp.lambdify([law.x[0], law.v[0], *law.parameters], law.forces[0], "numpy")
