"""Events: forces that act in one short stretch of a recording, and at no other time.

Somebody pushes the arm, or it touches something. No law of the motion explains that, and every law
that is fitted to it is wrong. What follows a stretch that is left out begins with a state of its
own; so an error that one event caused is gone with the stretch, whatever the force was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..diagnose.evidence import WHOLE_SHARE
from ..estimate.fit_result import fit
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData, problem_of
from ..estimate.validation import ValidationFit
from ..identify.first_states import START, first_state_names
from ..identify.predictor import MotionCache
from ..identify.prepared_recording import Prepared, prepare
from ..identify.unknowns import Unknown, start_parameter
from ..least_squares import as_finite, cost_of, pseudo_inverse
from ..propose.carriers import RIDGE, SMOOTH, hats
from ..propose.targets import ForceTarget, force_targets
from ..propose.variables import FINE, Factor, Variable, time_of
from ..recording.recording import Beginning, Recording
from ..results import Event

STRETCHES = 31
"""Hats over the time of a recording, in which an event is looked for."""

LONGEST = 1 / 6
"""Of a recording: what lasts longer is no event."""

FEWEST_SAMPLES = 40
"""Of a rest of a recording that is worth an own first state."""

ROUNDS = 2
"""Fits without the stretches: the first, of a model that an event has bent, may miss a part of it.
"""

MARGIN = 0.5
"""Of an event's length, that is left out before and after it."""

HALF = 0.5
"""Of the usual force: where an event begins and ends."""


class Stretch(NamedTuple):
    """A part of a recording, in s since it began."""

    start: float
    stop: float

    def widened(self, end: float) -> Stretch:
        """With a margin on both sides, within a recording that ends at `end` in s."""
        margin = MARGIN * (self.stop - self.start)
        return Stretch(max(self.start - margin, 0.0), min(self.stop + margin, end))


def events_in(
    model: FittedModel, stopped: Callable[[], bool] = lambda: False,
    unseen: Callable[[FittedModel], ValidationFit | None] = lambda _: None,
) -> tuple[Event, ...]:  # fmt: skip
    """One event in each recording whose error is above the noise, where the recordings show nothing
    more without these stretches, and those of recordings that no fit has seen (`unseen` fits a
    model to them); else none."""
    above = _above_noise(model)
    pairs = zip(above, model.data.experiments, strict=True)
    disturbed = [i for i, (x, e) in enumerate(pairs) if x > RELEVANT * e.counted.sum()]
    found = _likeliest(model, disturbed, above, stopped)
    if found is None:
        return ()
    place, stretches = found
    values, events = model.refit.problem.all_values(), dict[int, Event]()
    for _ in range(ROUNDS):
        data = without_stretches(model.data, stretches)
        undisturbed = fit(problem_of(data, model.effects, values), None, stopped)
        values |= undisturbed.problem.all_values()
        left = max(cost_of(undisturbed.errors) - data.count, 0.0)
        if stopped() or left > (1.0 - WHOLE_SHARE) * sum(above[i] for i in disturbed):
            return ()
        events = _events(model, values, place, stretches)
        stretches = {i: _around(model, i, event) for i, event in events.items()}
    own = (_with_rest(model, i, event) for i, event in events.items())
    other = unseen(FittedModel(data, undisturbed, model.effects))
    if other is None:
        return tuple(own)
    return (*own, *events_in(FittedModel(other.data, other.fit, model.effects), stopped))


def _above_noise(model: FittedModel) -> list[float]:
    """Squared error above the noise of each recording, in squared noise floors."""
    pairs = zip(model.refit.errors, model.data.experiments, strict=True)
    return [max(cost_of([r]) - float(e.counted.sum()), 0.0) for r, e in pairs]


@dataclass(frozen=True)
class _Place:
    """Where a force acts: a joint, or the tip in both directions."""

    name: str
    title: str
    components: tuple[ForceTarget, ...]


def _places(model: FittedModel) -> list[_Place]:
    each = force_targets(model.refit.problem.model.arm)
    joints = [_Place(t.name, t.title, (t,)) for t in each if not t.probe.acts.tip]
    tip = tuple(t for t in each if t.probe.acts.tip)
    return [*joints, *([_Place("tip", "the tip", tip)] if tip else [])]


