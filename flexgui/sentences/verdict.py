"""The verdict in sentences: what was found, how sure, how large, what else, what remains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from flexgui.core.effects import catalogue, with_included
from flexgui.core.results import (
    ABOVE_IN_ONE,
    MISSING,
    NOTHING,
    UNJUDGED,
    UNLISTED,
    Diagnosis,
    Estimate,
    RankedEffect,
    Reason,
)
from flexgui.core.sentences import first_sentence, listed
from flexgui.sentences.figures import (
    COMPLETE,
    FLOOR_IS,
    at_bounds,
    doubts_sentence,
    error_by_channel,
    explained,
    linear_sentence,
    percent,
    significance,
    sizes_sentence,
    times,
    validation_rms,
    validation_sentence,
    vibration,
)
from flexgui.sentences.proposal import proposal_paragraphs
from flexgui.sentences.ranked import Finding, refitted, round_sentence, what_else
from flexgui.sentences.written import format_number

STOPPED = "The search was stopped before it was complete."
NONE_FOUND = "No missing effect was found."
OPEN = "It cannot be judged whether something is missing."


def all_paragraphs(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What the linear model costs, where it was the one identified, before the verdict."""
    first = () if diagnosis.linear_model is None else (linear_sentence(diagnosis.linear_model),)
    return (*first, *verdict_paragraphs(diagnosis))


def verdict_paragraphs(diagnosis: Diagnosis) -> tuple[str, ...]:
    """One paragraph each."""
    if diagnosis.words:
        return diagnosis.words
    openings = {MISSING: _missing, NOTHING: _nothing, UNLISTED: _unlisted, UNJUDGED: _unjudged}
    opening = openings[diagnosis.verdict]
    if diagnosis.unfinished:
        opening = _unfinished
    paragraphs = [*opening(diagnosis), _ruled_out(diagnosis), _further_shapes(diagnosis)]
    if diagnosis.stopped and opening is not _unfinished:
        paragraphs.append(f"{STOPPED} Other effects may explain more than those listed here.")
    return (*(p for p in paragraphs if p), *proposal_paragraphs(diagnosis.proposal))


def _further_shapes(diagnosis: Diagnosis) -> str:
    """Advice to state as many bending shapes as the recordings show."""
    if not diagnosis.shapes:
        return ""
    each = listed([str(n) for n in diagnosis.shapes])
    return (
        f"The recordings show more bending shapes than the scenario states, so the model of this "
        f"diagnosis has {each} (one number per segment). State them with modes in [arm]."
    )


def is_explained(diagnosis: Diagnosis) -> bool:
    """Whether nothing is missing and the error is at its noise floor, on validation too."""
    above = validation_rms(diagnosis.steps[-1].errors) >= ABOVE_IN_ONE
    left, nothing = diagnosis.error_left, diagnosis.standing_verdict == NOTHING
    return nothing and not (above or left.above_floors or math.isfinite(left.over_noise))


def card_words(diagnosis: Diagnosis) -> tuple[str, str, str]:
    """The colour of a card (a class of the page's style), its lead, and one sentence more."""
    if diagnosis.verdict == MISSING:
        gist = STOPPED if diagnosis.stopped else first_sentence(verdict_paragraphs(diagnosis)[0])
        return MISSING, "Something is missing.", gist
    if diagnosis.verdict == UNLISTED:
        return UNLISTED, "The missing effect is not on the list.", ""
    if diagnosis.unfinished:
        return MISSING, "Something is missing.", STOPPED
    if diagnosis.verdict == UNJUDGED:
        return UNLISTED, OPEN, first_sentence(_doubts(diagnosis).partition(": ")[2].capitalize())
    if is_explained(diagnosis):
        return NOTHING, "Nothing is missing.", "At least nothing that these recordings can show."
    return "", NONE_FOUND, first_sentence(_at_the_floor(diagnosis))


