"""`python docs/tools/conventions.py`: draws docs/pictures/conventions.svg, the signs of an arm.

The bending is drawn as core/arm/kinematics.py has it: a segment starts along its root's tangent and
its end's tangent is the direction from which the next angle counts.
"""

from __future__ import annotations

import math
from pathlib import Path

FILE = Path(__file__).resolve().parents[1] / "pictures" / "conventions.svg"
BASE = (130.0, 345.0)
THETA, DEFLECTION = (math.radians(16), math.radians(30)), (0.14, 0.12)
"""rad; δ(l)/l of the links, far larger than any real one."""
LENGTH = (290.0, 210.0)
INK, BEAM, RIGID, TORQUE, HUB = "#555", "#1f77b4", "#999", "#d35400", "#8e44ad"


def point(x: float, y: float) -> str:
    """Of the plane, with z2 upwards."""
    return f"{BASE[0] + x:.1f} {BASE[1] - y:.1f}"


def text(x: float, y: float, words: str, colour: str = INK, anchor: str = "start") -> str:
    """Words at a place."""
    px, py = point(x, y).split()
    return f'<text x="{px}" y="{py}" fill="{colour}" text-anchor="{anchor}">{words}</text>'


def line(a: tuple[float, float], b: tuple[float, float], colour: str, more: str = "") -> str:
    """A straight line."""
    return f'<path d="M{point(*a)}L{point(*b)}" stroke="{colour}" {more}/>'


def arc(centre: tuple[float, float], radius: float, first: float, last: float, colour: str) -> str:
    """Counterclockwise from one direction to another, with an arrow."""
    a = (centre[0] + radius * math.cos(first), centre[1] + radius * math.sin(first))
    b = (centre[0] + radius * math.cos(last), centre[1] + radius * math.sin(last))
    large = int(last - first > math.pi)
    return (
        f'<path d="M{point(*a)}A{radius} {radius} 0 {large} 0 {point(*b)}" stroke="{colour}" '
        f'fill="none" marker-end="url(#{colour[1:]})"/>'
    )


def beyond(a: tuple[float, float], angle: float, length: float) -> tuple[float, float]:
    """The place at a distance in a direction."""
    return a[0] + length * math.cos(angle), a[1] + length * math.sin(angle)


def beam(
    root: tuple[float, float], angle: float, length: float, share: float
) -> tuple[str, tuple[float, float], float]:
    """The bent segment δ = share x²/l, its end and the direction of its end."""
    places = []
    for k in range(41):
        x = length * k / 40
        across = share * x * x / length
        along = beyond(root, angle, x)
        places.append(beyond(along, angle + math.pi / 2, across))
    path = f'<path d="M{"L".join(point(*p) for p in places)}" stroke="{BEAM}" stroke-width="7" '
    return path + 'fill="none" stroke-linecap="round"/>', places[-1], angle + 2.0 * share


def hub(place: tuple[float, float]) -> str:
    """A motor with the inertia of its rotor."""
    x, y = point(*place).split()
    return (
        f'<circle cx="{x}" cy="{y}" r="19" fill="#fff" stroke="{HUB}" stroke-width="4"/>'
        f'<circle cx="{x}" cy="{y}" r="5" fill="{HUB}"/>'
    )


def main() -> None:
    """Write the picture."""
    origin = (0.0, 0.0)
    first, end1, direction = beam(origin, THETA[0], LENGTH[0], DEFLECTION[0])
    root2 = direction + THETA[1]
    second, end2, _ = beam(end1, root2, LENGTH[1], DEFLECTION[1])
    undeformed1 = beyond(origin, THETA[0], LENGTH[0])
    undeformed2 = beyond(end1, root2, LENGTH[1])
    dashed = 'stroke-dasharray="5 4"'
    markers = "".join(
        f'<marker id="{c[1:]}" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="9" '
        f'markerHeight="9" markerUnits="userSpaceOnUse" orient="auto">'
        f'<path d="M0 0L10 5L0 10z" fill="{c}"/></marker>'
        for c in (INK, TORQUE, BEAM)
    )
    arrow = f'marker-end="url(#{INK[1:]})"'
    parts = [
        line((-60.0, 0.0), (440.0, 0.0), INK, arrow), text(446.0, -5.0, "z1"),
        line((0.0, -40.0), (0.0, 290.0), INK, arrow), text(-8.0, 298.0, "z2"),
        line(origin, beyond(origin, THETA[0], LENGTH[0] + 50), RIGID, dashed),
        line(end1, beyond(end1, direction, 130.0), RIGID, dashed),
        line(end1, beyond(end1, root2, LENGTH[1] + 20), RIGID, dashed),
        first, second,
        line(undeformed1, end1, BEAM, f'marker-end="url(#{BEAM[1:]})" stroke-width="2"'),
        text(undeformed1[0] - 20, undeformed1[1] - 22, "δ1 &gt; 0", BEAM),
        line(undeformed2, end2, BEAM, f'marker-end="url(#{BEAM[1:]})" stroke-width="2"'),
        text(undeformed2[0] - 4, undeformed2[1] + 12, "δ2 &gt; 0", BEAM),
        arc(origin, 95.0, 0.0, THETA[0], INK), text(100.0, 18.0, "θ1 &gt; 0"),
        arc(end1, 85.0, direction, root2, INK),
        text(*beyond(end1, direction + 0.35, 92.0), "θ2 &gt; 0"),
        arc(origin, 34.0, math.radians(130), math.radians(320), TORQUE),
        text(-95.0, -52.0, "u1 &gt; 0", TORQUE),
        arc(end1, 34.0, math.radians(180), math.radians(370), TORQUE),
        text(end1[0] + 42, end1[1] - 4.0, "u2 &gt; 0", TORQUE),
        hub(origin), hub(end1),
        text(-52.0, 24.0, "Jh1", HUB), text(end1[0] - 44, end1[1] + 28, "Jh2", HUB),
        text(end2[0] - 14, end2[1] - 4, "tip: z = (z1, z2)", INK, "end"),
    ]  # fmt: skip
    words = [
        ("All angles, torques and deflections are positive counterclockwise.", INK),
        ("θ1 counts from the axis z1, θ2 from the tangent at the end of link 1.", INK),
        ("At θ1 = θ2 = 0 the straight arm lies along z1.", INK),
        ("δ is the end's distance from the root's tangent; a gauge reads δ/l in rad.", BEAM),
        ("u2 acts on link 2 and, with the opposite sign, on the end of link 1.", TORQUE),
        ("Jh sits on the motor's side: it turns with θ, before an elastic joint's twist.", HUB),
    ]
    legend = "".join(
        f'<text x="20" y="{414 + 19 * k}" fill="{colour}">{sentence}</text>'
        for k, (sentence, colour) in enumerate(words)
    )
    FILE.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="620" height="520" viewBox="0 0 620 520" '
        'font-family="sans-serif" font-size="14" fill="none">'
        f'<rect width="620" height="520" fill="#fff"/><defs>{markers}</defs>'
        f"{''.join(parts)}{legend}</svg>\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
