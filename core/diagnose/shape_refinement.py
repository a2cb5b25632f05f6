"""A second look at the shape of an effect, joint by joint, once its sizes are known.

The screen chooses shapes from straight lines through the bare model. Where one joint's part is
large, what it leaves beside its line hides the shape of the other; and a force that is a wave over
the position has hundreds of orders that fit nearly alike, for working points some distance apart
share a wave of any order that puts whole waves between them. So each joint's part is taken out in
turn, the torque that is then missing is asked which shape it has along the motion (there a force
law is linear in its sizes, exactly), and the best of these shapes race.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import sympy as sp

from ..diagnose.fit_problem import Data, Hypothesis, again, hypothesis
from ..diagnose.gram_matrix import Explained, explain
from ..diagnose.missing_torque import SLOW, Pushed, pushed
from ..diagnose.output_changes import Column
from ..diagnose.refit import Refit, fit
from ..diagnose.refit_starts import ROUGH_ITERATIONS
from ..effects.effect import Effect, EffectParameter
from ..forces.element import Element
from ..forces.law import ForceLaw
from ..identify.prepared import prepare
from ..identify.processing import Processing
from ..model import Model

Shape = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Shaped:
    """The columns of one effect that explain the most together."""

    chosen: list[int]
    """One per parameter, each in the shape of its joint."""
    explained: Explained
    tried: float
    """How many sizes and shapes were tried for each of them."""


def place(name: str) -> str:
    """The number of the joint or segment at the end of a parameter's name, '' where it has none."""
    found = re.search(r"\d+$", name)
    return found[0] if found else ""


def own_shape(column: Column) -> dict[str, float]:
    """What shapes the column's own size: the effect at another joint may have another shape."""
    at = place(column.parameter)
    return {name: value for name, value in column.shape if place(name) in (at, "") or not at}


def best_shape(mine: Sequence[int], columns: Sequence[Column], w: np.ndarray) -> Shaped:
    """The shape that explains most at all joints alike, then joint by joint another one.

    `w` is the projected Gram matrix of all columns, `mine` those of the effect.
    """
    shapes = list(dict.fromkeys(columns[i].shape for i in mine))
    places = list(dict.fromkeys(place(columns[i].parameter) for i in mine))

    def taken(shape_at: Mapping[str, Shape]) -> tuple[list[int], Explained]:
        fitting = [i for i in mine if columns[i].shape == shape_at[place(columns[i].parameter)]]
        chosen = _best_per_parameter(fitting, columns, w)
        return chosen, explain(w, chosen, [columns[i].one_sided for i in chosen])

    best, at = None, {}
    for shape in shapes:
        found = taken(dict.fromkeys(places, shape))
        if best is None or found[1].drop > best[1].drop:
            best, at = found, dict.fromkeys(places, shape)
    assert best is not None
    for one in places if len(places) > 1 else ():
        for shape in shapes:
            found = taken({**at, one: shape})
            if found[1].drop > best[1].drop:
                best, at = found, {**at, one: shape}
    sizes = len(mine) / max(len(best[0]) * len(shapes), 1)
    return Shaped(*best, tried=sizes * float(len(shapes)) ** len(places))


def _best_per_parameter(mine: Sequence[int], columns: Sequence[Column], w: np.ndarray) -> list[int]:
    """The best size of each parameter on its own."""
    best: dict[str, tuple[float, int]] = {}
    for i in mine:
        drop = explain(w, [i], [columns[i].one_sided]).drop
        if columns[i].parameter not in best or drop > best[columns[i].parameter][0]:
            best[columns[i].parameter] = (drop, i)
    return [i for _, i in best.values()]


Stopped = Callable[[], bool]

RACED = 4
"""Shapes from which a descent starts."""