def _findings(diagnosis: Diagnosis) -> list[Finding]:
    """The effects that are in the model at the end; the best of the ranking where none was to be
    added."""
    if not diagnosis.limit:
        best = [r for r in diagnosis.ranking if r.effect in diagnosis.proposed[:1]]
        return [Finding(ranked, diagnosis.rounds[0], diagnosis.steps[0], None) for ranked in best]
    accepted = [r for r in diagnosis.rounds if r.accepted is not None]
    added = [(a, b) for a, b in pairwise(diagnosis.steps) if b.added is not None]
    named = []
    for found_in, (before, after) in zip(accepted, added, strict=True):
        kind = _final_kind(found_in.accepted or "", diagnosis.kept)
        ranked = next((r for r in found_in.ranking if r.effect == kind), None)
        if ranked is not None:
            named.append(Finding(ranked, found_in, before, after))
    return named


def _final_kind(kind: str, kept: Sequence[str]) -> str:
    """Id of an added effect at the end: its own, or that of a simpler one that replaced it."""
    effect = catalogue().get(kind)
    simpler = [] if effect is None or kind in kept else [k for k in effect.includes if k in kept]
    return kind if kind in kept else next(iter(simpler), "")


def _sizes(diagnosis: Diagnosis, ranked: RankedEffect) -> Sequence[Estimate]:
    """Final parameters of one effect, with those of the effects that it includes."""
    if ranked.effect not in diagnosis.kept:
        return ranked.parameters
    parts = {e.kind for e in with_included([catalogue()[ranked.effect]])}
    return [e for e in diagnosis.steps[-1].parameters if diagnosis.origins.get(e.name) in parts]


def _missing(diagnosis: Diagnosis) -> list[str]:
    findings = _findings(diagnosis)
    if not findings:
        return _unlisted(diagnosis)
    first, *more = [f.ranked.title for f in findings]
    if not diagnosis.limit:
        more = [catalogue()[kind].title for kind in diagnosis.proposed[1:]]
    after = f", then {listed(more)}" if more else ""
    # Without a ladder the model may already contain added effects.
    which = "model as given" if diagnosis.limit else "model"
    paragraphs = [f"The first missing effect is {first}{after}. {_given_error(diagnosis, which)}"]
    for f in findings:
        paragraphs += [_described(f, _sizes(diagnosis, f.ranked)), what_else(f)]
    complete = COMPLETE if any(_sizes(diagnosis, f.ranked) for f in findings) else ""
    removed = ""
    if diagnosis.needless:
        them = "it" if len(diagnosis.needless) == 1 else "them"
        removed = (
            f"{listed(diagnosis.needless)} seemed to be missing at first. With the later effects "
            f"the error is as small without {them}."
        )
    ending = " ".join(p for p in (_at_bounds(diagnosis), complete) if p)
    return [*paragraphs, removed, _remains(diagnosis), ending]


def _given_error(diagnosis: Diagnosis, which: str = "model") -> str:
    """The error before anything was added, and what a noise floor is."""
    error = times(diagnosis.error_given.rms)
    return f"The error of the {which} is {error} the noise floor. {FLOOR_IS}"


def _at_bounds(diagnosis: Diagnosis) -> str:
    """Nominal parameters at a bound; parameters of effects say it beside their value."""
    effects = catalogue()
    own = {e.kind for e in with_included([effects[kind] for kind in diagnosis.kept])}
    return at_bounds(
        [e for e in diagnosis.steps[-1].parameters if diagnosis.origins.get(e.name) not in own]
    )


def _refused(diagnosis: Diagnosis) -> str:
    """Why the last round added nothing though something explained a part."""
    last = diagnosis.rounds[-1] if diagnosis.rounds else None
    if last is None or last.accepted is not None or last.experiments:
        return ""
    return round_sentence(last)


