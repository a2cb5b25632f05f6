"""The verdict as a student reads it: what was found, how sure, how big, what else, what remains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from core.diagnose.phrases import (
    by_channel,
    evidence,
    explained,
    how_big,
    how_sure,
    on_validation,
    percent,
    times,
    vibration,
)
from core.diagnose.verdict import MISSING, NOTHING, UNLISTED, Remains
from core.effects import catalogue
from core.results import DiagnosisRound, Estimate, LadderStep, RankedEffect
from core.sentences import first_sentence, listed

FLOOR = "the floor, which is what the noise and the stated fidelity account for"

CLOSE_SECOND = 0.9
"""Share of the best effect's explained error from which on a rival deserves a reason."""


@dataclass(frozen=True)
class Told:
    """All that a verdict in words needs."""

    verdict: str
    final: str | None
    rounds: Sequence[DiagnosisRound]
    steps: Sequence[LadderStep]
    given: Remains
    """Of the model as given."""
    left: Remains
    """After the last step."""
    not_applicable: Mapping[str, str] = field(default_factory=dict)
    kept: Sequence[str] = ()
    """Ids of the effects that were added and are in the model at the end."""
    limit: int = 0
    """How many effects were to be added at most."""
    titles: Mapping[str, str] = field(default_factory=dict)
    """Parameter -> what it is."""
    sizes: Mapping[str, Sequence[Estimate]] = field(default_factory=dict)
    """Effect -> its parameters at the end."""
    stopped: bool = False
    """Whether the user stopped the search before it was through."""


@dataclass(frozen=True)
class _Finding:
    """One effect that was named."""

    ranked: RankedEffect
    found_in: DiagnosisRound
    before: LadderStep
    after: LadderStep | None
    """None where nothing was to be added."""


def say(told: Told) -> tuple[str, ...]:
    """One paragraph each."""
    opening = {MISSING: _missing, NOTHING: _nothing, UNLISTED: _unlisted}[told.verdict]
    if told.stopped and not _findings(told) and told.verdict != NOTHING:
        opening = _unfinished
    paragraphs = [*opening(told)]
    if told.stopped:
        paragraphs.append(
            "The search was stopped before it was through: other effects may explain more than "
            "what stands here."
        )
    return tuple(p for p in paragraphs if p)


def _findings(told: Told) -> list[_Finding]:
    """The effects that are in the model at the end; the best of the ranking where none was to be
    added."""
    if not told.limit:
        first = told.rounds[0]
        return [_Finding(first.ranking[0], first, told.steps[0], None)] if first.ranking else []
    accepted = [one for one in told.rounds if one.accepted is not None]
    added = [(a, b) for a, b in pairwise(told.steps) if b.added is not None]
    found = []
    for one, (before, after) in zip(accepted, added, strict=True):
        kind = _at_the_end(one.accepted or "", told.kept)
        ranked = next((r for r in one.ranking if r.effect == kind), None)
        if ranked is not None:
            found.append(_Finding(ranked, one, before, after))
    return found


def _at_the_end(kind: str, kept: Sequence[str]) -> str:
    """What an added effect is in the end: itself, or a simpler one that took its place."""
    one = catalogue().get(kind)
    simpler = [] if one is None or kind in kept else [k for k in one.includes if k in kept]
    return kind if kind in kept else next(iter(simpler), "")


def _missing(told: Told) -> list[str]:
    findings = _findings(told)
    if not findings:
        return _unlisted(told)
    names = listed([f.ranked.title for f in findings])
    how_many = "an effect" if len(findings) == 1 else f"{len(findings)} effects"
    opening = (
        f"The model lacks {how_many}: {names}. As given, its error is {times(told.given.rms)} "
        f"{FLOOR}."
    )
    paragraphs = [opening]
    for f in findings:
        paragraphs += [_found(f, told), _else(f)]
    return [*paragraphs, _removed(told), _remains(told)]


def _found(f: _Finding, told: Told) -> str:
    """What it is, how big, what it explains, how sure."""
    effect = catalogue().get(f.ranked.effect)
    gist = first_sentence(effect.story) if effect is not None else ""
    big = how_big(told.sizes.get(f.ranked.effect, f.ranked.parameters), dict(told.titles))
    explains = explained(f.ranked, f.before, f.after)
    parts = (f"{f.ranked.title}. {gist}", big, explains, how_sure(f.ranked))
    return " ".join(p for p in parts if p)


