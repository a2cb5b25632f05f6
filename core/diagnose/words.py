"""The verdict as a student reads it: what was found, how sure, how big, what else, what remains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from core.diagnose.competing_models import Finding, what_else
from core.diagnose.phrases import (
    COMPLETE,
    FLOOR_IS,
    at_bounds,
    by_channel,
    explained,
    how_big,
    how_sure,
    misses,
    on_validation,
    percent,
    times,
    unseen_rms,
    vibration,
    worth_listing,
)
from core.diagnose.verdict import ABOVE_IN_ONE, MISSING, NOTHING, UNLISTED, Remains
from core.effects import catalogue
from core.results import ChannelError, DiagnosisRound, Estimate, LadderStep, RankedEffect
from core.sentences import first_sentence, listed
from core.written import format_number

FLOOR = f"the noise floor. {FLOOR_IS}"


@dataclass(frozen=True)
class VerdictFacts:
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
    passed: Sequence[str] = ()
    """Titles of the effects that were added on the way and are not needed at the end."""
    coarse: bool = False
    """Whether what is left is no more than what the model's bending shapes cannot follow."""
    stopped: bool = False
    """Whether the user stopped the search before it was through."""


def verdict_paragraphs(facts: VerdictFacts) -> tuple[str, ...]:
    """One paragraph each."""
    opening = {MISSING: _missing, NOTHING: _nothing, UNLISTED: _unlisted}[facts.verdict]
    if facts.stopped and not _findings(facts) and facts.verdict != NOTHING:
        opening = _unfinished
    paragraphs = [*opening(facts)]
    if facts.stopped:
        paragraphs.append(
            "The search was stopped before it was complete: other effects may explain more than "
            "those listed here."
        )
    return tuple(p for p in paragraphs if p)


def _findings(facts: VerdictFacts) -> list[Finding]:
    """The effects that are in the model at the end; the best of the ranking where none was to be
    added."""
    if not facts.limit:
        return _named_first(facts)
    accepted = [one for one in facts.rounds if one.accepted is not None]
    added = [(a, b) for a, b in pairwise(facts.steps) if b.added is not None]
    found = []
    for one, (before, after) in zip(accepted, added, strict=True):
        kind = _at_the_end(one.accepted or "", facts.kept)
        ranked = next((r for r in one.ranking if r.effect == kind), None)
        if ranked is not None:
            found.append(Finding(ranked, one, before, after))
    return found


def _named_first(facts: VerdictFacts) -> list[Finding]:
    """The best of a ranking that went through; of one that was stopped none is the best yet."""
    first = facts.rounds[0] if facts.rounds and not facts.stopped else None
    if first is None or not first.ranking:
        return []
    return [Finding(first.ranking[0], first, facts.steps[0], None)]


def _at_the_end(kind: str, kept: Sequence[str]) -> str:
    """What an added effect is in the end: itself, or a simpler one that took its place."""
    one = catalogue().get(kind)
    simpler = [] if one is None or kind in kept else [k for k in one.includes if k in kept]
    return kind if kind in kept else next(iter(simpler), "")


def _missing(facts: VerdictFacts) -> list[str]:
    findings = _findings(facts)
    if not findings:
        return _unlisted(facts)
    first, *more = [f.ranked.title for f in findings]
    after = f", then {listed(more)}" if more else ""
    # Without a ladder the model may be one that has grown already.
    which = "As given, the" if facts.limit else "The"
    opening = (
        f"The first missing effect is {first}{after}. {which} model's error is "
        f"{times(facts.given.rms)} {FLOOR}"
    )
    paragraphs = [opening]
    for f in findings:
        paragraphs += [_found(f, facts), what_else(f)]
    sized = any(facts.sizes.get(f.ranked.effect, f.ranked.parameters) for f in findings)
    complete = COMPLETE if sized else ""
    ending = (_removed(facts), _remains(facts), " ".join(p for p in (_stuck(facts), complete) if p))
    return [*paragraphs, *ending]


def _stuck(facts: VerdictFacts) -> str:
    """Nominal parameters at a bound; of sizes it is said where they stand."""
    own = {e.name for sizes in facts.sizes.values() for e in sizes}
    last = facts.steps[-1].parameters if facts.steps else ()
    return at_bounds([e for e in last if e.name not in own], facts.titles)


def _refused(facts: VerdictFacts) -> str:
    """Why the last round added nothing though something explained a part."""
    last = facts.rounds[-1] if facts.rounds else None
    if last is None or last.accepted is not None or last.experiments or not last.sentence:
        return ""
    return f"{last.sentence[0].upper()}{last.sentence[1:]}"


def _found(f: Finding, facts: VerdictFacts) -> str:
    """What it is, how big, what it explains, how sure."""
    effect = catalogue().get(f.ranked.effect)
    gist = first_sentence(effect.story) if effect is not None else ""
    big = how_big(facts.sizes.get(f.ranked.effect, f.ranked.parameters), dict(facts.titles))
    explains = explained(f.ranked, f.before, f.after)
    parts = (f"{f.ranked.title}. {gist}", big, explains, how_sure(f.ranked))
    return " ".join(p for p in parts if p)


def _removed(facts: VerdictFacts) -> str:
    if not facts.passed:
        return ""
    them = "it" if len(facts.passed) == 1 else "them"
    return (
        f"{listed(facts.passed)} seemed to be missing at first, but with what was added later the "
        f"error is as small without {them}."
    )


