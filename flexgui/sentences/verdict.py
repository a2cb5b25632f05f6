"""The verdict as a student reads it: what was found, how sure, how big, what else, what remains."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from flexgui.core.effects import catalogue, with_included
from flexgui.core.results import (
    ABOVE_IN_ONE,
    MISSING,
    NOTHING,
    UNLISTED,
    Diagnosis,
    Estimate,
    RankedEffect,
)
from flexgui.core.sentences import first_sentence, listed
from flexgui.sentences.figures import (
    BY_CHANNEL,
    COMPLETE,
    FLOOR_IS,
    MISSES,
    at_bounds,
    by_channel,
    explained,
    how_big,
    how_sure,
    linear_sentence,
    on_validation,
    percent,
    times,
    unseen_rms,
    vibration,
)
from flexgui.sentences.ranked import Finding, refitted, round_sentence, what_else
from flexgui.sentences.written import format_number

FLOOR = f"the noise floor. {FLOOR_IS}"
STOPPED = "The search was stopped before it was complete."


def all_paragraphs(found: Diagnosis) -> tuple[str, ...]:
    """What the linear model costs, where it was the one identified, before the verdict."""
    first = () if found.linear_model is None else (linear_sentence(found.linear_model),)
    return (*first, *verdict_paragraphs(found))


def verdict_paragraphs(found: Diagnosis) -> tuple[str, ...]:
    """One paragraph each."""
    if found.words:
        return found.words
    opening = {MISSING: _missing, NOTHING: _nothing, UNLISTED: _unlisted}[found.verdict]
    if found.stopped and not _findings(found) and found.verdict != NOTHING:
        opening = _unfinished
    paragraphs = [*opening(found), _ruled_out(found)]
    if found.stopped:
        paragraphs.append(
            "The search was stopped before it was complete: other effects may explain more than "
            "those listed here."
        )
    return tuple(p for p in paragraphs if p)


def gist(found: Diagnosis) -> str:
    """What is missing, where something is: for a card whose title says no more."""
    return STOPPED if found.stopped else first_sentence(verdict_paragraphs(found)[0])


def _findings(found: Diagnosis) -> list[Finding]:
    """The effects that are in the model at the end; the best of the ranking where none was to be
    added."""
    if not found.limit:
        # Of a ranking that was stopped none is the best yet.
        unknown = found.stopped or not found.ranking
        best = [] if unknown else [found.ranking[0]]
        return [Finding(ranked, found.rounds[0], found.steps[0], None) for ranked in best]
    accepted = [one for one in found.rounds if one.accepted is not None]
    added = [(a, b) for a, b in pairwise(found.steps) if b.added is not None]
    named = []
    for one, (before, after) in zip(accepted, added, strict=True):
        kind = _at_the_end(one.accepted or "", found.kept)
        ranked = next((r for r in one.ranking if r.effect == kind), None)
        if ranked is not None:
            named.append(Finding(ranked, one, before, after))
    return named


def _at_the_end(kind: str, kept: Sequence[str]) -> str:
    """What an added effect is in the end: itself, or a simpler one that took its place."""
    one = catalogue().get(kind)
    simpler = [] if one is None or kind in kept else [k for k in one.includes if k in kept]
    return kind if kind in kept else next(iter(simpler), "")


def _sizes(found: Diagnosis, ranked: RankedEffect) -> Sequence[Estimate]:
    """Of one effect as they stand at the end, with those of what it includes."""
    if ranked.effect not in found.kept:
        return ranked.parameters
    parts = {one.kind for one in with_included([catalogue()[ranked.effect]])}
    return [e for e in found.steps[-1].parameters if found.origins.get(e.name) in parts]


def _missing(found: Diagnosis) -> list[str]:
    findings = _findings(found)
    if not findings:
        return _unlisted(found)
    first, *more = [f.ranked.title for f in findings]
    after = f", then {listed(more)}" if more else ""
    # Without a ladder the model may be one that has grown already.
    which = "As given, the" if found.limit else "The"
    paragraphs = [
        f"The first missing effect is {first}{after}. {which} model's error is "
        f"{times(found.error_given.rms)} {FLOOR}"
    ]
    for f in findings:
        paragraphs += [_found(f, _sizes(found, f.ranked)), what_else(f)]
    complete = COMPLETE if any(_sizes(found, f.ranked) for f in findings) else ""
    needless = ""
    if found.needless:
        them = "it" if len(found.needless) == 1 else "them"
        needless = (
            f"{listed(found.needless)} seemed to be missing at first, but with what was added "
            f"later the error is as small without {them}."
        )
    ending = " ".join(p for p in (_stuck(found), complete) if p)
    return [*paragraphs, needless, _remains(found), ending]


def _stuck(found: Diagnosis) -> str:
    """Nominal parameters at a bound; of sizes it is said where they stand."""
    known = catalogue()
    own = {one.kind for one in with_included([known[kind] for kind in found.kept])}
    return at_bounds(
        [e for e in found.steps[-1].parameters if found.origins.get(e.name) not in own]
    )


def _refused(found: Diagnosis) -> str:
    """Why the last round added nothing though something explained a part."""
    last = found.rounds[-1] if found.rounds else None
    if last is None or last.accepted is not None or last.experiments:
        return ""
    return round_sentence(last)


def _found(f: Finding, sizes: Sequence[Estimate]) -> str:
    """What it is, how big, what it explains, how sure."""
    gist = first_sentence(catalogue()[f.ranked.effect].story)
    explains = explained(f.ranked, f.before, f.after)
    parts = (f"{f.ranked.title}. {gist}", how_big(sizes), explains, how_sure(f.ranked))
    return " ".join(p for p in parts if p)


def _remains(found: Diagnosis) -> str:
    """What is left after the last step, and what to make of it."""
    endings = {NOTHING: _at_the_floor, UNLISTED: _unexplained, MISSING: _more}
    ending = endings[found.final_verdict](found) if found.final_verdict else ""
    parts = (_left(found), on_validation(found.steps[-1].errors), ending, _refused(found))
    return " ".join(p for p in parts if p)


IDEALISED = (
    "That is more than the noise, and little beside what the effects in the model explain: their "
    "laws, such as that of dry friction, are idealised and may miss as much."
)


def _at_the_floor(found: Diagnosis) -> str:
    """The end where nothing is left of what was fitted; unseen recordings may hold more."""
    left, unseen = found.error_left, unseen_rms(found.steps[-1].errors)
    if left.above_exact_laws:
        return IDEALISED
    if left.above_known_floors:
        factor = format_number(max(left.within.values()), 2)
        return (
            f"The noise was estimated, which is good to a factor of {factor}: what remains may be "
            f"all noise. State the sensors' noise for a sharper verdict."
        )
    if not unseen >= ABOVE_IN_ONE:
        return "That is the noise floor: these recordings hold nothing more to explain."
    return (
        "The recordings that were fitted hold nothing more to explain, but the unseen ones do: "
        "either they are noisier, or they move in a way that the fitted ones hardly show, where "
        "parameters that are a little off, or an effect, count for more. Fit some of them too, "
        "and diagnose again."
    )


def _left(found: Diagnosis) -> str:
    """By channel; before anything was added it is no rest but the error itself."""
    last = found.steps[-1]
    if found.added:
        return f"What remains: {by_channel(found.error_left, last, BY_CHANNEL)}."
    without = "Without it the" if found.verdict == MISSING and _findings(found) else "The"
    return f"{without} model {by_channel(found.error_left, last, MISSES)}."


def _more(found: Diagnosis) -> str:
    """What the search would have added after its last step."""
    ranking = found.rounds[-1].ranking if found.rounds else ()
    if not ranking or ranking[0].refit_drop_percent is None:
        return ""
    share = percent(ranking[0].refit_drop_percent)
    return (
        f"More can be explained: {ranking[0].title} would take {share} of what remains above the "
        f"noise floor. The search ended at its limit of {found.limit}; a higher limit continues it."
    )


def _unexplained(found: Diagnosis) -> str:
    """A rest above the floor."""
    return (
        f"An error of {times(found.error_left.rms)} the noise floor remains that no listed effect "
        f"explains: something else is missing too. {vibration(found.error_left)}"
    ).strip()


def _nothing(found: Diagnosis) -> list[str]:
    count = len(found.ranking)
    tried = f" {count} effects were tried, and none explains enough of the error to count."
    first = (
        f"Nothing is missing that these recordings could show. The error of the model is "
        f"{times(found.error_given.rms)} {FLOOR}{tried if count else ''} Effects that these "
        f"motions barely excite may remain undetected."
    )
    return [first, _not_tried(found), _remains(found), _stuck(found)]


def _unlisted(found: Diagnosis) -> list[str]:
    opening = (
        f"Something is missing that is not in the list of effects. The error of the model is "
        f"{times(found.error_given.rms)} {FLOOR} None of the {len(found.ranking)} effects that "
        f"were tried reduces the error enough."
    )
    if best := _most(found.ranking):
        closest = f"The closest, {best[0]}, explains {best[1]} of the error above the noise floor."
        opening = " ".join(part for part in (opening, closest, _refused(found)) if part)
    rest = (
        f"{_left(found)} The error maps show when and where it happens; you can write an "
        f"effect of your own as a formula."
    )
    return [opening, vibration(found.error_left), _not_tried(found), rest, _stuck(found)]


def _most(ranking: Sequence[RankedEffect]) -> tuple[str, str] | None:
    """(title, share) of what explains most of those of which it is known."""
    known = [(share, r.title) for share, r in refitted(ranking)]
    return (max(known)[1], percent(max(known)[0])) if known else None


def _unfinished(found: Diagnosis) -> list[str]:
    """A stopped search that named nothing proves nothing about the list."""
    best = _most(found.rounds[-1].ranking if found.rounds else ())
    share = "of the error above the noise floor"
    most = f" So far {best[0]} explains most, {best[1]} {share}." if best else ""
    return [
        f"Something is missing: the error of the model is {times(found.error_given.rms)} {FLOOR} "
        f"The cause was not found yet.{most}"
    ]


def _not_tried(found: Diagnosis) -> str:
    """What these recordings cannot show."""
    known = catalogue()
    titles = [known[kind].title for kind in found.not_applicable if kind in known]
    unseen = [title for title in titles if title not in found.ruled_out]
    return f"Not tried, since these recordings cannot show it: {listed(unseen)}." if unseen else ""


def _ruled_out(found: Diagnosis) -> str:
    """What was not sought, by each statement about the rig."""
    by: dict[str, list[str]] = {}
    for title, statement in found.ruled_out.items():
        by.setdefault(statement, []).append(title)
    return " ".join(
        f"Not sought, since it is stated that {statement}: {listed(titles)}."
        for statement, titles in by.items()
    )
