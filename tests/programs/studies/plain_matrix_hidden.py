"""What is hidden in a rig of the plain matrix, how well it shows, and whether it can be told.

- *Shown*: rms over all samples of what the healthy model misses on recordings without noise, beyond
  what the estimated parameters and the recordings' starts absorb, in floors (noise of the same
  route and a thousandth of the signal's spread, the product's own definition). An error of rms
  sqrt(1 + shown^2) floors is left: weak effects raise it to 1.5-2.2, strong ones to 5-12.
- *Can be told*: with everything else that is hidden free, nothing and every other effect of the
  catalogue in the place of a hidden one leaves an error above the floor, 1.06 times as in the
  verdict: within its floor a diagnosis asks for nothing. All are weighed linearly, at the sizes
  that the screen tries; the best of them, and what the hidden effect includes, are fitted. Effects
  that contain the hidden one are no rivals. Sets that fail are drawn anew. Pairs of stand-ins are
  not looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexgui.core.challenge.detectability import UnreachableError, crossing
from flexgui.core.diagnose.base_fit import compared_outputs
from flexgui.core.diagnose.force_shape_refinement import ShapedChanges, best_force_shape
from flexgui.core.diagnose.gram_matrix import gram_matrix
from flexgui.core.diagnose.output_changes import (
    BaseErrors,
    OutputChange,
    simulate_output_changes,
    trials,
)
from flexgui.core.effects import catalogue, effect, with_included
from flexgui.core.effects.effect import Effect, EffectParameter, Rig
from flexgui.core.effects.sizes import Sizes, sizes_of
from flexgui.core.estimate.fit_result import fit
from flexgui.core.estimate.problem import FitData, Problem, problem_of
from flexgui.core.identify.defect_correction import Anchor
from flexgui.core.identify.fit_unknowns import unknowns_with_starts
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.setup import Setup, make_setup
from flexgui.core.model import Model
from flexgui.core.noise.whitening import no_whitening
from flexgui.core.recording.recording import Recording
from flexgui.core.results import ABOVE
from flexgui.core.scenario.schema import Scenario
from flexgui.sentences.ranked import nesting
from tests.programs.studies.plain_matrix_rigs import STEPS_HZ
from tests.programs.studies.plain_matrix_rigs import Rig as Bench

WEAK, STRONG = (1.1, 2.0), (5.0, 12.0)
"""Floors, rms: between which a hidden effect shows."""

FIDELITY = 1e-3
"""Of a channel's spread, in its floor: what the diagnosis takes where nothing is stated."""

NEVER = ("large_motion",)
"""No effect of the arm but a level of the model."""

ATTEMPTS, AFRESH = 16, 4
"""Draws of a set; after so many none of it is kept."""

FITTED, ITERATIONS = 2, 6
"""Of the stand-ins, the best by straight lines that are fitted, and for how long."""


@dataclass(frozen=True)
class Truth:
    """What is hidden in a machine."""

    kinds: tuple[str, ...]
    values: Mapping[str, float]
    shown: Mapping[str, float]
    machine: Model


