"""A finding of the check as words with a picture."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from core.check.finding import Finding
from flexgui.views.names import channel_symbol
from flexgui.views.sparkline import sparkline

SIZE = (340, 54)
"""px: five of them and their sentences fit a screen of 900."""

TITLES = {
    "degrees": "Degrees, not radians",
    "millimetres": "Millimetres, not metres",
    "sign": "Wrong sign",
    "swapped_joints": "Swapped columns",
    "gear_ratio": "Gear ratio missing",
    "scale": "Wrong scale",
    "delay": "Delayed",
    "dead": "Frozen",
    "clipped": "Clipped",
    "quantised": "Coarsely quantised",
    "dropouts": "Missing samples",
    "repeated_times": "Repeated time stamps",
    "jitter": "Jittering clock",
    "sample_time": "Wrong sample time",
    "clock_drift": "Drifting clock",
    "time_unit": "Unit of the time",
    "outliers": "Outliers",
    "offset": "Offset",
    "weak_excitation": "Weak excitation",
    "drive_saturated": "Saturated drive",
    "repeated_cycles": "Repeated cycles",
    "starts_moving": "Starts in motion",
    "different_rig": "Another rig",
}
"""Of the faults that ship; another one is called by its id."""


def title_of(fault: str) -> str:
    """What a person calls a fault."""
    return TITLES.get(fault, fault.replace("_", " ").capitalize())


def finding_words(one: Finding) -> Markup:
    """Title, picture and evidence."""
    head = Markup("<p><b>{}</b> {}</p>").format(title_of(one.fault), channel_symbol(one.channel))
    evidence = Markup("<p class='soft'>{}</p>").format(one.evidence)
    return head + _picture(one) + evidence


def _picture(one: Finding) -> Markup:
    found = one.picture
    if found is None or len(found.time) < 2:
        return Markup("")
    title = f"{one.channel} over time"
    return sparkline(found.time, found.shown, found.expected, SIZE, title)


def lines_applied(lines: Sequence[str]) -> Markup:
    """What stands in the scenario since a button mended something."""
    if not lines:
        return Markup("")
    said = Markup("").join(Markup("<li>{}</li>").format(line) for line in lines)
    return Markup("<p class='soft'>In the scenario by now:</p><ul class='soft'>{}</ul>").format(
        said
    )