def refine_shape(data: Data, found: Refit, effect: Effect, stopped: Stopped) -> Refit:
    """The same model from the best shape at each joint, where that leaves less."""
    model, best = found.hypothesis.model, found
    effect_parameters = effect.parameters(model.arm, model.drive, data.sizes)
    for shape in [
        k for k in effect_parameters if k.secondary and k.finely and place(k.parameter.name)
    ]:
        at = place(shape.parameter.name)
        sizes = [k for k in effect_parameters if not k.secondary and place(k.parameter.name) == at]
        for start in _starts(data, best.hypothesis, effect, sizes, shape):
            if not stopped():
                tried = fit(start, None, stopped, most=ROUGH_ITERATIONS)
                best = tried if tried.cost < best.cost else best
    return best


NOISE = 4096
"""Samples of white noise that tell what filters leave of it, to a few per cent."""


def _unfiltered(data: Data) -> Data:
    """The same recordings without what happens to measurement and model alike before they are
    compared: one linear model tells how an output answers a torque, not what is left of it.

    The noise floors grow as those of white noise.
    """
    noise = np.random.default_rng(0).standard_normal((NOISE, 1))
    left = [
        np.array([np.std(e.processing.apply(noise, e.recording.sample_time, [k])) for k in e.kinds])
        for e in data.experiments
    ]
    return replace(
        data,
        experiments=tuple(
            prepare(e.model, e.recording, e.outputs, Processing()) for e in data.experiments
        ),
        weights=tuple(w * share for w, share in zip(data.weights, left, strict=True)),
        anchor=None,
    )


def _starts(
    data: Data,
    h: Hypothesis,
    effect: Effect,
    sizes: Sequence[EffectParameter],
    shape: EffectParameter,
) -> list[Hypothesis]:
    without = _without(data, h, sizes, shape)
    motions = _pushed(without, data)
    if not motions:
        return []
    tried = Sized(effect, h.model, {**h.model.effect_values, **h.values()}, tuple(sizes), shape)
    return [again(data, h, values, finer=1) for values in best_shapes(tried, motions, RACED)]


def _without(
    data: Data, h: Hypothesis, sizes: Sequence[EffectParameter], shape: EffectParameter
) -> Hypothesis:
    """The model with the sizes at neutral; these and their shape are no unknowns."""
    held = {k.parameter.name for k in (*sizes, shape)}
    neutral = {k.parameter.name: k.neutral for k in sizes}
    free = set(h.model.effect_parameters) - held
    own = [u for u in h.unknowns.items if u.parameter.name in free]
    values = {**h.model.effect_values, **h.values(), **neutral}
    return hypothesis(data, h.model.effects, values, freed=own, finer=1)


def _pushed(h: Hypothesis, data: Data) -> list[Pushed]:
    """Of each recording that tells its missing torque."""
    found: list[Pushed] = []
    if not all(e.processing.nothing for e in data.experiments):
        data = _unfiltered(data)
        h = again(data, h, finer=1)
    errors, agility = h.errors(h.vector), None
    for i, block in enumerate(errors):
        one, agility = pushed(h, i, block / data.weights[i], 1.0 / data.weights[i], agility)
        found += [] if one is None else [one]
    return found


@dataclass(frozen=True)
class Sized:
    """The part of an effect at one joint: a shape, and sizes in which its force is linear."""

    effect: Effect
    model: Model
    values: Mapping[str, float]
    sizes: tuple[EffectParameter, ...]
    shape: EffectParameter

    @property
    def joint(self) -> int:
        """From 0."""
        return int(place(self.shape.parameter.name)) - 1

    @cached_property
    def _p(self) -> np.ndarray:
        return self.model.numbers().p

    def element(self, size: EffectParameter, shape: float) -> Element | None:
        """The law of that joint with one size; None where it has a memory of its own."""
        alone = {k.parameter.name: k.neutral for k in self.sizes}
        alone |= {size.parameter.name: size.parameter.value, self.shape.parameter.name: shape}
        for one in self.effect.elements(self.model.arm, self._p, {**self.values, **alone}):
            mine = len(one.directions) == 1 and one.directions[0][self.joint]
            if mine and not one.law.states:
                return one
        return None


