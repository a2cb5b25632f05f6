"""One round of diagnosis: candidates screened, the promising refitted, one or a set accepted.

The refits are a race: after a few steps each, what cannot come close to the best any more stops
(successive halving). It keeps the figures that it has: where it stopped it was told from the best
by more than its next step could bring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.acceptance import (
    WHOLE,
    Acceptance,
    Gate,
    Round,
)
from ..diagnose.effect_sets import FoundSet
from ..diagnose.evidence import (
    CLOSE,
    Weighed,
    acceptable,
    merit,
    ranked,
    weigh,
)
from ..diagnose.fit_problem import Data, Hypothesis, sharing_motions
from ..diagnose.linear_screen import Screen, Screened, screen
from ..diagnose.output_changes import nearer_to_neutral
from ..diagnose.refit import (
    LOOK,
    ROUGH_ITERATIONS,
    Known,
    Refit,
    ahead,
    columns_of,
    exactly,
    fit,
    whitened,
)
from ..diagnose.remaining_error import within_noise
from ..diagnose.whitening import Whitener
from ..effects import catalogue
from ..effects.effect import Effect, Rig
from ..identify import predictor
from ..least_squares import promised

REFITTED = 5
"""Candidates of a round that are refitted fully: the best by score and by expected reduction."""

WORTH = 1e-3
"""Expected reduction per sample, in noise floors squared, below which no refit is worth its
time."""


OnProgress = Callable[[str], bool]
"""Called with what was just done; True stops."""


def applicable(data: Data, present: Sequence[Effect], only: Sequence[str] = ()) -> list[Effect]:
    """Candidates for this rig that are not in the model yet."""
    have = {e.kind for e in present if not e.repeats}
    rig = replace(data.rig, level=data.bare.with_effects(present).level)
    return [
        one
        for kind, one in _asked(only).items()
        if kind not in have and not _against(one, rig, data)
    ]


def not_applicable(data: Data, only: Sequence[str] = ()) -> dict[str, str]:
    """effect -> why this rig cannot show it, or why it is not offered."""
    reasons = {kind: _against(one, data.rig, data) for kind, one in _asked(only).items()}
    return {kind: reason for kind, reason in reasons.items() if reason}


def ruled_out(data: Data, only: Sequence[str] = ()) -> dict[str, str]:
    """Titles of effects, or of some of their sizes, that are not sought -> what is stated of the
    rig."""
    each = [one.ruled_out(data.rig, data.sizes) for one in _asked(only).values()]
    return {title: words for found in each for title, words in found.items()}


def _asked(only: Sequence[str]) -> dict[str, Effect]:
    return {kind: one for kind, one in sorted(catalogue().items()) if not only or kind in only}


def _against(one: Effect, rig: Rig, data: Data) -> str:
    """Why an effect is not offered; empty where it is."""
    arm = one.changed_arm(rig.arm, {})
    own = {k.parameter.name for k in one.parameters(arm, rig.drive, data.sizes)}
    free = own & {u.parameter.name for u in data.nuisance}
    estimated = f"{', '.join(sorted(free))} is already estimated." if free else ""
    statement = one.ruled_out(rig, data.sizes).get(one.title, "")
    stated = f"Stated: {statement}." if statement else ""
    return stated or one.not_applicable(rig) or estimated


def one_round(
    data: Data,
    before: Refit,
    present: Sequence[Effect],
    candidates: Sequence[Effect],
    on_progress: OnProgress,
    on_screen: Callable[[Screen], None] | None = None,
    on_refit: Callable[[Round], None] = lambda _: None,
    most: int = 1,
    gate: Gate = lambda _data, _refit: None,
) -> Round:
    """Ranks the candidates and polishes the model with the best, where it is acceptable.

    `on_screen` gets the screen while it goes on, and at its end. `most`: how many effects may be
    added; with none it only looks: `after` is `before`. What `gate` refuses is not added.
    """
    data = sharing_motions(data, before.hypothesis)
    seen = screen(data, before.hypothesis, present, candidates, on_progress, on_screen)
    if on_screen is not None:
        on_screen(seen)
    white, _ = whitened(before.hypothesis, before.descended, seen.whitener)
    before = replace(before, white_cost=white)
    found: list[Weighed] = []
    # Within the noise nothing can be missing, whatever is explained below the floor.
    chosen = [] if within_noise(data, before.errors) else promising(seen, data.count)
    for one in _refitted(data, before, present, seen, chosen, len(candidates), on_progress):
        found.append(one)
        on_progress(f"{one.screened.effect.title} refitted")
        on_refit(Round(seen, tuple(ranked(found)), None, before, before, data))
    found = ranked(found)
    still = Round(seen, tuple(found), None, before, before, data)
    if on_progress(""):
        return still
    fitted = {w.screened.effect.kind for w in found}
    unfitted = tuple(s.effect.title for s in chosen if s.effect.kind not in fitted)
    if found:
        still = _accepted(still, present, len(candidates), on_progress, most, gate)
    return replace(still, unfitted=unfitted)


def _accepted(
    still: Round,
    present: Sequence[Effect],
    tried: int,
    on_progress: OnProgress,
    most: int,
    gate: Gate,
) -> Round:
    """The round with what may be added of what it weighed."""
    seen, before, data, found = still.screen, still.before, still.data, list(still.weighed)
    work = Acceptance(data, before, present, seen, tried, lambda: on_progress(""), gate)
    finer = finer_model(found, data)
    if finer is not None:
        alone = work.alone([finer], FoundSet((), 0.0), most)
        if alone.accepted is not None:
            others = [w for w in found if w is not finer]
            return replace(alone, weighed=(*alone.weighed, *others))
    left = (found[0].refit.cost - data.count) / max(before.cost - data.count, 1.0)
    joint, together = work.sets(found, most, tried=most > 1 and left > 1.0 - WHOLE)
    return joint or work.alone(found, together, most)


def finer_model(found: Sequence[Weighed], data: Data) -> Weighed | None:
    """A finer model of the same arm, where that explains a real part of the error and no physical
    effect explains all of it; None where the model is fine enough.

    Too few bending shapes leave an error that soft joints, play and damping imitate well: on a
    continuous arm that is modelled by one shape, an elastic joint leaves less than a second shape
    does, and only the third leaves nothing. What turns out needless is taken out at the end.
    """
    whole = [w for w in found if within_noise(data, w.refit.errors)]
    if any(not w.screened.effect.resolution for w in whole):
        return None
    return next((w for w in found if w.screened.effect.resolution and acceptable(w)), None)


def _refitted(
    data: Data,
    before: Refit,
    present: Sequence[Effect],
    seen: Screen,
    chosen: Sequence[Screened],
    tried: int,
    on_progress: OnProgress,
) -> Iterator[Weighed]:
    """The chosen candidates, refitted on all cores, as they end, of which a simulation held."""
    stopped = lambda: on_progress("")  # noqa: E731

    def look(s: Screened) -> Runner:
        effects, base = [*present, s.effect], before.hypothesis
        begun = started(data, base, effects, s.values, seen.slopes, s.scanned, stopped)
        if not np.isfinite(begun.refit.cost):
            values = nearer_to_neutral(s.effect, base.model.arm, data, s.values)
            begun = started(data, base, effects, values, seen.slopes, s.scanned, stopped)
        return begun

    with ThreadPoolExecutor(predictor.WORKERS) as pool:
        runners = list(pool.map(look, chosen))
        going = in_the_race(runners, before, data.count)
        waiting = {
            pool.submit(ended, data, runner, on, seen.whitener, stopped): s
            for s, runner, on in zip(chosen, runners, going, strict=True)
        }
        for done in as_completed(waiting):
            refit = done.result()
            if np.isfinite(refit.cost):
                yield weigh(waiting[done], before, refit, data.count, tried)


def promising(seen: Screen, count: int) -> list[Screened]:
    """Half of the best by whitened score, the rest by the reduction within their reach; and a finer
    model of the same arm, which straight lines hardly show once a stiffness imitates it."""
    within = [s for s in seen.candidates if s.reach > WORTH * count]
    by_score = sorted(within, key=lambda s: -s.score)
    by_drop = sorted(within, key=lambda s: -s.reach)
    chosen: dict[str, Screened] = {}
    for pair in zip(by_score, by_drop, strict=True):
        for s in pair:
            if len(chosen) < REFITTED:
                chosen.setdefault(s.effect.kind, s)
    finer = {s.effect.kind: s for s in seen.candidates if s.effect.resolution}
    return list((chosen | finer).values())


OPTIMISM = 2.0
"""Times the reduction that straight lines promise next: a descent whose steps halve what is left
ends there, and what converges more slowly does not compete with what is ahead by CLOSE in merit."""


@dataclass(frozen=True)
class Runner:
    """A refit under way."""

    refit: Refit
    left: int
    """Iterations that it may still take."""
    known: Known

    @property
    def bound(self) -> float:
        """The least cost that may still be hoped for."""
        found, h = self.refit.descended, self.refit.hypothesis
        if not np.isfinite(found.cost):
            return np.inf
        return found.cost - OPTIMISM * promised(found, h.limits)


def started(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    slopes: Sequence[np.ndarray],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> Runner:
    """The first steps of `core.diagnose.refit.refit_with`."""
    known = columns_of(base, slopes)
    start, spent = ahead(data, base, effects, values, slopes, scanned, stopped)
    left = ROUGH_ITERATIONS - spent
    return Runner(fit(start, None, stopped, LOOK, known), left - LOOK, known)


def ended(
    data: Data, runner: Runner, goes_on: bool, whitener: Whitener, stopped: Callable[[], bool]
) -> Refit:
    """Its refit, with the steps that it has left where it `goes_on` and is not at its end: what
    wins is what it would be without a race."""
    found = runner.refit
    if goes_on and not found.descended.ended:
        at, damping = found.hypothesis, found.descended.damping
        found = fit(at, None, stopped, runner.left, runner.known, damping)
    return exactly(data, found, whitener)


def in_the_race(runners: Sequence[Runner], base: Refit, count: int) -> list[bool]:
    """Whether each may still come within CLOSE of the best, by merit over `count` samples."""
    own = [len(r.refit.hypothesis.unknowns) - len(base.hypothesis.unknowns) for r in runners]

    def merit_at(cost: float, parameters: int) -> float:
        return merit(base.cost, cost, count, parameters)

    best = min((merit_at(r.refit.cost, n) for r, n in zip(runners, own, strict=True)), default=0.0)
    return [merit_at(r.bound, n) <= best + CLOSE for r, n in zip(runners, own, strict=True)]
