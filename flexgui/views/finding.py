"""A finding of the check as words with a picture."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from core.check.finding import Finding
from core.recording.channels import is_channel
from flexgui.views.names import channel_symbol
from flexgui.views.preview import sparkline

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
    evidence = Markup("<p class='soft'>{}</p>").format(_with_symbols(one.evidence))
    return head + _picture(one) + evidence


def _picture(one: Finding) -> Markup:
    found = one.picture
    if found is None or len(found.time) < 2:
        return Markup("")
    title = f"{one.channel} over time"
    shown, expected = _apart(found.shown, found.expected)
    return sparkline(found.time, shown, expected, SIZE, title)


FLAT = 0.1
"""Share of the picture's height below which both curves are drawn as changes from their medians: a
sign or a unit puts them so far apart that neither is seen to move."""


def _apart(shown: np.ndarray, expected: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Both as they are, or both without their medians."""
    if expected is None or not np.isfinite(shown).any() or not np.isfinite(expected).any():
        return shown, expected
    both = [shown[np.isfinite(shown)], expected[np.isfinite(expected)]]
    whole = float(np.ptp(np.concatenate(both)))
    if max(float(np.ptp(x)) for x in both) >= FLAT * whole:
        return shown, expected
    return shown - np.median(both[0]), expected - np.median(both[1])


def _with_symbols(sentence: str) -> str:
    """Channels by their symbols: θ₁ for theta1, θ̇₁* for dtheta1_ref."""

    def symbol(word: re.Match[str]) -> str:
        name = word.group()
        if not is_channel(name) or name == "t":
            return name
        star = "*" if name.endswith("_ref") else ""
        return channel_symbol(name.removesuffix("_ref")) + star

    return re.sub(r"[a-z_]+\d(?:_ref)?", symbol, sentence)


def lines_applied(lines: Sequence[str]) -> Markup:
    """What stands in the scenario since a button mended something."""
    if not lines:
        return Markup("")
    said = Markup("").join(Markup("<li>{}</li>").format(line) for line in lines)
    return Markup("<p class='soft'>In the scenario by now:</p><ul class='soft'>{}</ul>").format(
        said
    )