def _remains(facts: VerdictFacts) -> str:
    """What is left after the last step, and what to make of it."""
    last = facts.steps[-1]
    endings = {
        None: "",
        NOTHING: COARSE if facts.coarse else _at_the_floor(facts.left, last.errors),
        UNLISTED: _unexplained(facts),
        MISSING: _more(facts),
    }
    parts = (_left(facts), on_validation(last.errors), endings[facts.final], _refused(facts))
    return " ".join(p for p in parts if p)


COARSE = (
    "What is left above the noise floor is no more than what this many bending shapes per segment "
    "cannot follow, as far as the last of them tells: these recordings hold nothing more that this "
    "model could explain."
)


IDEALISED = (
    "That is more than the noise, and little beside what the effects in the model explain: their "
    "laws, such as that of dry friction, are idealised and may miss as much."
)


def _at_the_floor(left: Remains, errors: Sequence[ChannelError]) -> str:
    """The end where nothing is left of what was fitted; unseen recordings may hold more."""
    unseen = unseen_rms(errors)
    if left.above_exact_laws:
        return IDEALISED
    if left.above_known_floors:
        factor = format_number(max(left.within.values()), 2)
        return (
            f"The noise was estimated, which is good to a factor of {factor}: what remains may be "
            f"all noise. State the sensors' noise for a sharper verdict."
        )
    if unseen is None or unseen < ABOVE_IN_ONE:
        return "That is the noise floor: these recordings hold nothing more to explain."
    return (
        "The recordings that were fitted hold nothing more to explain, but the unseen ones do: "
        "either they are noisier, or they move in a way that the fitted ones hardly show, where "
        "parameters that are a little off, or an effect, count for more. Fit some of them too, "
        "and diagnose again."
    )


def _left(facts: VerdictFacts) -> str:
    """By channel; before anything was added it is no rest but the error itself."""
    last = facts.steps[-1]
    if any(step.added for step in facts.steps):
        return f"What remains: {by_channel(facts.left, last)}."
    without = "Without it the" if facts.verdict == MISSING and _findings(facts) else "The"
    return f"{without} model {misses(facts.left, last)}."


def _more(facts: VerdictFacts) -> str:
    """What the search would have added after its last step."""
    ranking = facts.rounds[-1].ranking if facts.rounds else ()
    if not ranking or ranking[0].refit_drop_percent is None:
        return ""
    share = percent(ranking[0].refit_drop_percent)
    return (
        f"More can be explained: {ranking[0].title} would take {share} of what remains above the "
        f"noise floor. The search ended at its limit of {facts.limit}; a higher limit continues it."
    )


def _unexplained(facts: VerdictFacts) -> str:
    """A rest above the floor."""
    rest = times(facts.left.rms)
    return (
        f"An error of {rest} the noise floor remains that no listed effect explains: something "
        f"else is missing too. {vibration(facts.left)}"
    ).strip()


def _nothing(facts: VerdictFacts) -> list[str]:
    count = len(facts.rounds[0].ranking) if facts.rounds else 0
    text = (
        f"Nothing is missing that these recordings could show. The error of the model is "
        f"{times(facts.given.rms)} {FLOOR}"
    )
    tried = f" {count} effects were tried, and none explains enough of the error to count."
    hidden = "Effects that these motions barely excite may remain undetected."
    first = f"{text}{tried if count else ''} {hidden}"
    return [first, _not_tried(facts), _remains(facts), _stuck(facts)]


def _unlisted(facts: VerdictFacts) -> list[str]:
    ranking = facts.rounds[0].ranking if facts.rounds else ()
    opening = (
        f"Something is missing that is not in the list of effects. The error of the model is "
        f"{times(facts.given.rms)} {FLOOR} None of the {len(ranking)} effects that were tried "
        f"reduces the error enough."
    )
    refitted = _refitted(ranking)
    if refitted:
        share, title = max(refitted)
        closest = (
            f"The closest, {title}, explains {percent(share)} of the error above the noise floor."
        )
        opening = " ".join(part for part in (opening, closest, _refused(facts)) if part)
    rest = (
        f"{_left(facts)} The error maps show when and where it happens; you can write an "
        f"effect of your own as a formula."
    )
    return [opening, vibration(facts.left), _not_tried(facts), rest, _stuck(facts)]


def _refitted(ranking: Sequence[RankedEffect]) -> list[tuple[float, str]]:
    """(per cent explained, title) of those of which it is known."""
    listed_ones = worth_listing(ranking)
    return [
        (r.refit_drop_percent, r.title) for r in listed_ones if r.refit_drop_percent is not None
    ]


def _unfinished(facts: VerdictFacts) -> list[str]:
    """A stopped search that named nothing proves nothing about the list."""
    ranking = facts.rounds[-1].ranking if facts.rounds else ()
    refitted = _refitted(ranking)
    best = ""
    if refitted:
        share, title = max(refitted)
        best = (
            f" So far {title} explains most, {percent(share)} of the error above the noise floor."
        )
    return [
        f"Something is missing: the error of the model is {times(facts.given.rms)} {FLOOR} The "
        f"cause was not found yet.{best}"
    ]


def _not_tried(facts: VerdictFacts) -> str:
    """What these recordings cannot show."""
    known = catalogue()
    titles = [known[kind].title for kind in facts.not_applicable if kind in known]
    return f"Not tried, since these recordings cannot show it: {listed(titles)}." if titles else ""
