"""One round of diagnosis after the other: screen, refit, accept, polish, try to remove."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.diagnose.data import Data, again
from core.diagnose.descent import MOST_ITERATIONS, cost_of
from core.diagnose.evidence import Weighed, acceptable, degenerate, ranked, weigh
from core.diagnose.refit import EXACT, Refit, fit, refit_with, settled, whitened
from core.diagnose.reshape import reshaped
from core.diagnose.screen import Screen, Screened, screen
from core.effects import catalogue
from core.effects.effect import Effect, Rig

REFITTED = 5
"""Candidates of a round that are refitted fully: the best by score and by expected fall."""

WORTH = 1e-3
"""Expected fall per sample, in floors squared, below which no refit is worth its time."""


@dataclass(frozen=True)
class Round:
    """What one round found."""

    screen: Screen
    weighed: tuple[Weighed, ...]
    """Best first."""
    accepted: Weighed | None
    before: Refit
    after: Refit


Told = Callable[[str], bool]
"""Called with what was just done; True stops."""


def applicable(data: Data, present: Sequence[Effect], only: Sequence[str] = ()) -> list[Effect]:
    """Candidates for this rig that are not in the model yet."""
    have = {e.kind for e in present if not e.repeats}
    rig = replace(data.rig, level=data.bare.with_effects(present).level)
    known = catalogue()
    return [
        known[kind]
        for kind in sorted(known)
        if (kind in only or not only) and kind not in have and not _against(known[kind], rig, data)
    ]


def not_applicable(data: Data, only: Sequence[str] = ()) -> dict[str, str]:
    """effect -> why this rig cannot show it, or why it is not offered."""
    tried = {k: e for k, e in sorted(catalogue().items()) if not only or k in only}
    reasons = {kind: _against(one, data.rig, data) for kind, one in tried.items()}
    return {kind: reason for kind, reason in reasons.items() if reason}


def _against(one: Effect, rig: Rig, data: Data) -> str:
    """Why an effect is not offered; empty where it is."""
    arm = one.changed_arm(rig.arm, {})
    own = {k.parameter.name for k in one.knobs(arm, rig.drive, data.sizes)}
    free = own & {u.parameter.name for u in data.nuisance}
    estimated = f"{', '.join(sorted(free))} is already estimated." if free else ""
    return one.not_applicable(rig) or estimated


def one_round(
    data: Data,
    before: Refit,
    present: Sequence[Effect],
    candidates: Sequence[Effect],
    told: Told,
    on_screen: Callable[[Screen], None] | None = None,
    on_refit: Callable[[Round], None] = lambda _: None,
    add: bool = True,
) -> Round:
    """Ranks the candidates and polishes the model with the best, where it is acceptable.

    `on_screen` gets the screen while it goes on, and at its end. Without `add` it only looks:
    `after` is `before`.
    """
    seen = screen(data, before.hypothesis, present, candidates, told, on_screen)
    if on_screen is not None:
        on_screen(seen)
    white, _ = whitened(before.hypothesis, before.descended, seen.whitener)
    before = replace(before, white_cost=white)
    stopped = lambda: told("")  # noqa: E731
    found: list[Weighed] = []
    for s in promising(seen, data.count):
        if stopped():
            break
        refit = refit_with(
            data,
            before.hypothesis,
            [*present, s.effect],
            s.values,
            seen.whitener,
            seen.slopes,
            s.scanned,
            stopped,
        )
        if not np.isfinite(refit.cost):
            continue  # no simulation of it held together
        found.append(weigh(s, before, refit, data.count, len(candidates)))
        told(f"{s.effect.title} refitted")
        on_refit(Round(seen, tuple(ranked(found)), None, before, before))
    found = ranked(found)
    best = found[0] if found and acceptable(found[0]) and not stopped() else None
    if best is None or not add:
        return Round(seen, tuple(found), best, before, before)
    after = _shaped_and_polished(data, best, seen, stopped)
    if degenerate(best, after):
        simple = _simpler(data, before, present, best, after, seen, len(candidates), stopped)
        if simple is not None:
            found = [simple, *[w for w in found if w.screened.effect is not simple.screened.effect]]
            best, after = simple, polished(data, simple.refit, seen, stopped)
    return Round(seen, tuple(found), best, before, after)


def _shaped_and_polished(
    data: Data, best: Weighed, seen: Screen, stopped: Callable[[], bool]
) -> Refit:
    """Polished, and again where another shape of the effect turns out to leave less."""
    once = polished(data, best.refit, seen, stopped)
    other = reshaped(data, once, best.screened.effect, stopped)
    return once if other is once else polished(data, other, seen, stopped)


def _simpler(  # type: ignore[no-untyped-def]
    data: Data, before: Refit, present: Sequence[Effect], best: Weighed, after: Refit,
    seen: Screen, tried: int, stopped,
) -> Weighed | None:  # fmt: skip
    """What a degenerate winner includes, fitted from where the winner ended."""
    kinds = [k for k in best.screened.effect.includes if k not in {e.kind for e in present}]
    for s in seen.candidates:
        if s.effect.kind in kinds:
            refit = refit_with(
                data, before.hypothesis, [*present, s.effect],
                {**s.values, **after.hypothesis.values()}, seen.whitener, seen.slopes, (), stopped,
            )  # fmt: skip
            weighed = weigh(s, before, refit, data.count, tried)
            return weighed if np.isfinite(refit.cost) and acceptable(weighed) else None
    return None


def promising(seen: Screen, count: int) -> list[Screened]:
    """Half of the best by whitened score, the rest by expected fall."""
    by_score = sorted(seen.candidates, key=lambda s: -s.score)
    by_drop = sorted(seen.candidates, key=lambda s: -s.drop)
    chosen: dict[str, Screened] = {}
    for pair in zip(by_score, by_drop, strict=True):
        for s in pair:
            if len(chosen) < REFITTED and s.drop > WORTH * count:
                chosen.setdefault(s.effect.kind, s)
    return list(chosen.values())


FINER = (4, 8, 16)
"""Times as many steps per sample: until that lowers the error no more."""

SAME = 0.05
"""In floors, rms: by less than this finer steps change nothing."""


def polished(data: Data, refit: Refit, seen: Screen, stopped: Callable[[], bool]) -> Refit:
    """To convergence, with as many steps per sample as the fitted model needs."""
    h = refit.hypothesis
    finer, errors = EXACT, list(refit.errors)
    for more in FINER:
        tried = again(data, h, finer=more)
        new = tried.errors(tried.vector)
        moved = cost_of([a - b for a, b in zip(new, errors, strict=True)])
        if moved < SAME**2 * data.count:
            break
        finer, errors = more, new
    return settled(fit(again(data, h, finer=finer), seen.whitener, stopped, MOST_ITERATIONS))
