"""Sentences about ranked effects: their order, how they are related, why others were not named."""

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
from flexgui.sentences.figures import chance, evidence, percent, times
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
    "Order: effects added or named as missing; then by the share after refitting; then by the "
    "estimate. Effects that cannot be distinguished from the model's own parameters come last."
)


def in_order(ranking: Sequence[RankedEffect], named: str | None = None) -> tuple[RankedEffect, ...]:
    """Effects as a list shows them, in the ORDER that is stated beside it."""
    return tuple(
        sorted(
            ranking,
            key=lambda effect: (
                effect.effect != named,
                bool(effect.tied_to),
                effect.refit_drop_percent is None,
                -explained_share(effect),
            ),
        )
    )


def explained_share(ranked: RankedEffect) -> float:
    """Per cent that an effect explains: by its refit, else by the estimate before it."""
    refitted = ranked.refit_drop_percent
    return ranked.expected_drop_percent if refitted is None else refitted


def worth_listing(ranking: Sequence[RankedEffect]) -> list[RankedEffect]:
    """Without effects that explain nothing, and without those whose size is zero after the refit:
    there other parameters that were refitted with them explain the error."""
    return [r for r in ranking if explained_share(r) >= LEAST_SHARE and not _vanished(r.parameters)]


def _vanished(sizes: Sequence[Estimate]) -> bool:
    return bool(sizes) and all(
        e.value == 0.0 or (e.at_bound and abs(e.value) <= NEUTRAL * (e.upper - e.lower))
        for e in sizes
    )


def tie(ranked: RankedEffect) -> str:
    """'cannot be distinguished from m1, which would change from 95 kg to 190.0 ± 0.2 kg'; empty
    where it can."""
    moved = [
        f"{e.name}, which would change from {quantity(e.start, e.unit, 4)} to {estimate_text(e)}"
        for e in ranked.tied_to
    ]
    return f"cannot be distinguished from {listed(moved)}" if moved else ""


def _contains(kind: str, other: str) -> bool:
    """Whether the effect `kind` has the effect `other` in it."""
    effect = catalogue().get(kind)
    return effect is not None and other in effect.includes


def nesting(kind: str, best: str) -> str:
    """How `kind` is related to `best`: 'contains Coulomb friction', 'part of Stribeck friction';
    empty where the two are different explanations."""
    effects = catalogue()
    if _contains(kind, best):
        return f"contains {effects[best].title}"
    return f"part of {effects[best].title}" if _contains(best, kind) else ""


def round_sentence(searched: DiagnosisRound) -> str:
    """The experiment that would distinguish the best two; else why effects were not added, and
    which could not be simulated."""
    if searched.experiments:
        return experiment_sentence(searched.experiments[0])
    names = ", ".join(searched.diverged)
    diverged = f"Could not be simulated at any size: {names}." if names else ""
    refused = [f"{title} was not added: {objection_words(why)}." for title, why in searched.refused]
    return " ".join(s for s in (*refused, diverged) if s)


