"""Proposed laws in sentences: what the rest depends on, each law, and why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexgui.core.results import Carrier, Event, Objection, Proposal, ProposedLaw
from flexgui.core.results.proposal import NO_CARRIER, NO_LAW, WITHIN_NOISE
from flexgui.core.sentences import listed
from flexgui.sentences.experiments import experiment_sentence
from flexgui.sentences.figures import percent, times
from flexgui.sentences.ranked import objection_words
from flexgui.sentences.written import format_number, size_text

REASONS = {
    WITHIN_NOISE: "The error is within the noise: nothing is left for a law to explain.",
    NO_LAW: "No law is proposed: each that was tried in the model failed a test.",
}

STOPPED = "The search for a law was stopped before it was complete."

ALIKE = 0.5
"""Cosine from which a listed effect is called a relative of a law."""


def proposal_paragraphs(proposal: Proposal | None) -> tuple[str, ...]:
    """One paragraph each; none where no law was looked for."""
    if proposal is None:
        return ()
    if proposal.events:
        return (events_sentence(proposal.events), WITHOUT_EVENTS)
    if proposal.stopped and proposal.reason:
        return (STOPPED,)
    if proposal.reason:
        if proposal.reason == NO_CARRIER:
            return (no_carrier_sentence(proposal),)
        refused = [refusal_sentence(title, why) for title, why in proposal.refused[:1]]
        carriers = carrier_sentence(proposal) if proposal.reason == NO_LAW else ""
        return tuple(p for p in (carriers, REASONS[proposal.reason], *refused) if p)
    laws = [law_sentence(law) for law in proposal.laws]
    planned = [experiment_sentence(e) for e in proposal.experiments[:1]]
    needless = [needless_sentence(proposal)] if proposal.needless else []
    return (carrier_sentence(proposal), *laws, *needless, *planned)


def needless_sentence(proposal: Proposal) -> str:
    """Which effects the first law takes the place of."""
    them = "it" if len(proposal.needless) == 1 else "them"
    return (
        f"With the {'first ' if len(proposal.laws) > 1 else ''}law the error is as small without "
        f"{listed(proposal.needless)}: the model does not need {them}."
    )


WITHOUT_EVENTS = (
    "Without these stretches nearly all of the error is gone. Leave them out, and diagnose what is "
    "left: state each of these recordings twice, with the window before and after its event."
)


def event_words(event: Event) -> str:
    """'between 1.2 and 1.4 s of r2 a force acts at the tip, about (3, -2) N'."""
    numbers = [format_number(x, 2) for x in event.force]
    size = f"({', '.join(numbers)})" if len(numbers) > 1 else numbers[0]
    what = "force" if event.unit == "N" else "torque"
    start, stop = (f"{t:.2f}" for t in (event.start, event.stop))
    return (
        f"between {start} and {stop} s of {event.recording} a {what} acts at {event.target_title}, "
        f"about {size} {event.unit}"
    )


def event_sentence(event: Event) -> str:
    """The same as a sentence of its own."""
    words = event_words(event)
    return f"{words[0].upper()}{words[1:]}."


def events_sentence(events: Sequence[Event]) -> str:
    """What happened, and where."""
    happened = "; ".join(event_words(e) for e in events)
    return (
        f"No law explains this error: something happened once. {happened[0].upper()}{happened[1:]}."
    )


def proposed_line(proposal: Proposal | None) -> str:
    """The first law, or what happened, in a line; empty without any."""
    if proposal is not None and proposal.events:
        return events_sentence(proposal.events)
    if proposal is None or not proposal.laws:
        return ""
    law = proposal.laws[0]
    return (
        f"Proposed: {law.title}: {law.formula}; error from {times(law.rms[0])} to "
        f"{times(law.rms[1])} the noise floor."
    )


def carrier_words(carrier: Carrier) -> str:
    """'the position of joint 2, times the sign of the speed'."""
    factor = f", {carrier.factor}" if carrier.factor else ""
    return f"the {carrier.title}{factor}"


def carrier_sentence(proposal: Proposal) -> str:
    """What the rest depends on most; empty where it depends on nothing that was tried."""
    carriers = [c for c in proposal.carriers if c.share > 0.0]
    if not carriers:
        return ""
    best = carriers[0]
    text = (
        f"The rest depends most on {carrier_words(best)}: a smooth function of it, acting at "
        f"{best.target_title}, explains {percent(100.0 * best.share)} of the error above the noise "
        f"on parts of the recordings that it was not fitted to"
    )
    others = carriers[1:]
    if not others:
        return f"{text}."
    if proposal.alike:
        each = [f"{carrier_words(c)} at {c.target_title}" for c in others[: proposal.alike]]
        return (
            f"{text}. These recordings cannot tell it from {listed(each, 'or')}, which explain"
            f"{'s' if len(each) == 1 else ''} as much."
        )
    following = others[0]
    return (
        f"{text}; next, {carrier_words(following)} at {following.target_title}: "
        f"{percent(100.0 * following.share)}."
    )


def no_carrier_sentence(proposal: Proposal) -> str:
    """Why no law is proposed where no variable carries the rest, with the share of the best."""
    opening = "No law is proposed. No position, speed, deflection, torque or time carries the rest"
    best = next((c for c in proposal.carriers if c.share > 0.0), None)
    if best is None:
        return f"{opening}."
    share = percent(100.0 * best.share)
    return f"{opening}; {carrier_words(best)}, at {best.target_title}, comes first with {share}."


def law_sentence(law: ProposedLaw) -> str:
    """The law with its values, what it explains and what it is like."""
    values = listed([size_text(e.name, e) for e in law.parameters])
    text = (
        f"{law.title}: {law.formula}, with {values}. It explains "
        f"{percent(100.0 * law.explained)} of the error above the noise: from "
        f"{times(law.rms[0])} to {times(law.rms[1])} the noise floor"
    )
    if math.isfinite(law.unseen_rms[1]):
        text += (
            f", on recordings that no fit has seen from {times(law.unseen_rms[0])} to "
            f"{times(law.unseen_rms[1])}"
        )
    return f"{text}.{_relative(law)}"


def _relative(law: ProposedLaw) -> str:
    if not law.likeness >= ALIKE:
        return ""
    return (
        f" Of the listed effects, {law.relative} is most like it (cosine "
        f"{format_number(law.likeness, 2)})."
    )


def refusal_sentence(title: str, why: Objection) -> str:
    """Why a law that explains enough is not proposed."""
    return f"{title}: {objection_words(why)}."
