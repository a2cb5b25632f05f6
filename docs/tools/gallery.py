"""`python docs/tools/gallery.py`: writes docs/effects.md and a picture of each effect.

The paper's arm is simulated with one effect of a plausible size and compared with the bare model.
A picture shows the residual of the sensor that stands out most of its noise. For an effect at the
joints it also shows the missing torque over the joint's speed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import flexgui as fg
from flexgui.core.effects import catalogue
from flexgui.core.effects.effect import Effect
from flexgui.core.effects.sizes import typical

DOCS = Path(__file__).resolve().parents[1]
PAGE, PICTURES = DOCS / "effects.md", DOCS / "pictures" / "effects"
NOISE = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
"""m, rad, rad; of z, theta, deflection"""
OUTPUT = ["z", "encoder", "deflection"]
LOOP = fg.drives.VelocityLoop(gains=(60.0, 30.0))
MOTION = {"theta2": 1.2, "seconds": 1.0, "seed": 1, "hold": 0.05}
SMOOTH = {
    "theta2": 1.2, "seconds": 3.0, "seed": 1, "excitation": "multisine", "amplitude": 0.6,
    "hold": 0.001, "options": {"highest_hz": 4.0, "periods": 1},
}  # fmt: skip
"""For the missing torque, which jumps where a reference does."""
HUBS = (0.2, 0.05)
GEARED = {"preset": "paper", "hub_inertia": list(HUBS)}
"""kg m²: without rotors the arm vibrates faster than its samples show, and a torque that they drive
it with is known badly."""
FILTER = {"filter": {"cutoff_hz": 30.0}}
OVER = {"rotor_inertia": "acceleration", "torque_ripple": "angle"}
"""Effect -> what its missing torque is drawn over, where that is not the speed."""
NO_TORQUE = ("joint_elasticity", "backlash")
"""Effects at a joint that are no torque."""
LARGER = {"cubic_stiffness": 4.0, "structural_damping": 4.0}
"""Times a plausible size, where that drowns in the noise of one short recording."""
SCALES = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}
SIZE, MARGIN, MOST_POINTS = (400, 190), (52, 12, 30, 34), 500

HEAD = """# Effects

{count} physical effects that a model may lack. Each one has its story, its law and a picture of
what it leaves in the residual. The command `python docs/tools/gallery.py` makes this page.

The pictures show the paper's arm with the effect at a plausible size. Left: the residual (measured
minus modelled) of the sensor that shows the effect most. The grey band is ± 2 standard deviations
of its noise. Right, for torques at the joints: the missing torque over speed, acceleration or
angle. It is what the drive spends beyond the model's need.

