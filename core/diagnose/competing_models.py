"""What else could explain what an effect explains, and why it was not named."""

from __future__ import annotations

from dataclasses import dataclass

from core.diagnose.nested import contains, is_nested, named
from core.diagnose.phrases import evidence, percent, worth_listing
from core.results import DiagnosisRound, LadderStep, RankedEffect
from core.sentences import listed

CLOSE_SECOND = 0.9
"""Share of the best effect's explained error from which on another effect deserves a reason."""

NO_MORE = 0.5
"""Per cent of the error: by less an effect that contains another explains no more than it."""


@dataclass(frozen=True)
class Finding:
    """One effect that was named."""

    ranked: RankedEffect
    found_in: DiagnosisRound
    before: LadderStep
    after: LadderStep | None
    """None where nothing was to be added."""


def what_else(f: Finding) -> str:
    """What else could explain it, and which experiment would decide."""
    parts = (_larger(f), _smaller(f), _competing(f) if f.ranked.confused_with else _next_best(f))
    return " ".join(p for p in parts if p)


def _refitted(f: Finding) -> list[tuple[float, RankedEffect]]:
    """The other effects of which it is known what they explain."""
    return [
        (r.refit_drop_percent, r)
        for r in worth_listing(f.found_in.ranking)
        if r.effect != f.ranked.effect and r.refit_drop_percent is not None
    ]


def _larger(f: Finding) -> str:
    """Effects that are this one and more."""
    own, title = f.ranked.refit_drop_percent or 0.0, f.ranked.title
    larger = [(share, r) for share, r in _refitted(f) if contains(r.effect, f.ranked.effect)]
    same = [r.title for share, r in larger if share < own + NO_MORE]
    more = [f"{r.title} ({percent(share)})" for share, r in larger if share >= own + NO_MORE]
    texts = []
    if same:
        them = "its" if len(same) == 1 else "their"
        verbs = named(same, ("contains", "contain"))
        texts.append(
            f"{verbs} {title} and {('explains', 'explain')[len(same) > 1]} no more: {them} "
            f"additional parameters are not needed."
        )
    if more:
        verbs = named(more, ("contains", "contain"))
        texts.append(f"{verbs} {title}; the gain does not justify the additional parameters.")
    return " ".join(texts)


def _smaller(f: Finding) -> str:
    """Effects that are a part of this one."""
    parts = [
        f"{r.title} ({percent(share)})"
        for share, r in _refitted(f)
        if contains(f.ranked.effect, r.effect)
    ]
    if not parts:
        return ""
    weaker = ("by itself it is the weaker explanation", "by themselves they are weaker")
    verbs = named(parts, ("is", "are"))
    return f"{verbs} part of {f.ranked.title}; {weaker[len(parts) > 1]}."


def _competing(f: Finding) -> str:
    titles = {r.effect: r.title for r in f.found_in.ranking}
    titled = listed([titles.get(kind, kind) for kind in f.ranked.confused_with], "or")
    text = (
        f"These recordings cannot distinguish {f.ranked.title} from {titled}: refitted, each "
        "explains the same within the noise."
    )
    return f"{text} {f.found_in.sentence}".strip()


def _next_best(f: Finding) -> str:
    """The most that a different effect explains; no higher figure of the list goes unsaid."""
    different = [(s, r) for s, r in _refitted(f) if not is_nested(r.effect, f.ranked.effect)]
    if not different:
        return ""
    share, second = max(different, key=lambda one: one[0])
    which = "different" if len(different) < len(_refitted(f)) else "best"
    text = f"The next {which} explanation, {second.title}, reaches {percent(share)}"
    return f"{text}{_against(share, second, f.ranked)}. {_promised(f, share)}".strip()


def _against(share: float, second: RankedEffect, best: RankedEffect) -> str:
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
    if not higher:
        return ""
    return f"The estimate before refitting is higher for {listed(higher)}."