class Sight:
    """What the recordings of a bench show of a change of its machine."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.healthy = bench.healthy
        scenario = Scenario.model_validate(bench.document(true=True))
        self.spec = scenario.identify
        clean = bench.sketched(self.healthy)
        self.setup: Setup = make_setup(self.healthy, self.spec, clean)
        motions = [bench.roughly(self.healthy, i) for i in range(len(clean))]
        self.sizes: Sizes = sizes_of(motions)
        self.plain = self.data(clean)
        self.plain = replace(self.plain, weights=self._weights(clean))

    def data(self, recordings: Sequence[Recording]) -> FitData:
        """What a diagnosis compares on these recordings, in SI."""
        model, processing = self.setup.model, self.setup.processing
        outputs = compared_outputs(model, self.setup.outputs, recordings)
        experiments = tuple(prepare(model, r, outputs, processing) for r in recordings)
        ones = tuple(np.ones(e.measured.shape[1]) for e in experiments)
        steps = int(np.ceil(STEPS_HZ / self.bench.rate))
        nuisance = unknowns_with_starts(model, self.spec, recordings, outputs).items
        return FitData(model, experiments, nuisance, ones, {}, {}, self.sizes, steps)

    def _weights(self, clean: Sequence[Recording]) -> tuple[np.ndarray, ...]:
        """One over the floors: noise by the same route, and fidelity."""
        noisy = self.data(self.bench.measured(clean, 1))
        pairs = zip(errors_of(noisy), errors_of(self.plain), strict=True)
        apart = np.vstack([a - b for a, b in pairs])
        spread = np.vstack([e.measured - e.measured.mean(axis=0) for e in self.plain.experiments])
        floor = np.hypot(apart.std(axis=0), FIDELITY * spread.std(axis=0))
        self.noise = float(np.sqrt(np.mean((apart.std(axis=0) / floor) ** 2)))
        return tuple(1.0 / np.maximum(floor, 1e-12) for _ in clean)

    @cached_property
    def rig(self) -> Rig:
        return self.plain.rig

    @cached_property
    def zero(self) -> list[np.ndarray]:
        """What a replay of the torques misses by its own steps."""
        return errors_of(self.plain)

    @cached_property
    def base(self) -> Problem:
        """The healthy model on its own recordings."""
        return problem_of(self.plain, (), {})

    @cached_property
    def absorbed(self) -> np.ndarray:
        """(K, P) orthonormal: what estimated parameters and starts can absorb."""
        slopes = self.base.slopes(self.base.vector)
        S = np.concatenate([s.reshape(-1, s.shape[-1]) for s in slopes])
        S = S / np.maximum(np.linalg.norm(S, axis=0), 1e-300)
        U, s, _ = np.linalg.svd(S, full_matrices=False)
        return np.asarray(U[:, s > 1e-10 * s[0]])

    def of(self, machine: Model) -> float:
        """Floors, rms: what the healthy model misses of a machine."""
        return self.seen(self.bench.sketched(machine))

    def seen(self, recordings: Sequence[Recording]) -> float:
        """The same of any recordings without noise."""
        if not all(np.all(np.isfinite(x)) for r in recordings for x in r.channels.values()):
            return np.inf  # a machine that came apart
        errors = errors_of(replace(self.data(recordings), weights=self.plain.weights))
        if not all(np.all(np.isfinite(e)) for e in errors):
            return np.inf
        d = np.concatenate([(e - z).ravel() for e, z in zip(errors, self.zero, strict=True)])
        Q = self.absorbed
        return float(np.sqrt(np.mean((d - Q @ (Q.T @ d)) ** 2)))


def errors_of(data: FitData) -> list[np.ndarray]:
    """(M, k) per recording: what the healthy model misses, times the weights."""
    h = problem_of(data, (), {})
    return h.errors(h.vector)


def candidates(sight: Sight) -> dict[str, Effect]:
    """What the bench can show."""
    return {
        kind: one
        for kind, one in catalogue().items()
        if kind not in NEVER and not one.not_applicable(sight.rig)
    }


def hide(
    sight: Sight,
    count: int,
    rng: np.random.Generator,
    only: Sequence[str] = (),
    prefix: str = "",
) -> Truth:
    """`count` effects that can be told, at random sizes; `only`: from among these, and of each one
    parameter alone, whose name begins with `prefix`.

    Raises:
        UnreachableError: no such set was found in ATTEMPTS draws.
    """
    able = [k for k in candidates(sight) if not only or k in only]
    kinds: list[str] = []
    why = "too few effects apply"
    for attempt in range(ATTEMPTS if len(able) >= count else 0):
        others = [k for k in able if not any(k == a or nesting(k, a) for a in kinds)]
        kinds += [str(k) for k in rng.permutation(others)[: count - len(kinds)]]
        if len(kinds) < count or any(nesting(a, b) for a in kinds for b in kinds):
            kinds = []
            continue
        bad, why, truth = _tried(sight, kinds, rng, bool(only), prefix)
        if truth is not None:
            return truth
        kinds.remove(bad)  # the others may stay, for a while
        kinds = [] if attempt % AFRESH == AFRESH - 1 else kinds
    raise UnreachableError(f"no set of {count} that can be told; last: {why}")


def _tried(
    sight: Sight, kinds: Sequence[str], rng: np.random.Generator, single: bool, prefix: str
) -> tuple[str, str, Truth | None]:
    """The truth with these effects; else the effect that cannot be in it, and why."""
    values: dict[str, float] = {}
    shown: dict[str, float] = {}
    for kind in kinds:
        try:
            own, shown[kind] = _sized(sight, kind, rng, single, prefix)
        except UnreachableError as error:
            return kind, str(error), None
        values |= own
    machine = _machine(sight, [effect(k) for k in kinds], values)
    truth = Truth(tuple(kinds), values, shown, machine)
    bad, why = imitated(sight, truth)
    return bad, why, None if bad else truth


def _sized(
    sight: Sight, kind: str, rng: np.random.Generator, single: bool, prefix: str
) -> tuple[dict[str, float], float]:
    """The effect alone at a size that shows as much as is drawn for it, and what it shows."""
    one = effect(kind)
    aim = float(np.exp(rng.uniform(*np.log(WEAK if rng.random() < 0.5 else STRONG))))
    towards = _direction(one, sight, rng, single, prefix)
    if not towards:
        found = sight.of(sight.healthy.with_effects([one], {}, sight.sizes))
        if not WEAK[0] <= found <= STRONG[1]:
            raise UnreachableError(f"{kind} shows {found:.2g} floors and has no size")
        return {}, found
    m, found = crossing(lambda m: sight.of(_machine(sight, [one], _at(towards, m))), aim)
    values = _at(towards, m)
    if not _plausible(towards, values):
        raise UnreachableError(f"{kind} shows only at a size beyond what is plausible")
    return values, found


def _machine(sight: Sight, effects: Sequence[Effect], values: Mapping[str, float]) -> Model:
    return sight.healthy.with_effects(effects, values, sight.sizes)


@dataclass(frozen=True)
class _Towards:
    """One parameter of an effect and the share of the common size that it has."""

    knob: EffectParameter
    share: float


def _direction(
    one: Effect, sight: Sight, rng: np.random.Generator, single: bool, prefix: str
) -> tuple[_Towards, ...]:
    """Shares of 0.5 to 1.5 with a sign where it is free; shapes somewhere on their grids.

    Effects about separate things (channels), and stand-ins, have one of them.
    """
    arm = one.changed_arm(sight.healthy.arm, {})
    found = []
    for part in with_included([one]):
        knobs = [
            k
            for k in part.parameters(arm, sight.healthy.drive, sight.sizes)
            if part.shown(k.parameter.name, sight.rig)
        ]
        sizes = [k for k in knobs if not k.secondary]
        chosen = {k.parameter.name for k in sizes}
        if (part.apart or single) and sizes:
            chosen = {str(rng.choice(sorted(n for n in chosen if n.startswith(prefix))))}
        for k in knobs:
            p = k.parameter
            signed = p.lower < k.neutral < p.upper
            sign = rng.choice([-1.0, 1.0]) if signed and not k.secondary else 1.0
            share = float(sign * rng.uniform(0.5, 1.5)) if p.name in chosen or k.secondary else 0.0
            if k.secondary and k.grid:
                share = float(np.exp(rng.uniform(*np.log([min(k.grid), max(k.grid)]))) / p.value)
            found.append(_Towards(k, share))
    return tuple(found)


FAR = 1e3
"""Times the plausible size: from there on the neutral value is no end of a straight line."""


def _at(towards: Sequence[_Towards], m: float) -> dict[str, float]:
    found = {}
    for t in towards:
        p, neutral = t.knob.parameter, t.knob.neutral
        if t.knob.secondary:
            included = p.value == neutral
            found[p.name] = p.value if included else p.value * t.share
        elif abs(neutral) > FAR * abs(p.value):
            found[p.name] = min(p.value * abs(t.share) / m, neutral)
        else:
            found[p.name] = neutral + m * t.share * (p.value - neutral)
    return found


def _plausible(towards: Sequence[_Towards], values: Mapping[str, float]) -> bool:
    """Within what a fit believes possible, where it is not neutral."""
    return all(
        t.knob.parameter.lower <= values[t.knob.parameter.name] <= t.knob.parameter.upper
        or values[t.knob.parameter.name] == t.knob.neutral
        for t in towards
    )


def imitated(sight: Sight, truth: Truth) -> tuple[str, str]:
    """The hidden effect that the data cannot tell from another, and a sentence; empty for none."""
    hidden = [effect(k) for k in truth.kinds]
    recordings = sight.bench.sketched(truth.machine)
    data = replace(sight.data(recordings), weights=sight.plain.weights)
    whole = problem_of(data, hidden, truth.values)
    nothing = [np.zeros_like(e.measured) for e in data.experiments]  # the truth misses nothing
    data = replace(data, anchor=Anchor(whole.residuals, whole.vector, nothing))
    whole = problem_of(data, hidden, truth.values)
    slopes = whole.slopes(whole.vector)
    tested = [
        one
        for kind, one in candidates(sight).items()
        if kind not in {e.kind for e in with_included(hidden)}
        and not any(nesting(kind, k).startswith("contains") for k in truth.kinds)
    ]
    zeros = BaseErrors(whole)
    columns = [
        column
        for one in tested
        for column in simulate_output_changes(data, whole, hidden, trials(whole, one, data), zeros)
    ]
    labels = whole.unknowns.labels
    for one in hidden:
        rest = [e for e in hidden if e is not one]
        lost = problem_of(data, rest, truth.values)
        missing = lost.errors(lost.vector)
        own = _own_names(sight, one, rest)
        kept = [j for j, name in enumerate(labels) if name not in own]
        blocks = [c.blocks for c in columns]
        products = gram_matrix(
            missing, [S[:, :, kept] for S in slopes], blocks, no_whitening
        ).projected()
        lefts, taken = dict[str, float](), dict[str, dict[str, float]]()
        for c in tested:
            best = best_force_shape(c, columns, products)
            taken[c.kind] = _values_of(best, columns)
            lefts[c.kind] = max(products[-1, -1] - best.explained.cost_reduction, 0.0) / data.count
        close = sorted(lefts, key=lefts.__getitem__)[:FITTED]
        parts = [kind for kind in one.includes if kind not in truth.kinds]
        for kind in dict.fromkeys(("", *close, *parts)):
            instead = [effect(kind)] if kind else []
            start = problem_of(data, [*rest, *instead], {**truth.values, **taken.get(kind, {})})
            fitted = fit(start, None, lambda: False, ITERATIONS).cost / data.count
            left = min(lefts.get(kind, products[-1, -1] / data.count), fitted)
            if left + sight.noise**2 < ABOVE**2:
                stand_in = kind or "nothing"
                return (
                    one.kind,
                    f"{stand_in} imitates {one.kind} but for {np.sqrt(left):.2g} floors",
                )
    return "", ""


def _values_of(best: ShapedChanges, columns: Sequence[OutputChange]) -> dict[str, float]:
    """Where a fit of a stand-in begins: what its columns come to."""
    found: dict[str, float] = {}
    for i, coefficient in zip(best.chosen, best.explained.coefficients, strict=True):
        c = columns[i]
        for name, size in c.sizes.items():
            share = 1.0 if c.scanned else float(coefficient)
            found |= {name: c.values[name] - (1.0 - share) * size} if name else {}
    return found


def _own_names(sight: Sight, one: Effect, rest: Sequence[Effect]) -> set[str]:
    """The parameters that go with an effect when it is taken out."""
    arm = one.changed_arm(sight.healthy.arm, {})
    drive = sight.healthy.drive
    mine = {
        k.parameter.name
        for e in with_included([one])
        for k in e.parameters(arm, drive, sight.sizes)
    }
    stays = {
        k.parameter.name for e in with_included(rest) for k in e.parameters(arm, drive, sight.sizes)
    }
    return mine - stays
