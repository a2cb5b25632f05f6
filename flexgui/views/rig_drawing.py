"""A drawing of an arm as SVG: base, joints, links in proportion, and what sits at their ends."""

from __future__ import annotations

import math

from markupsafe import Markup

from flexgui.core.arm.arm import Arm

WIDTH, HEIGHT = 340.0, 104.0
"""px"""
SIDE = 26.0
"""px around the drawing."""
TURN = math.radians(24.0)
"""Of each link against the horizontal, up and down in turn."""
FRAME = Markup(
    "<svg class='rig' role='img' aria-label='{}' viewBox='0 0 {w:g} {h:g}' width='100%'>{}</svg>"
)
LINK = Markup(
    "<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' class='{}'/>"
    "<text x='{:.1f}' y='{:.1f}'>link {}</text>"
)
JOINT = Markup("<circle cx='{:.1f}' cy='{:.1f}' r='8'/><text x='{:.1f}' y='{:.1f}'>{}</text>")
LOAD = Markup("<rect x='{:.1f}' y='{:.1f}' width='12' height='12' rx='2'/>")
GROUND = Markup("<path d='M{:.1f} {:.1f} v22 m-12 0 h24'/>")
RAIL = Markup(
    "<path d='M20 74 h300'/><rect x='130' y='44' width='80' height='28' rx='3'/>"
    "<text x='170' y='36'>slide</text>"
)


def rig_drawing(arm: Arm) -> Markup:
    """The arm seen from above; bending links are drawn thin, rigid ones thick."""
    words = f"Drawing of an arm with {arm.joints} link{'s' if arm.joints > 1 else ''}"
    if arm.segments[0].joint == "prismatic":
        return FRAME.format("Drawing of a slide", RAIL, w=WIDTH, h=HEIGHT)
    across = sum(segment.length for segment in arm.segments) * math.cos(TURN)
    up = max(segment.length for segment in arm.segments) * math.sin(TURN)
    scale = min((WIDTH - 2.0 * SIDE) / across, (HEIGHT - 2.0 * SIDE - 12.0) / up)
    x, y = 0.5 * (WIDTH - scale * across), 0.5 * HEIGHT + 0.5 * scale * up + 4.0
    parts, joints = [GROUND.format(x, y)], []
    for k, segment in enumerate(arm.segments):
        step, rise = (scale * segment.length * f(TURN) for f in (math.cos, math.sin))
        to = (x + step, y - rise if k % 2 == 0 else y + rise)
        kind = "bends" if segment.modes else "stiff"
        middle = (0.5 * (x + to[0]), 0.5 * (y + to[1]) - 9.0)
        parts.append(LINK.format(x, y, *to, kind, *middle, k + 1))
        joints.append(JOINT.format(x, y, x, y + 4.0, k + 1))
        if segment.tip_mass:
            parts.append(LOAD.format(to[0] - 6.0, to[1] - 6.0))
        x, y = to
    return FRAME.format(words, Markup("").join([*parts, *joints]), w=WIDTH, h=HEIGHT)
