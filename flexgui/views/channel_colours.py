"""One colour per channel wherever several stand beside one another: joints as in all other figures,
the tip as what was measured, and lighter what belongs to the same joint or the same axis."""

from __future__ import annotations

from core.written import split_name
from flexgui.views import colours

TINTS = (0.0, 0.5, 0.75)
"""Share of white in the first, second and third of a kind: told apart by their lightness where
colours are not seen."""
LINK_TINT = 0.5
"""The bending of a link has the colour of the joint that carries it, lighter."""
AT_JOINT = ("theta", "dtheta", "y", "ydot")
OF_LINK = ("deflection",)
OF_TIP = ("z", "zdot")
OF_DRIVE = ("u", "torque", "i")


def channel_colour(channel: str) -> str:
    """'#rrggbb' of a channel such as 'theta1'."""
    stem, number = split_name(channel)
    index = max(int(number or 1) - 1, 0)
    if stem in AT_JOINT or stem in OF_LINK:
        own = colours.JOINTS[index % len(colours.JOINTS)]
        return tinted(own, LINK_TINT if stem in OF_LINK else 0.0)
    if stem in OF_TIP:
        base = colours.MEASURED
    else:
        base = colours.DRIVE if stem in OF_DRIVE else colours.START
    return tinted(base, TINTS[index % len(TINTS)])


def channel_edge(channel: str) -> str:
    """Of its outline, which a light filling needs on a white ground."""
    stem, number = split_name(channel)
    plain = "theta" if stem in OF_LINK else stem
    return channel_colour(f"{plain}{number if stem in (*AT_JOINT, *OF_LINK) else 1}")


def tinted(colour: str, white: float) -> str:
    """The colour '#rrggbb' with a share of white from 0 to 1."""
    parts = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(part + white * (255 - part)):02x}" for part in parts)
