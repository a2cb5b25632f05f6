"""What is said of ranked effects: their order, how they are related, why others were not named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexgui.core.effects import catalogue
from flexgui.core.results import (
    DiagnosisRound,
    Estimate,
    LadderStep,
    Objection,
    RankedEffect,
    Reason,
)
from flexgui.core.sentences import listed
from flexgui.sentences.experiments import experiment_sentence
from flexgui.sentences.figures import evidence, percent, times
from flexgui.sentences.written import estimate_text, format_number, quantity

LEAST_SHARE = 0.05
"""Per cent of the error: less is written as 0.0 and explains nothing."""

NEUTRAL = 1e-6
"""Of the distance between the bounds: a size within it of nothing at all is none."""

CLOSE_SECOND = 0.9
"""Share of the best effect's explained error from which on another effect deserves a reason."""

NO_MORE = 0.5
"""Per cent of the error: by less an effect that contains another explains no more than it."""

ORDER = (
    "Order: what was added or is named as missing, then by what is explained after refitting, then "
    "by the estimate; last what cannot be distinguished from the model's own parameters."
)


def in_order(ranking: Sequence[RankedEffect], named: str | None = None) -> tuple[RankedEffect, ...]:
    """As a reader is shown them, in the ORDER that is stated beside the list."""
    return tuple(
        sorted(
            ranking,
            key=lambda one: (
                one.effect != named,
                bool(one.tied_to),
                one.refit_drop_percent is None,
                -explained_share(one),
            ),
        )
    )


def explained_share(ranked: RankedEffect) -> float:
    """Per cent that an effect explains: by its refit, or what the screen expects."""
    refitted = ranked.refit_drop_percent
    return ranked.expected_drop_percent if refitted is None else refitted


def worth_listing(ranking: Sequence[RankedEffect]) -> list[RankedEffect]:
    """Without those that explain nothing, and without those that vanished when refitted: what
    these seem to explain is something else that moved meanwhile."""
    return [r for r in ranking if explained_share(r) >= LEAST_SHARE and not _vanished(r.parameters)]


def _vanished(sizes: Sequence[Estimate]) -> bool:
    return bool(sizes) and all(
        e.value == 0.0 or (e.at_bound and abs(e.value) <= NEUTRAL * (e.upper - e.lower))
        for e in sizes
    )


def tie(ranked: RankedEffect) -> str:
    """'cannot be distinguished from m1, which would go from 95 kg to 190.0 ± 0.2 kg'; empty where
    it can."""
    moved = [
        f"{e.name}, which would go from {quantity(e.start, e.unit, 4)} to {estimate_text(e)}"
        for e in ranked.tied_to
    ]
    return f"cannot be distinguished from {listed(moved)}" if moved else ""


def _contains(kind: str, other: str) -> bool:
    """Whether the effect `kind` has the effect `other` in it."""
    one = catalogue().get(kind)
    return one is not None and other in one.includes


def nesting(kind: str, best: str) -> str:
    """'contains Coulomb friction', 'part of Stribeck friction', said of `kind`; empty where the
    two are different explanations."""
    known = catalogue()
    if _contains(kind, best):
        return f"contains {known[best].title}"
    return f"part of {known[best].title}" if _contains(best, kind) else ""


def round_sentence(one: DiagnosisRound) -> str:
    """The experiment that would decide; else why effects were not added, and which could not be
    judged at all."""
    if one.experiments:
        return experiment_sentence(one.experiments[0])
    names = ", ".join(one.diverged)
    lost = f"Could not be simulated at any size that was tried: {names}." if names else ""
    refused = [f"{title} was not added: {_against(why)}." for title, why in one.refused]
    return " ".join(s for s in (*refused, lost) if s)


def _against(why: Objection) -> str:
    was, now = (times(rms) for rms in why.unseen)
    return {
        Reason.AT_BOUND: f"{why.parameter} ended at {format_number(why.bound, 3)} {why.unit}, the "
        "bound of what is plausible",
        Reason.UNSEEN: f"recordings that no fit has seen become worse with it, from {was} to {now} "
        "the noise floor, so it probably imitates another effect",
        Reason.UNSETTLED: "simulated with finer steps, the model is worse with it than without it",
        Reason.INDISTINCT: "its size cannot be distinguished from no effect at all",
    }[why.reason]