def objection_words(why: Objection) -> str:
    """Why an effect that explains enough was not added, as the end of a sentence."""
    was, now = why.unseen
    return {
        Reason.AT_BOUND: f"{why.parameter} ended at {format_number(why.bound, 3)} {why.unit}, the "
        "bound of its plausible range",
        Reason.UNSEEN: "it worsens the validation error from "
        f"{format_number(was, 2, keep_zeros=True)} to {times(now)} the noise floor, so it "
        "probably imitates another effect",
        Reason.UNSETTLED: "with finer simulation steps it worsens the fit",
        Reason.INDISTINCT: "its size cannot be distinguished from zero",
        Reason.WITHIN_LAWS: "it explains only a part of what the idealised laws in the model may "
        "miss",
        Reason.SMALL_SHARE: f"it is certain ({chance(why.p_value)} by noise alone, ΔBIC "
        f"{evidence(why.delta_bic)}), but explains only {percent(100.0 * why.share)} of the error "
        "above the noise floor",
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
        """(per cent explained, effect) of the other refitted effects of its round."""
        shares = refitted(self.found_in.ranking)
        return [(share, r) for share, r in shares if r.effect != self.ranked.effect]


def refitted(ranking: Sequence[RankedEffect]) -> list[tuple[float, RankedEffect]]:
    """(per cent explained, effect) of the refitted effects."""
    shares = [(r.refit_drop_percent, r) for r in worth_listing(ranking)]
    return [(share, r) for share, r in shares if share is not None]


def what_else(f: Finding) -> str:
    """Other explanations, why they were not named, and which experiment would distinguish them."""
    parts = (
        _larger(f),
        _smaller(f),
        _indistinguishable(f) if f.ranked.confused_with else _next_best(f),
    )
    return " ".join(p for p in parts if p)


def _with_verb(titles: list[str], singular: str, plural: str) -> str:
    """'A contains', 'A and B contain': the titles with the verb in the right number."""
    return f"{listed(titles)} {singular if len(titles) == 1 else plural}"


def _larger(f: Finding) -> str:
    """Effects that contain this one."""
    own, title = f.ranked.refit_drop_percent or 0.0, f.ranked.title
    larger = [(share, r) for share, r in f.others if _contains(r.effect, f.ranked.effect)]
    same = [r.title for share, r in larger if share < own + NO_MORE]
    more = [f"{r.title} ({percent(share)})" for share, r in larger if share >= own + NO_MORE]
    texts = []
    if same:
        reason = ("explains no more: its", "explain no more: their")[len(same) > 1]
        verb = _with_verb(same, "contains", "contain")
        texts.append(f"{verb} {title} and {reason} additional parameters are not needed.")
    if more:
        verbs = _with_verb(more, "contains", "contain")
        texts.append(f"{verbs} {title}; the gain does not justify the additional parameters.")
    return " ".join(texts)


def _smaller(f: Finding) -> str:
    """Effects that are a part of this one."""
    smaller = [(share, r) for share, r in f.others if _contains(f.ranked.effect, r.effect)]
    parts = [f"{r.title} ({percent(share)})" for share, r in smaller]
    if not parts:
        return ""
    weaker = ("alone it explains less", "alone they explain less")
    return f"{_with_verb(parts, 'is', 'are')} part of {f.ranked.title}; {weaker[len(parts) > 1]}."


def _indistinguishable(f: Finding) -> str:
    titles = {r.effect: r.title for r in f.found_in.ranking}
    titled = listed([titles.get(kind, kind) for kind in f.ranked.confused_with], "or")
    text = (
        f"These recordings cannot distinguish {f.ranked.title} from {titled}: after refitting, "
        "each explains the same within the noise."
    )
    return f"{text} {round_sentence(f.found_in)}".strip()


def _next_best(f: Finding) -> str:
    """The different effect that explains most, and all with a higher estimate."""
    different = [(s, r) for s, r in f.others if not nesting(r.effect, f.ranked.effect)]
    if not different:
        return ""
    share, second = max(different, key=lambda pair: pair[0])
    which = "different" if len(different) < len(f.others) else "best"
    text = f"The next {which} explanation, {second.title}, reaches {percent(share)}"
    return f"{text}{_reason_against(share, second, f.ranked)}. {_not_refitted(f, share)}".strip()


def _reason_against(share: float, second: RankedEffect, best: RankedEffect) -> str:
    """Why a second effect that explains nearly as much was not named."""
    own = best.refit_drop_percent or 0.0
    if share < CLOSE_SECOND * own or second.delta_bic is None or best.delta_bic is None:
        return ""
    behind = best.delta_bic - second.delta_bic
    if behind > 0.0:
        return f", but the evidence for it is weaker by ΔBIC {evidence(behind)}"
    if second.unseen_rms > best.unseen_rms:
        return f", but leaves {times(second.unseen_rms)} the noise floor on validation recordings"
    more = len(second.parameters) > len(best.parameters)
    return ", but needs more parameters: the simpler one is preferred" if more else ""


def _not_refitted(f: Finding, share: float) -> str:
    """Effects that were not refitted and whose estimate is higher than `share`."""
    higher = [
        f"{r.title} (≈ {percent(r.expected_drop_percent)})"
        for r in f.found_in.ranking
        if r.refit_drop_percent is None
        and r.effect != f.ranked.effect
        and r.expected_drop_percent > share
    ]
    return f"The estimate before refitting is higher for {listed(higher)}." if higher else ""
