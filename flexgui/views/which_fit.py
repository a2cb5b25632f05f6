"""Which fit some figures are of: the identification's or the diagnosis', and why they differ."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from core.diagnose.phrases import LABEL
from core.identify.unknowns import START
from core.results import Fit, Outcome, RecordingComparison
from core.sentences import listed
from core.written import split_name
from flexgui.views.headline import final_comparisons
from flexgui.views.names import channel_symbol

HELD = "takes the initial state of each recording from the first encoder sample"
FREE = ", and it also fits the initial state of each recording"


def of_diagnosis(comparisons: Sequence[RecordingComparison]) -> bool:
    """Whether they show the fit that a diagnosis looks at."""
    return any(c.fit_label == LABEL for c in comparisons)


def which_fit(comparisons: Sequence[RecordingComparison], fits: Sequence[Fit]) -> str:
    """For the place where the errors are shown; `fits` of the identification."""
    seen = {k.channel: k.unit for c in comparisons for k in c.channels if k.fitted}
    names = list(seen)
    outputs = listed([channel_symbol(name, unit) for name, unit in seen.items()])
    starts = starts_freed(names, fits)
    held = f" and {HELD}" if starts else ""
    if not of_diagnosis(comparisons):
        return (
            f"Of the identification's fit: it compares {outputs}{held}. After Find what is missing "
            f"the diagnosis' own fit is shown here, whose errors are a little different."
        )
    return (
        f"Of the diagnosis' own fit: it compares {outputs}, each in multiples of its noise floor"
        f"{FREE if starts else ''}. Therefore these errors differ from those of the "
        f"identification{f', which {HELD}' if starts else ''}."
    )


def distinguishable(outcome: Outcome) -> Markup:
    """For a report with a diagnosis: which figures are of which fit; empty without a diagnosis."""
    found = outcome.diagnosis
    if found is None or not outcome.fits:
        return Markup("")
    names = [e.channel for e in found.steps[0].errors]
    outputs = listed([channel_symbol(e.channel, e.unit) for e in found.steps[0].errors])
    starts = starts_freed(names, outcome.fits)
    own = (
        f"the diagnosis' own fit: it compares {outputs}, each in multiples of its noise floor"
        f"{FREE if starts else ''}"
    )
    first = (
        f"the identification, which compares the selected outputs{f' and {HELD}' if starts else ''}"
    )
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