@dataclass(frozen=True)
class Finding:
    """One effect that was named."""

    ranked: RankedEffect
    found_in: DiagnosisRound
    before: LadderStep
    after: LadderStep | None
    """None where nothing was to be added."""

    @property
    def others(self) -> list[tuple[float, RankedEffect]]:
        """(per cent explained, effect) of those of which it is known."""
        known = refitted(self.found_in.ranking)
        return [(share, r) for share, r in known if r.effect != self.ranked.effect]


def refitted(ranking: Sequence[RankedEffect]) -> list[tuple[float, RankedEffect]]:
    """(per cent explained, effect) of those of which it is known."""
    shares = [(r.refit_drop_percent, r) for r in worth_listing(ranking)]
    return [(share, r) for share, r in shares if share is not None]


def what_else(f: Finding) -> str:
    """What else could explain it and why it was not named, and which experiment would decide."""
    parts = (_larger(f), _smaller(f), _competing(f) if f.ranked.confused_with else _next_best(f))
    return " ".join(p for p in parts if p)


def _named(titles: list[str], one: str, several: str) -> str:
    """'A contains', 'A and B contain': the titles with the verb for one or for several."""
    return f"{listed(titles)} {one if len(titles) == 1 else several}"


def _larger(f: Finding) -> str:
    """Effects that are this one and more."""
    own, title = f.ranked.refit_drop_percent or 0.0, f.ranked.title
    larger = [(share, r) for share, r in f.others if _contains(r.effect, f.ranked.effect)]
    same = [r.title for share, r in larger if share < own + NO_MORE]
    more = [f"{r.title} ({percent(share)})" for share, r in larger if share >= own + NO_MORE]
    texts = []
    if same:
        rest = ("explains no more: its", "explain no more: their")[len(same) > 1]
        texts.append(
            f"{_named(same, 'contains', 'contain')} {title} and {rest} additional parameters are "
            "not needed."
        )
    if more:
        verbs = _named(more, "contains", "contain")
        texts.append(f"{verbs} {title}; the gain does not justify the additional parameters.")
    return " ".join(texts)


def _smaller(f: Finding) -> str:
    """Effects that are a part of this one."""
    known = [(share, r) for share, r in f.others if _contains(f.ranked.effect, r.effect)]
    parts = [f"{r.title} ({percent(share)})" for share, r in known]
    if not parts:
        return ""
    weaker = ("by itself it is the weaker explanation", "by themselves they are weaker")
    return f"{_named(parts, 'is', 'are')} part of {f.ranked.title}; {weaker[len(parts) > 1]}."


def _competing(f: Finding) -> str:
    titles = {r.effect: r.title for r in f.found_in.ranking}
    titled = listed([titles.get(kind, kind) for kind in f.ranked.confused_with], "or")
    text = (
        f"These recordings cannot distinguish {f.ranked.title} from {titled}: refitted, each "
        "explains the same within the noise."
    )
    return f"{text} {round_sentence(f.found_in)}".strip()


def _next_best(f: Finding) -> str:
    """The most that a different effect explains; no higher figure of the list goes unsaid."""
    different = [(s, r) for s, r in f.others if not nesting(r.effect, f.ranked.effect)]
    if not different:
        return ""
    share, second = max(different, key=lambda one: one[0])
    which = "different" if len(different) < len(f.others) else "best"
    text = f"The next {which} explanation, {second.title}, reaches {percent(share)}"
    return f"{text}{_against_second(share, second, f.ranked)}. {_promised(f, share)}".strip()


def _against_second(share: float, second: RankedEffect, best: RankedEffect) -> str:
    """Why a close second is not the first."""
    own = best.refit_drop_percent or 0.0
    if share < CLOSE_SECOND * own or second.delta_bic is None or best.delta_bic is None:
        return ""
    behind = best.delta_bic - second.delta_bic
    if behind <= 0.0:
        return ", with more parameters for the same: the simpler one is preferred"
    return f", but the evidence for it is weaker by ΔBIC {evidence(behind)}"


def _promised(f: Finding, share: float) -> str:
    """Of effects that were not refitted and stand in the list with a higher figure."""
    higher = [
        f"{r.title} (≈ {percent(r.expected_drop_percent)})"
        for r in f.found_in.ranking
        if r.refit_drop_percent is None
        and r.effect != f.ranked.effect
        and r.expected_drop_percent > share
    ]
    return f"The estimate before refitting is higher for {listed(higher)}." if higher else ""
