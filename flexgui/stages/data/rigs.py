"""Kinds of rigs that a person chooses among before a file is brought: what drives the joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import build_arm
from flexgui.core.arm.presets import presets
from flexgui.core.scenario.schema import Scenario
from flexgui.session.edit import Document, Edit, thawed

Options = Mapping[str, Any]


@dataclass(frozen=True)
class RigKind:
    """One entry of the list."""

    title: str
    kind: str
    """Of the drive."""
    start: Callable[[int], dict[str, Any]]
    """Joints -> settings to begin with; a person puts in those of the data sheet."""
    slide: bool = False
    """Whether the arm is a single slide."""
    fits: Callable[[Options], bool] = lambda options: True
    """Whether a drive of this kind with these settings is this rig."""


RIGS = (
    RigKind("Velocity loops", "velocity_loop", lambda n: {"gains": [60.0, 30.0, 15.0][:n]}),
    RigKind("Position loops", "cascade", lambda n: {
        "position_gains": [10.0] * n, "velocity_gains": [40.0, 20.0, 10.0][:n]}),
    RigKind("Torque recorded", "torque", lambda n: {},
            fits=lambda options: not options.get("torque_constants")),
    RigKind("Current recorded", "torque", lambda n: {"torque_constants": [1.0] * n},
            fits=lambda options: bool(options.get("torque_constants"))),
    RigKind("Voltage recorded", "voltage", lambda n: {
        "torque_constants": [0.05] * n, "resistances": [1.0] * n, "gears": [1.0] * n}),
    RigKind("Held by its own servo", "held", lambda n: {}),
    RigKind("Slide, force recorded", "torque", lambda n: {}, slide=True),
)  # fmt: skip

CONSTANTS = {
    "torque_constants": "Torque constants [N m/A]",
    "resistances": "Resistances [Ω]",
    "gears": "Gears [1]",
}
"""Settings with one number per joint that a data sheet states, and how the page calls them."""


def rig_of(scenario: Scenario) -> RigKind | None:
    """Which of the list a scenario has; None where it is another one."""
    arm = build_arm(scenario.arm)
    slide = _is_slide(arm)
    options = scenario.drive.options
    alike = [r for r in RIGS if r.kind == scenario.drive.kind and r.fits(options)]
    return next((r for r in alike if r.slide == slide), alike[0] if alike else None)


def rig_edit(scenario: Scenario, rig: RigKind) -> Edit:
    """Makes the scenario one of that rig: what was simulated with another drive goes, and what is
    compared is chosen anew. A slide's arm is a slide; another rig's is not."""
    was_slide = _is_slide(build_arm(scenario.arm))
    arm = "single_axis" if rig.slide else "paper" if was_slide else ""

    def edit(document: Document) -> None:
        _begin_anew(document)
        if arm:
            _put_arm(document, arm)
        joints = presets()[arm].joints if arm else build_arm(scenario.arm).joints
        document["drive"] = {"kind": rig.kind, **rig.start(joints)}

    return edit


def arm_choices() -> dict[str, str]:
    """Name for display -> preset, of the arms that ship."""
    return {preset.replace("_", " ").capitalize(): preset for preset in presets()}


def arm_edit(scenario: Scenario, preset: str) -> Edit:
    """Makes the scenario's arm one that ships; its drive stays where it drives as many joints."""
    before, after = build_arm(scenario.arm), presets()[preset]
    rig = next((r for r in RIGS if r.slide), RIGS[0]) if _is_slide(after) else rig_of(scenario)
    anew = before.joints != after.joints or _is_slide(before) != _is_slide(after)
    rig = RIGS[0] if rig is None or (rig.slide and not _is_slide(after)) else rig

    def edit(document: Document) -> None:
        _begin_anew(document)
        _put_arm(document, preset)
        if anew:
            document["drive"] = {"kind": rig.kind, **rig.start(after.joints)}

    return edit


def _is_slide(arm: Arm) -> bool:
    return arm.joints == 1 and arm.segments[0].joint == "prismatic"


def _begin_anew(document: Document) -> None:
    """Without what was simulated, and with what is compared chosen anew."""
    kept = [e for e in document.get("recordings", ()) if "simulate" not in e]
    document["recordings"] = thawed(kept)
    identify = document.setdefault("identify", {})
    for name in ("output", "servo_hz", "weights", "offsets"):
        identify.pop(name, None)
    document.pop("model", None)


def _put_arm(document: Document, preset: str) -> None:
    """The arm, and to estimate: what bends; of a rigid one its first mass."""
    bends = [k + 1 for k, modes in enumerate(presets()[preset].modes) if modes]
    document["arm"] = {"preset": preset}
    document["identify"] = {"parameters": [f"EI{k}" for k in bends] or ["m1"]}