def _described(f: Finding, sizes: Sequence[Estimate]) -> str:
    """What it is, how large, what it explains, how sure."""
    gist = first_sentence(catalogue()[f.ranked.effect].story)
    explains = explained(f.ranked, f.before, f.after)
    parts = (f"{f.ranked.title}. {gist}", sizes_sentence(sizes), explains, significance(f.ranked))
    return " ".join(p for p in parts if p)


def _remains(diagnosis: Diagnosis) -> str:
    """The error after the last step, and what it means."""
    endings = {
        NOTHING: _at_the_floor, UNLISTED: _unexplained, MISSING: _more, UNJUDGED: _doubts,
    }  # fmt: skip
    ending = endings[diagnosis.final_verdict](diagnosis) if diagnosis.final_verdict else ""
    unseen = validation_sentence(diagnosis.steps[-1].errors)
    parts = (_error_by_channel(diagnosis), unseen, ending, _refused(diagnosis))
    return " ".join(p for p in parts if p)


IDEALISED = (
    "The error is above the noise, but small compared with what the effects explain. Their laws "
    "are idealised (dry friction, for example) and may cause an error of this size."
)


def _at_the_floor(diagnosis: Diagnosis) -> str:
    """The fitted recordings are explained; the validation recordings may not be."""
    remains, validation = diagnosis.error_left, validation_rms(diagnosis.steps[-1].errors)
    if math.isfinite(remains.over_noise):
        return (
            f"The error is {times(remains.over_noise)} the noise, and within the modelling "
            "tolerance ([diagnose] fidelity). No listed effect explains most of what is above the "
            "noise."
        )
    if remains.above_exact_laws:
        return IDEALISED
    if remains.above_floors:
        factor = format_number(max(remains.within.values()), 2)
        return (
            f"The noise is an estimate, good to a factor of {factor}: the residual may be all "
            f"noise. State {_noise_settings(diagnosis)} for a sharper verdict."
        )
    if not validation >= ABOVE_IN_ONE:
        return "That is the noise floor: these recordings show nothing more to explain."
    return (
        "The fitted recordings are explained; the validation recordings are not. Either these are "
        "noisier, or their motion shows errors that the fitted recordings hardly show: in a "
        "parameter, or by an effect. Fit some of them too, and diagnose again."
    )


def _noise_settings(diagnosis: Diagnosis) -> str:
    """What to state in the scenario so that the noise is known."""
    settings = listed(diagnosis.unstated_noise)
    return f"[sensors] {settings}" if settings else "the sensors' noise"


def _error_by_channel(diagnosis: Diagnosis) -> str:
    """Of the last model, by channel."""
    which = "Error"
    if diagnosis.added:
        which = "Remaining error"
    elif diagnosis.verdict == MISSING and _findings(diagnosis):
        which = f"Error without {'it' if len(diagnosis.proposed) < 2 else 'them'}"
    return f"{which}: {error_by_channel(diagnosis.error_left, diagnosis.steps[-1])}."


def _more(diagnosis: Diagnosis) -> str:
    """The next effect that the search would have added."""
    ranking = diagnosis.rounds[-1].ranking if diagnosis.rounds else ()
    if not ranking or ranking[0].refit_drop_percent is None:
        return ""
    share = percent(ranking[0].refit_drop_percent)
    return (
        f"More can be explained: {ranking[0].title} would explain {share} of the remaining error "
        f"above the noise floor. The search ended at its limit of {diagnosis.limit}; raise it to "
        "continue."
    )


def _unexplained(diagnosis: Diagnosis) -> str:
    """An error above the noise floor that no listed effect explains."""
    refused = diagnosis.rounds[-1].refused if diagnosis.rounds else ()
    part = any(why.reason is Reason.SMALL_SHARE for _, why in refused)
    explains = "explains enough of it" if part else "explains it"
    return (
        f"The remaining error is {times(diagnosis.error_left.rms)} the noise floor, and no listed "
        f"effect {explains}: something else is missing too. {vibration(diagnosis.error_left)}"
    ).strip()