def _else(f: _Finding) -> str:
    """What else could explain it, and which experiment would decide."""
    titles = {r.effect: r.title for r in f.found_in.ranking}
    if f.ranked.confused_with:
        rivals = listed([titles.get(kind, kind) for kind in f.ranked.confused_with], "or")
        text = (
            f"These recordings cannot tell {f.ranked.title} from {rivals}: refitted, each "
            f"explains the same within the noise."
        )
        return f"{text} {f.found_in.sentence}".strip()
    second = _second(f)
    if second is None:
        return ""
    share, own = second.refit_drop_percent or 0.0, f.ranked.refit_drop_percent or 0.0
    text = f"The next best explanation, {second.title}, reaches {percent(share)}"
    if share < CLOSE_SECOND * own or second.delta_bic is None or f.ranked.delta_bic is None:
        return f"{text}."
    behind = f.ranked.delta_bic - second.delta_bic
    if behind <= 0.0:
        return f"{text}, with more parameters for the same: the simpler one is preferred."
    return f"{text}, but the evidence for it is weaker by ΔBIC {evidence(behind)}."


def _second(f: _Finding) -> RankedEffect | None:
    """The best refitted rival that does not contain the effect itself."""
    known = catalogue()
    for r in f.found_in.ranking:
        one = known.get(r.effect)
        contains = one is not None and f.ranked.effect in one.includes
        if r.effect != f.ranked.effect and r.refit_drop_percent is not None and not contains:
            return r
    return None


def _removed(told: Told) -> str:
    titles = {r.effect: r.title for one in told.rounds for r in one.ranking}
    added = [s.added for s in told.steps if s.added is not None]
    gone = [titles.get(kind, kind) for kind in dict.fromkeys(added) if kind not in told.kept]
    if not gone:
        return ""
    them = "it" if len(gone) == 1 else "them"
    return (
        f"{listed(gone)} seemed to be missing at first, but with what was added later the error "
        f"is as small without {them}."
    )


def _remains(told: Told) -> str:
    """What is left after the last step, and what to make of it."""
    last = told.steps[-1]
    text = f"What remains: {by_channel(told.left, last)}."
    endings = {
        None: "",
        NOTHING: "That is the floor: these recordings hold nothing more that could be explained.",
        UNLISTED: _unexplained(told),
        MISSING: _more(told),
    }
    parts = (text, on_validation(last.errors), endings[told.final])
    return " ".join(p for p in parts if p)


def _more(told: Told) -> str:
    """What the search would have added after its last step."""
    ranking = told.rounds[-1].ranking if told.rounds else ()
    if not ranking or ranking[0].refit_drop_percent is None:
        return ""
    share = percent(ranking[0].refit_drop_percent)
    return (
        f"More can be explained: {ranking[0].title} would take {share} of what is left above the "
        f"floor. The search ended at its limit of {told.limit}; a higher one lets it go on."
    )


def _unexplained(told: Told) -> str:
    """A rest above the floor."""
    rest = times(told.left.rms)
    return (
        f"An error of {rest} the floor is left that no effect of the list explains: something "
        f"else is missing too. {vibration(told.left)}"
    ).strip()


def _nothing(told: Told) -> list[str]:
    count = len(told.rounds[0].ranking) if told.rounds else 0
    text = (
        f"Nothing is missing that these recordings could show. The error of the model is "
        f"{times(told.given.rms)} {FLOOR}."
    )
    tried = f" {count} effects were tried, and none explains enough of it to count."
    hidden = "An effect that these motions hardly call for can still be there."
    return [f"{text}{tried if count else ''} {hidden}", _not_tried(told), _remains(told)]


def _unlisted(told: Told) -> list[str]:
    ranking = told.rounds[0].ranking if told.rounds else ()
    opening = (
        f"Something is missing that is not in the list of effects. The error of the model is "
        f"{times(told.given.rms)} {FLOOR}. None of the {len(ranking)} effects that were tried "
        f"brings it down enough."
    )
    refitted = [(r.refit_drop_percent, r.title) for r in ranking if r.refit_drop_percent]
    if refitted:
        share, title = max(refitted)
        closest = f"The closest, {title}, explains {percent(share)} of the error above the floor."
        opening = f"{opening} {closest}"
    rest = (
        f"What remains: {by_channel(told.left, told.steps[-1])}. The maps of the error tell when "
        f"and where it happens; an effect of your own can be written as a formula."
    )
    return [opening, vibration(told.left), _not_tried(told), rest]


def _unfinished(told: Told) -> list[str]:
    """A stopped search that named nothing proves nothing about the list."""
    return [
        f"Something is missing: the error of the model is {times(told.given.rms)} {FLOOR}. What "
        f"it is was not found yet."
    ]


def _not_tried(told: Told) -> str:
    """What these recordings cannot show."""
    known = catalogue()
    titles = [known[kind].title for kind in told.not_applicable if kind in known]
    return f"Not tried, since these recordings cannot show it: {listed(titles)}." if titles else ""