def _likeliest(
    model: FittedModel,
    disturbed: Sequence[int],
    above: Sequence[float],
    stopped: Callable[[], bool],
) -> tuple[_Place, dict[int, Stretch]] | None:
    """The place whose forces in one stretch of each disturbed recording explain most, and the
    stretches (by recording); None if they explain less than half, in one of the recordings."""
    best, most = None, 0.0
    time = time_of([motion for motion, _, _ in model.refit.problem.motions()])
    knots = np.linspace(0.0, max(float(x[-1]) for x in time.along), STRETCHES)
    for place in _places(model):
        if stopped():
            return None
        columns = _columns(model, place, time, knots)
        each = {i: _stretch(model, i, columns, knots) for i in disturbed}
        share = min((x / above[i] for i, (x, _) in each.items()), default=0.0)
        total = sum(x for x, _ in each.values())
        if share > HALF and total > most:
            best, most = (place, {i: stretch for i, (_, stretch) in each.items()}), total
    return best


def _columns(
    model: FittedModel, place: _Place, time: Variable, knots: np.ndarray
) -> list[np.ndarray]:
    """Per recording (M, k, components, K): the change of the outputs by a force of one around each
    of the knots (K,)."""
    signals = hats(
        time, Factor("Force", "", "", "", tuple(np.ones(len(x)) for x in time.along)), knots
    )
    each = [target.responses(model, signals) for target in place.components]
    return [
        as_finite(np.stack([np.stack([c[i] for c in answers], -1) for answers in each], -2))
        for i in range(len(time.along))
    ]


def _stretch(
    model: FittedModel, i: int, columns: Sequence[np.ndarray], knots: np.ndarray
) -> tuple[float, Stretch]:
    """What forces in one stretch of recording `i` explain of its squared error, and the shortest
    stretch that explains nearly as much as any."""
    A, b = _without_nuisance(model, i, columns[i])
    longest = max(int(LONGEST * len(knots)), 1)
    gains = {
        (first, count): _explained(A, b, slice(first, first + count))
        for count in range(1, longest + 1)
        for first in range(len(knots) - count + 1)
    }
    most = max(gains.values())
    first, count = next(key for key, x in gains.items() if x >= WHOLE_SHARE * most)
    distance, end = knots[1] - knots[0], float(knots[-1])
    # A hat more on each side, since the model is bent by what happened.
    start = max(float(knots[first] - 2.0 * distance), 0.0)
    stop = min(float(knots[first] + (count + 1) * distance), end)
    return gains[first, count], Stretch(start, stop)


