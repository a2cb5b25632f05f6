"""Sentences above the figures: what was estimated, how well it fits, and which fit is shown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from markupsafe import Markup, escape

from flexgui.core.identify.first_states import START
from flexgui.core.results import Estimate, Fit, Outcome, RecordingComparison
from flexgui.core.results.comparison import DIAGNOSIS_FIT
from flexgui.core.sentences import listed
from flexgui.sentences.figures import criteria_text
from flexgui.sentences.identifiability import invariant
from flexgui.sentences.proposal import proposed_line
from flexgui.sentences.written import channel_symbol, format_number, quantity, split_name
from flexgui.views.fit_table import FIT_IS
from flexgui.views.headline import (
    BIASED,
    COMPLETE,
    comparisons_as_given,
    criteria,
    current_verdict,
    final_comparisons,
    final_derived_names,
    final_estimates,
    first_is_biased,
    has_added_effects,
    kept_effects,
)
from flexgui.views.names import equation, format_percent, is_of_a_start, typeset
from flexgui.views.pooled import ESTIMATE, VALIDATE, channel_errors, tip_rms, with_role

LEVELS = {"lpv": "the LPV descriptor model", "nonlinear": "the non-linear model"}
METHODS = {"glocal": "fitted together", "local": "fitted one by one"}


def summary(outcome: Outcome) -> tuple[str, ...]:
    """Sentences in reading order, without warnings; symbols are typeset for HTML."""
    sentences: list[str] = [_estimates(outcome), _first_fit(outcome)]
    shown, before = final_comparisons(outcome), comparisons_as_given(outcome)
    for role, words in ((ESTIMATE, "Estimation recordings"), (VALIDATE, "Validation recordings")):
        text, was = quality(with_role(shown, role)), _tip(with_role(before, role))
        if text:
            given_by = f" (model as given: {was})" if was else ""
            sentences.append(f"{words}: {text}{given_by}.")
    if any("FIT" in each for each in sentences):
        sentences.append(FIT_IS)
    if found := criteria(outcome):
        sentences.append(f"{criteria_text(found)}, of errors without their correlation in time.")
    return (*(s for s in sentences if s), *_doubts(outcome))


def result_lines(outcome: Outcome) -> tuple[str, ...]:
    """A result in plain lines: verdict or basis, parameters, quality, seconds."""
    diagnosis = outcome.diagnosis
    estimates = [e for e in final_estimates(outcome) if e.recording is None]
    reached = quality(with_role(final_comparisons(outcome), ESTIMATE))
    lines = (
        f"{_basis(outcome)}." if diagnosis is None else current_verdict(diagnosis),
        proposed_line(None if diagnosis is None else diagnosis.proposal),
        Markup("{}.").format(_listed(estimates)) if estimates else "",
        f"Estimation recordings: {reached}." if reached else "",
        f"Time: {sum(outcome.seconds.values()):.1f} s.",
    )
    return plain(line for line in lines if line)


def warning_lines(outcome: Outcome) -> tuple[str, ...]:
    """What is to be read before any number, a line each."""
    return plain(Markup("Warning: {}").format(text) for text in alarms(outcome))


def lead_sentences(outcome: Outcome) -> tuple[str, ...]:
    """Sentences of `summary` that no table of a report states."""
    return f"{_basis(outcome)}.", *_doubts(outcome)


ALMOST_NOTHING = 10.0
"""FIT in % below which a model explains almost nothing of a fitted output."""


def alarms(outcome: Outcome) -> tuple[str, ...]:
    """Warnings to read first: implausible results, values at a bound, findings of the check."""
    return (*implausible(outcome), *outcome.findings)


def plain(sentences: Iterable[str]) -> tuple[str, ...]:
    """Sentences without typesetting, for a terminal or a file."""
    return tuple(s.striptags() if isinstance(s, Markup) else s for s in sentences)


def implausible(outcome: Outcome) -> list[str]:
    """Warnings about the fit itself."""
    fitted = with_role(final_comparisons(outcome), ESTIMATE) if outcome.fits else ()
    warnings, distance = list[str](), tip_rms(fitted)
    reach = sum(link.length for link in outcome.mechanism.links) if outcome.mechanism else np.inf
    if distance is not None and distance > reach:
        warnings.append(
            f"The tip error is {quantity(distance, 'm')} rms, more than the arm's length "
            f"({quantity(reach, 'm')}). Check the units and signs of the recordings."
        )
    for e in channel_errors(fitted):
        if e.fitted and e.fit_percent < ALMOST_NOTHING:
            warnings.append(
                f"The model explains almost nothing of {channel_symbol(e.channel, e.unit)} (FIT "
                f"{format_percent(e.fit_percent)} %). Check its unit, its sign and its name."
            )
    at_bounds = _symbols(e for e in _estimated(outcome) if e.at_bound and e.identifiable)
    if at_bounds:
        warnings.append(
            Markup("{} ended at a bound. Widen it, or doubt the model.").format(_joined(at_bounds))
        )
    return warnings


def _estimated(outcome: Outcome) -> list[Estimate]:
    """Estimated parameters of the model after the diagnosis, without initial states."""
    if outcome.diagnosis is not None and outcome.diagnosis.parameters:
        derived = final_derived_names(outcome)
        return [e for e in final_estimates(outcome) if e.name not in derived and not e.recording]
    return [e for fit in outcome.fits for e in fit.estimates if not is_of_a_start(e)]


def _doubts(outcome: Outcome) -> tuple[str, ...]:
    stopped = "The search was stopped early. These are the best values found until then."
    sentences = (_determined(outcome), stopped if any(fit.stopped for fit in outcome.fits) else "")
    return tuple(s for s in sentences if s)


def _basis(outcome: Outcome) -> str:
    """Recordings, method and model, without a full stop."""
    names = {name for fit in outcome.fits for name in fit.recordings}
    level = LEVELS.get(outcome.level, outcome.level)
    if not outcome.fits:
        return f"Nothing was estimated: {level} is compared as given"
    count = f"{len(names)} recording{'s' if len(names) != 1 else ''}"
    how = f", {METHODS.get(outcome.method, outcome.method)}" if len(names) > 1 else ""
    diagnosis = outcome.diagnosis
    if diagnosis is not None and has_added_effects(outcome):
        return f"From {count}, with the full equations and {kept_effects(diagnosis)} in the model"
    return f"From {count}{how}, with {level}"


def _estimates(outcome: Outcome) -> str:
    text = _basis(outcome)
    if not outcome.fits:
        return f"{text}."
    determined = [e for e in final_estimates(outcome) if e.recording is None and e.identifiable]
    if not determined:
        return f"{text}: no parameter could be determined alone."
    several = len(outcome.fits) > 1 and outcome.diagnosis is None
    mean = "on average " if several else ""
    return Markup("{}: {}{}. {}").format(text, mean, _listed(determined), COMPLETE)


def _first_fit(outcome: Outcome) -> Markup | str:
    """Estimates of the model as given, by the same fit; empty where nothing was added to it."""
    diagnosis = outcome.diagnosis
    if diagnosis is None or not (has_added_effects(outcome) and first_is_biased(outcome)):
        return ""
    estimates = [e for e in diagnosis.steps[0].parameters if not e.recording and e.identifiable]
    return Markup("Before: {} ({}).").format(_listed(estimates), BIASED) if estimates else ""


def _listed(estimates: Sequence[Estimate]) -> Markup:
    return Markup(", ").join(equation(e) for e in estimates)


def quality(comparisons: Sequence[RecordingComparison]) -> str:
    """Mean FIT of the fitted outputs and tip error; empty where there is neither."""
    errors = [e for e in channel_errors(comparisons) if e.fitted and np.isfinite(e.fit_percent)]
    parts = [
        f"{format_percent(e.fit_percent)} % in {channel_symbol(e.channel, e.unit)}" for e in errors
    ]
    text = f"mean FIT {_joined(parts)}" if parts else ""
    if distance := _tip(comparisons):
        text = ", ".join(part for part in (text, f"tip error {distance} rms") if part)
    return text


def _tip(comparisons: Sequence[RecordingComparison]) -> str:
    """Tip error in rms; empty without a measured tip."""
    distance = tip_rms(comparisons)
    return "" if distance is None or not np.isfinite(distance) else quantity(distance, "m")


def _determined(outcome: Outcome) -> str:
    if not outcome.fits:
        return ""
    free = _symbols(e for e in _estimated(outcome) if not e.identifiable)
    if not free:
        return "" if implausible(outcome) else "All parameters are identifiable."
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


DOUBTFUL = 2.0
"""Times the noise floor: above it most of the error is not noise. Verdict, noise floor and ± values
assume a complete model, so a warning in red stands beside them."""


def provisional_warning(error: float) -> str:
    """Warning for a model with this error in noise floors; empty where it is near 1."""
    if not error > DOUBTFUL:
        return ""
    return (
        f"Provisional: overall error {format_number(error, 2, keep_zeros=True)}× noise floor. "
        "Verdict, noise floor and ± values assume a complete model."
    )


HELD = " It takes the initial state of each recording from the first encoder sample."
FREE = " It also fits the initial state of each recording."
OWN = "Diagnosis fit: it compares {}, each in multiples of its noise floor.{}"


def are_of_diagnosis(comparisons: Sequence[RecordingComparison]) -> bool:
    """Whether they show the diagnosis fit."""
    return any(c.fit_label == DIAGNOSIS_FIT for c in comparisons)


def which_fit(comparisons: Sequence[RecordingComparison], fits: Sequence[Fit]) -> str:
    """Which fit the shown errors are of; `fits` of the identification."""
    seen = {k.channel: k.unit for c in comparisons for k in c.channels if k.fitted}
    outputs = listed([channel_symbol(name, unit) for name, unit in seen.items()])
    starts = diagnosis_frees_starts(list(seen), fits)
    if not are_of_diagnosis(comparisons):
        return (
            f"Identification fit: it compares {outputs}.{HELD * starts} After Find what is missing "
            "this shows the diagnosis fit, whose errors differ slightly."
        )
    own = OWN.format(outputs, FREE * starts)
    return f"{own} So these errors differ from those of the identification fit."


def which_fit_in_report(outcome: Outcome) -> Markup:
    """Which figures of a report are of which fit; empty without a diagnosis."""
    diagnosis = outcome.diagnosis
    if diagnosis is None or not outcome.fits:
        return Markup("")
    compared = diagnosis.steps[0].errors
    outputs = listed([channel_symbol(e.channel, e.unit) for e in compared])
    starts = diagnosis_frees_starts([e.channel for e in compared], outcome.fits)
    own = OWN.format(outputs, FREE * starts)
    first = f"Identification fit: it compares the selected outputs.{HELD * starts}"
    if not diagnosis.parameters:
        text = f"The estimates above are of the identification fit. {first} {own}"
    else:
        text = f"The estimates above are of the diagnosis fit. {own} {first}"
    if are_of_diagnosis(final_comparisons(outcome)):
        text += " FIT and tip error above are of the diagnosis fit too."
    elif diagnosis.parameters:
        text += " FIT and tip error above are of the identification fit."
    return Markup("{}").format(text)


def diagnosis_frees_starts(channels: Sequence[str], fits: Sequence[Fit]) -> bool:
    """Whether only the diagnosis fit estimates the initial states."""
    servo = any(split_name(name)[0] in ("u", "torque") for name in channels)
    fitted = any(e.name.startswith(START) for fit in fits for e in fit.estimates)
    return not servo and not fitted
