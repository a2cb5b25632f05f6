"""The words above the figures: what was estimated, how well it fits, and which fit is meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from markupsafe import Markup, escape

from flexgui.core.identify.unknowns import START
from flexgui.core.results import Estimate, Fit, Outcome, RecordingComparison
from flexgui.core.results.comparison import DIAGNOSIS_FIT
from flexgui.core.sentences import listed
from flexgui.sentences.figures import times
from flexgui.sentences.identifiability import invariant
from flexgui.sentences.written import channel_symbol, quantity, split_name
from flexgui.views.fit_table import FIT_IS
from flexgui.views.headline import (
    BIASED,
    COMPLETE,
    final_comparisons,
    follows,
    given,
    given_biased,
    given_comparisons,
    grown,
    kept,
    standing,
    verdict_now,
)
from flexgui.views.names import format_percent, is_of_a_start, typeset
from flexgui.views.parameter_tables import equation
from flexgui.views.pooled import ESTIMATE, VALIDATE, channel_errors, tip_rms, with_role

LEVELS = {"lpv": "the LPV descriptor model", "nonlinear": "the non-linear model"}
METHODS = {"glocal": "in one fit over all of them", "local": "in a fit for each"}


def summary(outcome: Outcome) -> tuple[str, ...]:
    """Sentences in reading order, without the alarms; symbols are typeset for HTML."""
    sentences: list[str] = [_what(outcome), _before(outcome)]
    shown, before = final_comparisons(outcome), given_comparisons(outcome)
    for role, words in ((ESTIMATE, "On the estimation recordings"), (VALIDATE, "On validation")):
        text, was = quality(with_role(shown, role)), _tip(with_role(before, role))
        if text:
            given_by = f" (as given by {was})" if was else ""
            sentences.append(f"{words} the model reaches {text}{given_by}.")
    if any("FIT" in each for each in sentences):
        sentences.append(FIT_IS)
    return (*(s for s in sentences if s), *_sure(outcome))


def ending(outcome: Outcome) -> tuple[str, ...]:
    """A result in plain lines: alarms, verdict or basis, parameters, quality, seconds."""
    found = outcome.diagnosis
    estimates = [e for e in standing(outcome) if e.recording is None]
    reached = quality(with_role(final_comparisons(outcome), ESTIMATE))
    lines = (
        *(Markup("Warning: {}").format(text) for text in alarms(outcome)),
        f"{_basis(outcome)}." if found is None else verdict_now(found),
        Markup("{}.").format(_listed(estimates)) if estimates else "",
        f"On the estimation recordings the model reaches {reached}." if reached else "",
        f"It took {sum(outcome.seconds.values()):.1f} s.",
    )
    return plain(line for line in lines if line)


def lead(outcome: Outcome) -> tuple[str, ...]:
    """The sentences of `summary` that no table of a report tells."""
    return f"{_basis(outcome)}.", *_sure(outcome)


NEXT_TO_NOTHING = 10.0
"""% of FIT below which a model explains next to nothing of an output that it was fitted to."""


def alarms(outcome: Outcome) -> tuple[str, ...]:
    """What is to be read before any number: a result that cannot be right, a value at a bound of
    its search, and what the check of the recordings found."""
    return (*_unbelievable(outcome), *outcome.findings)


def plain(sentences: Iterable[str]) -> tuple[str, ...]:
    """Without typesetting, for a terminal or a file."""
    return tuple(s.striptags() if isinstance(s, Markup) else s for s in sentences)


def _unbelievable(outcome: Outcome) -> list[str]:
    fitted = with_role(final_comparisons(outcome), ESTIMATE) if outcome.fits else ()
    found, distance = list[str](), tip_rms(fitted)
    reach = sum(link.length for link in outcome.mechanism.links) if outcome.mechanism else np.inf
    if distance is not None and distance > reach:
        found.append(
            f"The model misses the measured tip by {quantity(distance, 'm')} rms, more than the "
            f"arm is long ({quantity(reach, 'm')}): look at the units and signs of the recordings."
        )
    for e in channel_errors(fitted):
        if e.fitted and e.fit_percent < NEXT_TO_NOTHING:
            found.append(
                f"The model explains next to nothing of {channel_symbol(e.channel, e.unit)} (FIT "
                f"{format_percent(e.fit_percent)} %): look at its unit, its sign and its name."
            )
    stuck = _symbols(e for e in _estimated(outcome) if e.at_bound and e.identifiable)
    if stuck:
        found.append(
            Markup("{} ended at a bound: widen it, or doubt the model.").format(_joined(stuck))
        )
    return found


def _estimated(outcome: Outcome) -> list[Estimate]:
    """What was searched for, of the model as it now stands; starts of recordings left out."""
    if outcome.diagnosis is not None and outcome.diagnosis.parameters:
        derived = follows(outcome)
        return [e for e in standing(outcome) if e.name not in derived and not e.recording]
    return [e for fit in outcome.fits for e in fit.estimates if not is_of_a_start(e)]


def _sure(outcome: Outcome) -> tuple[str, ...]:
    stopped = "The search was stopped early; the numbers are the best until then."
    sentences = (_doubt(outcome), stopped if any(fit.stopped for fit in outcome.fits) else "")
    return tuple(s for s in sentences if s)


def _basis(outcome: Outcome) -> str:
    """From what, how and with which model, without a full stop."""
    names = {name for fit in outcome.fits for name in fit.recordings}
    level = LEVELS.get(outcome.level, outcome.level)
    if not outcome.fits:
        return f"Nothing was estimated: {level} is compared as given"
    count = f"{len(names)} recording{'s' if len(names) != 1 else ''}"
    how = METHODS.get(outcome.method, outcome.method) if len(names) > 1 else "in one fit"
    found = outcome.diagnosis
    if found is not None and grown(outcome):
        return f"From {count}, with the full equations and {kept(found)} in the model"
    return f"From {count}, {how}, with {level}"


def _what(outcome: Outcome) -> str:
    text = _basis(outcome)
    if not outcome.fits:
        return f"{text}."
    sure = [e for e in standing(outcome) if e.recording is None and e.identifiable]
    if not sure:
        return f"{text}, no parameter could be determined by itself."
    several = len(outcome.fits) > 1 and outcome.diagnosis is None
    mean = "on average " if several else ""
    return Markup("{}: {}{}. {}").format(text, mean, _listed(sure), COMPLETE)


def _before(outcome: Outcome) -> Markup | str:
    """The first fit, for comparison, with what it is worth."""
    estimates = [e for e in given(outcome) if e.recording is None and e.identifiable]
    if outcome.diagnosis is None or not (given_biased(outcome) and estimates):
        return ""
    return Markup("The first fit gave {} ({}).").format(_listed(estimates), BIASED)


def _listed(estimates: Sequence[Estimate]) -> Markup:
    return Markup(", ").join(equation(e) for e in estimates)


def quality(comparisons: Sequence[RecordingComparison]) -> str:
    """Mean FIT of what was fitted and rms of the tip; empty where there is neither."""
    errors = [e for e in channel_errors(comparisons) if e.fitted and np.isfinite(e.fit_percent)]
    parts = [
        f"{format_percent(e.fit_percent)} % in {channel_symbol(e.channel, e.unit)}" for e in errors
    ]
    text = f"a mean FIT of {_joined(parts)}" if parts else ""
    if distance := _tip(comparisons):
        tip = f"misses the measured tip by {distance} rms"
        text = f"{text} and {tip}" if text else f"an end point that {tip}"
    return text


def _tip(comparisons: Sequence[RecordingComparison]) -> str:
    """Rms distance between measured and modelled tip; empty where it is not known."""
    distance = tip_rms(comparisons)
    return "" if distance is None or not np.isfinite(distance) else quantity(distance, "m")


def _doubt(outcome: Outcome) -> str:
    if not outcome.fits:
        return ""
    free = _symbols(e for e in _estimated(outcome) if not e.identifiable)
    if not free:
        return "" if _unbelievable(outcome) else "All parameters are identifiable."
    valleys = (fit.identifiability.valley for fit in outcome.fits)
    valley = next((found for found in valleys if found), None)
    separately = " separately" if len(free) > 1 else ""
    only = f", only {invariant(valley)}" if valley else ""
    return Markup("The data do not determine {}{}{}.").format(_joined(free), separately, only)


def _symbols(estimates: Iterable[Estimate]) -> list[Markup]:
    return list(dict.fromkeys(typeset(e.symbol, e.name) for e in estimates))


def _joined(parts: Sequence[str]) -> Markup:
    *first, last = parts
    return Markup("{} and {}").format(Markup(", ").join(first), last) if first else escape(last)


MUCH = 3.0
"""Times the error of the fitted recordings: less is no news."""


def validation_words(estimation: float, validation: float) -> str:
    """One sentence, '' where there is nothing to say. Both errors in floors, rms."""
    if not validation > MUCH * max(estimation, 1.0):
        return ""
    return (
        f"On the validation recording the error is {times(validation)} the noise floor, "
        f"{times(estimation)} on those that the model was fitted to: its motion and "
        "postures differ, and there a fit cannot compensate for what the model lacks."
    )


DOUBTFUL = 2.0
"""Times the noise floor: above it most of the error is not noise, so that what rests on the model's
completeness (the verdict, the floor, ± values) says so in red."""


def doubt(error: float) -> str:
    """Of a model whose error is so many times the noise floor; empty where it is near it."""
    if not error > DOUBTFUL:
        return ""
    return (
        "Verdict, noise floor and ± values hold only if the model is complete; its error is "
        f"{times(error)} the noise floor."
    )


HELD = "takes the initial state of each recording from the first encoder sample"
FREE = ", and it also fits the initial state of each recording"
OWN = "the diagnosis' own fit: it compares {}, each in multiples of its noise floor{}"


def of_diagnosis(comparisons: Sequence[RecordingComparison]) -> bool:
    """Whether they show the fit that a diagnosis looks at."""
    return any(c.fit_label == DIAGNOSIS_FIT for c in comparisons)


def which_fit(comparisons: Sequence[RecordingComparison], fits: Sequence[Fit]) -> str:
    """For the place where the errors are shown; `fits` of the identification."""
    seen = {k.channel: k.unit for c in comparisons for k in c.channels if k.fitted}
    outputs = listed([channel_symbol(name, unit) for name, unit in seen.items()])
    starts = starts_freed(list(seen), fits)
    if not of_diagnosis(comparisons):
        return (
            f"Of the identification's fit: it compares {outputs}{f' and {HELD}' * starts}. After "
            f"Find what is missing the diagnosis' own fit is shown here, whose errors are a little "
            f"different."
        )
    return (
        f"Of {OWN.format(outputs, FREE if starts else '')}. Therefore these errors differ from "
        f"those of the identification{f', which {HELD}' if starts else ''}."
    )


def distinguishable(outcome: Outcome) -> Markup:
    """For a report with a diagnosis: which figures are of which fit; empty without a diagnosis."""
    found = outcome.diagnosis
    if found is None or not outcome.fits:
        return Markup("")
    compared = found.steps[0].errors
    outputs = listed([channel_symbol(e.channel, e.unit) for e in compared])
    starts = starts_freed([e.channel for e in compared], outcome.fits)
    own = OWN.format(outputs, FREE if starts else "")
    held = f" and {HELD}" if starts else ""
    first = f"the identification, which compares the selected outputs{held}"
    if not found.parameters:
        text = f"The estimates above are of {first}. The missing effects follow from {own}."
    else:
        text = f"The estimates above are of {own}. The first fit is that of {first}."
    if of_diagnosis(final_comparisons(outcome)):
        text += " The FIT and the tip's error above are of the diagnosis' fit too."
    elif found.parameters:
        text += " The FIT and the tip's error above are of the first fit."
    return Markup("{}").format(text)


def starts_freed(channels: Sequence[str], fits: Sequence[Fit]) -> bool:
    """Whether the diagnosis fits how a recording begins and the identification does not: neither
    does where a servo follows the encoders, both do where it was asked for."""
    servo = any(split_name(name)[0] in ("u", "torque") for name in channels)
    asked = any(e.name.startswith(START) for fit in fits for e in fit.estimates)
    return not servo and not asked
