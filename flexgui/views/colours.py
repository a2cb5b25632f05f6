"""One colour per meaning, readable on white and on near-black (contrast of 3 or more on both).

The names below are the whole table: a figure takes its colours from here.
"""

from __future__ import annotations

MEASURED = "#3d7fd1"
"""Blue: what sensors recorded."""
MODEL = "#d9730d"
"""Orange: what the model simulates."""
RESIDUAL = "#bd28a0"
"""Magenta: measured minus model, and its size; maps of the error rise in it."""
MISSING = RESIDUAL
"""The missing torque is the residual again, seen as a torque."""
BACKWARDS = "#7a63c8"
"""The same while the joint moves backwards."""
ADDED = "#1f9470"
"""Green: what an effect predicts, or has explained once it was added."""
REFERENCE = "#8c6d55"
"""Brown: what was commanded, or stated by others."""
BESIDE = "#8a3ff0"
"""Violet: another model beside the present one."""
START = "#7d858f"
"""Grey: where the search began, and whatever is only context."""
FLOOR = START
"""The noise floor, mostly as a band: what is within it needs no explanation."""
BOUND = "#d64545"
"""Red: a limit."""

JOINTS = ("#2a93a8", "#b58a00", "#a06cd5")
"""Teal and ochre: signals of joint 1 and 2, commands too, where a figure compares joints."""
JOINT_DASHES = ("solid", "dash", "dot")
"""Joints in one figure; the dash distinguishes them where colours are not seen."""

SERIES = ("#2a93a8", "#b58a00", "#7a63c8", "#d64545", "#7d858f", "#8c6d55")
"""Outputs or fits without a meaning of their own, in figures of nothing else; the first four suit
colour-blind eyes."""

TEXT, TEXT_ON_DARK = "#565e68", "#b3bbc4"
"""Of axes and legends: contrast of 6 on white, of 8 on a page's dark ground (WCAG asks for 4.5)."""
GRID = "rgba(128,136,146,0.22)"
AXIS = "rgba(128,136,146,0.65)"
CLEAR = "rgba(0,0,0,0)"
HOVER_BACKGROUND = "#20262d"
HOVER_TEXT = "#f4f6f8"

DIVERGING = ((0.0, "#3d7fd1"), (0.5, "#eceff2"), (1.0, "#d9730d"))
"""From -1 over 0 to +1."""

RISING = ((0.0, "#e9edf1"), (0.35, "#e3a9c9"), (0.7, "#c44a8f"), (1.0, "#6d1b4f"))
"""From the floor up to the worst error: what is only noise recedes into a light ground."""
RISING_ON_DARK = ((0.0, "#ccd4dd"), (0.35, "#e3a0c6"), (0.7, "#dd52a0"), (1.0, "#bd1a78"))
"""The same for a dark ground, on which the darkest is still seen: pale is good on both."""


def rgb(colour: str) -> tuple[int, int, int]:
    """'#rrggbb' as three integers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def faded(colour: str, alpha: float) -> str:
    """The colour '#rrggbb' as 'rgba(...)' with an opacity `alpha` between 0 and 1."""
    red, green, blue = rgb(colour)
    return f"rgba({red},{green},{blue},{alpha:g})"


def joint(index: int) -> dict[str, str]:
    """The line of the index-th joint, from 0."""
    place = index % len(JOINTS)
    return {"color": JOINTS[place], "dash": JOINT_DASHES[place]}


def series(index: int) -> str:
    """The colour of the index-th of several alike things."""
    return SERIES[index % len(SERIES)]