def best_shapes(tried: Sized, motions: Sequence[Pushed], most: int) -> list[dict[str, float]]:
    """Values of shape and sizes that explain more of the error than their neighbours,
    best first; none where the effect is no force of place and speed."""
    shapes = tried.shape.finely
    if any(tried.element(size, shapes[0]) is None for size in tried.sizes):
        return []
    errors = np.concatenate([spectrum_of_error(m.error).ravel() for m in motions])

    def at(shape: float) -> Fit:
        return shape, *_explained(_columns(tried, motions, shape), errors)

    fits = [at(shape) for shape in shapes]
    drops = np.array([-np.inf, *(drop for _, drop, _ in fits), -np.inf])
    peaks = [i for i in range(len(fits)) if drops[i + 1] >= max(drops[i], drops[i + 2])]
    highest = sorted(peaks, key=lambda i: -drops[i + 1])[: CLOSER * most]
    found = sorted((_top(fits, i, at) for i in highest), key=lambda one: -one[1])
    return [_values(tried, shape, sizes) for shape, _, sizes in found[:most]]


Fit = tuple[float, float, np.ndarray]
"""A shape, the reduction of the squared error, and the sizes."""

CLOSER = 4
"""Times as many peaks are looked at between the grid's shapes: where these fall beside a peak they
can miss it by more than peaks differ."""

BETWEEN = 9
"""Shapes tried between the neighbours of a peak."""


def _top(fits: Sequence[Fit], i: int, at: Callable[[float], Fit]) -> Fit:
    """The best around the i-th shape."""
    near = fits[max(i - 1, 0)][0], fits[min(i + 1, len(fits) - 1)][0]
    tried = [at(float(shape)) for shape in np.linspace(*near, BETWEEN)]
    return max([fits[i], *tried], key=lambda one: one[1])


def _values(tried: Sized, shape: float, coefficients: np.ndarray) -> dict[str, float]:
    found = {tried.shape.parameter.name: shape}
    for size, coefficient in zip(tried.sizes, coefficients, strict=True):
        p = size.parameter
        found[p.name] = float(np.clip(coefficient * p.value, p.lower, p.upper))
    return found


def _columns(tried: Sized, motions: Sequence[Pushed], shape: float) -> np.ndarray:
    """(N, sizes), complex: how the errors answer the forces of the sizes' own values."""
    elements = [tried.element(size, shape) for size in tried.sizes]
    j, parts = tried.joint, []
    for m in motions:
        x, v = m.place[:, j], m.speed[:, j]
        forces = [_force(e.law)(x, v, *e.values) + np.zeros(len(x)) for e in elements if e]
        torque = spectrum(np.column_stack(forces))
        parts.append((m.answer[:, :, j, None] * torque[:, None, :]).reshape(-1, len(forces)))
    return np.concatenate(parts)


def spectrum(block: np.ndarray) -> np.ndarray:
    """(F, k) of (N, k), faded at both ends."""
    window = np.hanning(len(block))[:, None]
    return np.asarray(np.fft.rfft((block - block.mean(axis=0)) * window, axis=0)[SLOW:])


def spectrum_of_error(error: np.ndarray) -> np.ndarray:
    """(F, k) of (N, k), to be compared with the answer to a faded torque.

    The answer of rates dies out much sooner than the window changes, that of positions never
    does: so differences are faded, and summed up again over the frequencies.
    """
    steps = np.diff(error, axis=0, prepend=error[:1])
    z = np.exp(-2j * np.pi * np.fft.rfftfreq(len(error))[SLOW:])
    return np.asarray(spectrum(steps) / (1.0 - z)[:, None])


def _explained(A: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray]:
    """Reduction of the squared error, and by which the columns are multiplied."""
    normal, right = np.real(A.conj().T @ A), np.real(A.conj().T @ b)
    x = np.linalg.lstsq(normal, right, rcond=1e-10)[0]
    return float(right @ x), x


@cache
def _force(law: ForceLaw):  # type: ignore[no-untyped-def]
    """The first force over arrays of place and speed."""
    return sp.lambdify([law.x[0], law.v[0], *law.parameters], law.forces[0], "numpy")