[The scenario](scenario.md#effects) lists the parameters with units and bounds.
"""
SECTION = """## `{kind}`: {title} {{ #{kind} }}

{story}

{law}

![What {kind} leaves in the residual](pictures/effects/{kind}.svg)
"""


def main() -> None:
    """Draw all pictures, then write the page."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for kind, effect in sorted(catalogue().items()):
        (PICTURES / f"{kind}.svg").write_text(picture(kind, effect), encoding="utf-8")
        print(kind)
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """The whole page, from the catalogue."""
    sections = [section(kind, effect) for kind, effect in sorted(catalogue().items())]
    return HEAD.format(count=len(sections)) + "\n" + "\n".join(sections)


def section(kind: str, effect: Effect) -> str:
    """The effect's part of the page."""
    return SECTION.format(
        kind=kind, title=effect.title, story=effect.story, law=f"$${effect.formula}$$"
    )


def picture(kind: str, effect: Effect) -> str:
    """An SVG with one or two panels."""
    level = "lpv" if kind == "large_motion" else "nonlinear"
    settings = {"model": {"level": level}, "identify": {"parameters": ["EI"], "output": OUTPUT}}
    machine = fg.project("paper", LOOP, sensors=NOISE, **settings)
    hidden = {kind: sizes(kind, effect, machine)}
    motion = {**MOTION, "amplitude": 1.5} if kind == "large_motion" else MOTION
    run = machine.simulate(**motion, hidden=hidden)
    rig = fg.project("paper", LOOP, [run.recording], sensors=NOISE, **settings)
    panels = [residual_panel(rig.compare()[run.recording.name])]
    if (effect.location == "joint" or kind == "torque_offset") and kind not in NO_TORQUE:
        geared = fg.project(GEARED, LOOP, **settings)
        if kind == "rotor_inertia":  # the parameter is the whole inertia of a hub
            added = {f"Jh{j}": hidden[kind][f"Jh{j}"] + hub for j, hub in enumerate(HUBS, start=1)}
            hidden = {kind: {**hidden[kind], **added}}
        quiet = geared.simulate(**SMOOTH, hidden=hidden, noise=False)
        torque = {**settings, "identify": {"parameters": ["EI"], "output": ["torque"], **FILTER}}
        driven = fg.project(GEARED, {"kind": "torque"}, [quiet.recording], **torque)
        panels.append(torque_panel(driven.compare()[quiet.recording.name], OVER.get(kind, "speed")))
    width, height = SIZE[0] * len(panels), SIZE[1]
    body = "".join(
        f'<g transform="translate({k * SIZE[0]} 0)">{panel}</g>' for k, panel in enumerate(panels)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11" fill="#777">'
        f"{body}</svg>\n"
    )


def sizes(kind: str, effect: Effect, machine: fg.Project) -> dict[str, float]:
    """A plausible size of each parameter, in SI units."""
    arm = effect.changed_arm(machine.model.arm, {})
    parameters = effect.parameters(arm, LOOP, typical(arm))
    factor = LARGER.get(kind, 1.0)
    return {
        p.parameter.name: p.parameter.value * (1.0 if p.secondary else factor) for p in parameters
    }


def residual_panel(seen: object) -> str:
    """The residual over time of the channel that stands out most of its noise."""
    noise = {
        "z": NOISE["camera_noise"],
        "t": NOISE["encoder_noise"],
        "d": NOISE["deflection_noise"],
    }
    shown = [c for c in seen.channels if c.channel[:2] in ("z1", "z2", "th", "de")]
    most = max(shown, key=lambda c: np.std(c.residual) / noise[c.channel[0]])
    factor, unit = SCALES[most.unit]
    band = 2.0 * factor * noise[most.channel[0]]
    return panel(
        most.time, factor * most.residual, "time [s]", f"residual of {most.channel} [{unit}]", band
    )


def torque_panel(seen: object, over: str) -> str:
    """The missing torque of the joint where it is larger, over its speed, acceleration or angle."""
    most = max(seen.missing_torque, key=lambda m: np.std(m.missing))
    step = most.time[1] - most.time[0]
    x, unit = {
        "speed": lambda: (most.velocity, "rad/s"),
        "acceleration": lambda: (np.gradient(most.velocity, step), "rad/s²"),
        "angle": lambda: (np.cumsum(most.velocity) * step, "rad"),
    }[over]()
    return panel(
        x, most.missing, f"{over} of joint {most.joint} [{unit}]",
        f"missing torque [{most.unit}]", dots=True,
    )  # fmt: skip


def panel(
    x: np.ndarray, y: np.ndarray, across: str, up: str, band: float = 0.0, *, dots: bool = False
) -> str:
    """One pair of axes with a line or dots."""
    left, right, top, bottom = MARGIN
    step = max(1, len(x) // MOST_POINTS)
    x, y = x[::step], y[::step]
    if dots:  # a few outliers at the ends must not squeeze the rest
        low, high = np.percentile(y, [1.0, 99.0])
        x, y = x[(y >= low) & (y <= high)], y[(y >= low) & (y <= high)]
    x0, x1 = float(np.min(x)), float(np.max(x))
    reach = 1.1 * max(float(np.max(np.abs(y))), band, 1e-12)
    px = left + (x - x0) / (x1 - x0) * (SIZE[0] - left - right)
    middle, half = (top + SIZE[1] - bottom) / 2.0, (SIZE[1] - top - bottom) / 2.0
    py = middle - y / reach * half
    points = [f"{a:.1f} {b:.1f}" for a, b in zip(px, py, strict=True)]
    curve = (
        "".join(f'<circle cx="{p.split()[0]}" cy="{p.split()[1]}" r="1.3"/>' for p in points)
        if dots
        else f'<path d="M{" ".join(points)}" fill="none" stroke="#1f77b4"/>'
    )
    grey = f'<rect x="{left}" y="{middle - band / reach * half:.1f}" '
    grey += f'width="{SIZE[0] - left - right}" height="{2 * band / reach * half:.1f}" '
    grey += 'fill="#999" opacity="0.3"/>'
    ticks = "".join(
        f'<text x="{left - 5}" y="{middle - v / reach * half + 4:.1f}" text-anchor="end">'
        f"{v:.2g}</text>"
        for v in (-0.9 * reach, 0.0, 0.9 * reach)
    )
    ends = "".join(
        f'<text x="{place}" y="{SIZE[1] - bottom + 14}" text-anchor="{anchor}">{value:.2g}</text>'
        for place, anchor, value in ((left, "start", x0), (SIZE[0] - right, "end", x1))
    )
    return (
        f'{grey if band else ""}<path d="M{left} {top}V{SIZE[1] - bottom}H{SIZE[0] - right}'
        f'M{left} {middle}H{SIZE[0] - right}" fill="none" stroke="#999"/>'
        f'<g fill="#1f77b4">{curve}</g>{ticks}{ends}'
        f'<text x="{left}" y="{top - 12}">{up}</text>'
        f'<text x="{(left + SIZE[0]) / 2}" y="{SIZE[1] - 6}" text-anchor="middle">{across}</text>'
    )


if __name__ == "__main__":
    main()