def _without_nuisance(
    model: FittedModel, i: int, columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(components, K, components, K) and (components, K): inner products of the columns with each
    other and with the error of recording `i`, with its nuisance projected out."""
    S = as_finite(model.refit.descended.slopes[i])
    S = S.reshape(-1, S.shape[-1])
    S, r = S[:, np.any(S != 0.0, axis=0)], model.refit.errors[i].ravel()
    shape = columns.shape[-2:]
    G = columns.reshape(len(r), -1)
    own = pseudo_inverse(S.T @ S)
    A = G.T @ G - (G.T @ S) @ own @ (S.T @ G)
    b = G.T @ r - (G.T @ S) @ own @ (S.T @ r)
    return A.reshape(*shape, *shape), b.reshape(shape)


def _explained(A: np.ndarray, b: np.ndarray, which: slice) -> float:
    """Fall of the squared error by the columns of some knots."""
    part = b[:, which].ravel()
    return float(part @ _solved(A[:, which][:, :, :, which].reshape(len(part), -1), part))


def _solved(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) the coefficients, of which those cost something that nothing shows."""
    return np.asarray(pseudo_inverse(A + RIDGE * np.diag(np.diag(A))) @ b)


def without_stretches(data: FitData, stretches: Mapping[int, Stretch]) -> FitData:
    """The data without a stretch of some recordings (by number): what is before and what follows
    are recordings of their own, and the state in which the second begins is not known."""
    pieces = [
        (i, piece) for i, e in enumerate(data.experiments) for piece in _pieces(e, stretches.get(i))
    ]
    experiments = tuple(e for _, e in pieces)
    renamed = {
        e.recording.name: data.experiments[i].recording.name
        for i, e in pieces
        if e.recording.name != data.experiments[i].recording.name
    }
    known = {e.recording.name for e in experiments}
    nuisance = [u for u in data.nuisance if u.recording is None or u.recording in known]
    for name, whole in renamed.items():
        own = [u for u in data.nuisance if u.recording == whole]
        nuisance += [replace(u, recording=name) for u in own if not _is_start(u)]
        nuisance += _starts(data, name)
    fixed = dict(data.fixed)
    for name, whole in renamed.items():
        fixed |= {f"{k[: -len(whole)]}{name}": x for k, x in data.fixed.items()
                  if k.endswith(f"@{whole}")}  # fmt: skip
    return replace(
        data, experiments=experiments, nuisance=tuple(nuisance), fixed=fixed, anchor=None,
        weights=tuple(data.weights[i] for i, _ in pieces), motion_cache=MotionCache(),
        noise_ratios=tuple(data.noise_ratios[i] for i, _ in pieces) if data.noise_ratios else (),
    )  # fmt: skip


def _is_start(u: Unknown) -> bool:
    return u.parameter.name.startswith(START)


def _starts(data: FitData, name: str) -> list[Unknown]:
    """What is not known of the state in which a rest begins."""
    dt = min(e.recording.sample_time for e in data.experiments)
    names = first_state_names(data.bare, dt)
    return [
        Unknown(start_parameter(data.bare, each.removeprefix(START)), name, False) for each in names
    ]


def _pieces(e: Prepared, stretch: Stretch | None) -> Iterator[Prepared]:
    """A recording before and after a stretch, where enough is left of it."""
    if stretch is None:
        yield e
        return
    r = e.recording
    first, last = (int(np.searchsorted(r.time - r.time[0], t)) for t in stretch)
    if first >= FEWEST_SAMPLES:
        yield _prepared(e, r.rows(slice(first)))
    if len(r.time) - last >= FEWEST_SAMPLES:
        rest = replace(r.rows(slice(last, None)), name=f"{r.name} after {r.time[last]:.4g} s")
        yield _prepared(e, replace(rest, beginning=Beginning.MOTION))


def _prepared(e: Prepared, part: Recording) -> Prepared:
    return prepare(e.model, part, e.outputs, e.processing)


def _events(
    model: FittedModel, values: Mapping[str, float], place: _Place, stretches: Mapping[int, Stretch]
) -> dict[int, Event]:
    """What acts in and around each stretch (by recording), by a model with the `values` of all
    else."""
    problem = problem_of(replace(model.data, anchor=None), model.effects, values)
    at = replace(model, refit=replace(model.refit, problem=problem))
    time = time_of([motion for motion, _, _ in problem.motions()])
    looked = {i: s.widened(float(time.along[i][-1])) for i, s in stretches.items()}
    begin = [looked[i].start if i in looked else np.inf for i in range(len(time.along))]
    since = replace(time, along=tuple(x - t for x, t in zip(time.along, begin, strict=True)))
    knots = np.linspace(0.0, max(s.stop - s.start for s in looked.values()), FINE)
    columns, errors = _columns(at, place, since, knots), problem.errors(problem.vector)
    found = dict[int, Event]()
    for i in stretches:
        force = _force(columns[i], errors[i])
        start, stop, mean = _acting(knots + begin[i], force)
        recording = model.data.experiments[i].recording
        first = float(recording.time[0])
        found[i] = Event(
            recording.name, first + start, first + stop, place.name, place.title,
            tuple(float(x) for x in mean), place.components[0].unit,
        )  # fmt: skip
    return found


def _with_rest(model: FittedModel, i: int, event: Event) -> Event:
    """The event with what is left of recording `i` without it."""
    e, stretch = model.data.experiments[i], _around(model, i, event)
    times = [piece.recording.time for piece in _pieces(e, stretch)]
    return replace(event, rest=tuple((float(t[0]), float(t[-1])) for t in times))


def _force(columns: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """(components, K): the force around each knot that explains errors (M, k), by columns
    (M, k, components, K)."""
    shape = columns.shape[-2:]
    G = columns.reshape(errors.size, -1)
    bend = np.kron(np.eye(shape[0]), np.diff(np.eye(shape[1]), 2, axis=0))
    A = G.T @ G
    A += SMOOTH * float(np.mean(np.diag(A))) * bend.T @ bend
    return _solved(A, G.T @ errors.ravel()).reshape(shape)


def _around(model: FittedModel, i: int, event: Event) -> Stretch:
    """A stretch of recording `i` that holds the whole of an event."""
    first, last = (float(model.data.experiments[i].recording.time[k]) for k in (0, -1))
    return Stretch(event.start - first, event.stop - first).widened(last - first)


def _acting(knots: np.ndarray, force: np.ndarray) -> tuple[float, float, np.ndarray]:
    """From when to when a force (components, K) acts, in the unit of the knots (K,), and its mean
    (components,) then."""
    fine = np.linspace(knots[0], knots[-1], 20 * len(knots))
    along = np.array([np.interp(fine, knots, f) for f in force])
    size = np.linalg.norm(along, axis=0)
    typical = np.sum(size**2) / max(float(np.sum(size)), 1e-300)  # an edge may ring
    acting = np.flatnonzero(size >= HALF * typical)
    during = slice(acting[0], acting[-1] + 1)
    return float(fine[acting[0]]), float(fine[acting[-1]]), along[:, during].mean(axis=1)