def _nothing(diagnosis: Diagnosis) -> list[str]:
    count = len(diagnosis.ranking)
    tried = f" None of the {count} effects tried explains enough of the error."
    explained = is_explained(diagnosis)
    lead = "Nothing is missing that these recordings could show." if explained else NONE_FOUND
    first = (
        f"{lead} {_given_error(diagnosis)}{tried if count else ''} Effects that these motions "
        "barely excite may remain undetected."
    )
    return [first, _not_tried(diagnosis), _remains(diagnosis), _at_bounds(diagnosis)]


def _doubts(diagnosis: Diagnosis) -> str:
    missing = "more" if diagnosis.added else "something"
    return doubts_sentence(diagnosis.doubts, _noise_settings(diagnosis), missing)


def _unjudged(diagnosis: Diagnosis) -> list[str]:
    """An error within the noise floor that shows nothing."""
    validation = validation_sentence(diagnosis.steps[-1].errors)
    figures = " ".join(s for s in (_error_by_channel(diagnosis), validation, FLOOR_IS) if s)
    return [_doubts(diagnosis), _not_tried(diagnosis), figures, _at_bounds(diagnosis)]


def _unlisted(diagnosis: Diagnosis) -> list[str]:
    lead = f"Something is missing that is not in the list of effects. {_given_error(diagnosis)}"
    proposal = diagnosis.proposal
    laws, imitators = (proposal.laws, proposal.needless) if proposal else ((), ())
    opening = f"{lead} None of the {len(diagnosis.ranking)} effects tried reduces the error enough."
    if laws and imitators:
        explain, them = ("explains", "it") if len(imitators) == 1 else ("explain", "them")
        part = f"{listed(imitators)} {explain} a part of it."
        opening = f"{lead} {part} A law explains more, without {them}."
    elif best := _best(diagnosis.ranking):
        closest = f"The best, {best[0]}, explains {best[1]} of the error above the noise floor."
        opening = " ".join(part for part in (opening, closest, _refused(diagnosis)) if part)
    advice = f"{_error_by_channel(diagnosis)} The error maps show when and where it happens."
    if not (proposal and proposal.events):
        advice += " You can write your own effect as a formula."
    by_law = any(law.rms[1] < ABOVE_IN_ONE for law in laws)
    line = "" if by_law else vibration(diagnosis.error_left)
    return [opening, line, _not_tried(diagnosis), advice, _at_bounds(diagnosis)]


def _best(ranking: Sequence[RankedEffect]) -> tuple[str, str] | None:
    """(title, share) of the refitted effect that explains most."""
    shares = [(share, r.title) for share, r in refitted(ranking)]
    return (max(shares)[1], percent(max(shares)[0])) if shares else None


def _unfinished(diagnosis: Diagnosis) -> list[str]:
    """A stopped search that named no effect says nothing about the listed effects."""
    best = _best(diagnosis.rounds[-1].ranking if diagnosis.rounds else ())
    share = "of the error above the noise floor"
    most = f" So far {best[0]} explains most: {best[1]} {share}." if best else ""
    begin = f"{STOPPED} Something is missing, and its cause is not found yet."
    return [f"{begin} {_given_error(diagnosis)}{most}"]


def _not_tried(diagnosis: Diagnosis) -> str:
    """What these recordings cannot show."""
    effects = catalogue()
    titles = [effects[kind].title for kind in diagnosis.not_applicable if kind in effects]
    titles = [title for title in titles if title not in diagnosis.ruled_out]
    return f"Not tried, as these recordings cannot show it: {listed(titles)}." if titles else ""


def _ruled_out(diagnosis: Diagnosis) -> str:
    """Effects that were not tried, by the statement about the rig that excludes them."""
    by: dict[str, list[str]] = {}
    for title, statement in diagnosis.ruled_out.items():
        by.setdefault(statement, []).append(title)
    return " ".join(
        f"Not tried, as it is stated that {statement}: {listed(titles)}."
        for statement, titles in by.items()
    )
