"""Choices before there is data: the kind of rig, and experiments to simulate."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os.path import commonprefix
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import build_arm
from flexgui.core.arm.presets import presets
from flexgui.core.recording.channels import is_reference
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import EMBEDDED
from flexgui.sentences.written import angle
from flexgui.session.scenario_edits import Edit, ScenarioDict, cached_model, with_lists

Options = Mapping[str, Any]


@dataclass(frozen=True)
class RigKind:
    """One kind of rig of the list."""

    title: str
    kind: str
    """Of the drive."""
    start: Callable[[int], dict[str, Any]]
    """Joints -> settings to begin with; a person puts in those of the data sheet."""
    slide: bool = False
    """Whether the arm is a single slide."""
    fits: Callable[[Options], bool] = lambda options: True
    """Whether a drive of this kind with these settings is this rig."""
    signs: frozenset[str] = frozenset()
    """Words and units in headings, one of which must be there to recognise this rig."""


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
    RigKind("Slide, force recorded", "torque", lambda n: {}, slide=True,
            signs=frozenset({"force", "slide", "rail", "carriage", "[n]", "[m]", "[mm]"})),
)  # fmt: skip

CONSTANTS = {
    "torque_constants": ("Torque constant", "N m/A"),
    "resistances": ("Resistance", "Ω"),
    "gears": ("Gear ratio", ""),
}
"""Settings with one number per joint that a motor's data sheet states: their names and units."""


def rig_of(scenario: Scenario) -> RigKind | None:
    """The scenario's kind of rig; None if it is not in the list."""
    arm = build_arm(scenario.arm)
    slide = _is_slide(arm)
    options = scenario.drive.options
    alike = [r for r in RIGS if r.kind == scenario.drive.kind and r.fits(options)]
    return next((r for r in alike if r.slide == slide), alike[0] if alike else None)


def rig_edit(scenario: Scenario, rig: RigKind) -> Edit:
    """Changes the rig: removes simulated recordings and chooses the compared outputs again."""
    was_slide = _is_slide(build_arm(scenario.arm))
    arm = "single_axis" if rig.slide else "paper" if was_slide else ""

    def edit(document: ScenarioDict) -> None:
        begin_again(document)
        if arm:
            _put_arm(document, arm)
        joints = presets()[arm].joints if arm else build_arm(scenario.arm).joints
        document["drive"] = {"kind": rig.kind, **rig.start(joints)}

    return edit


def arm_choices() -> dict[str, str]:
    """Title -> preset of the supplied arms."""
    return {preset.replace("_", " ").capitalize(): preset for preset in presets()}


def arm_edit(scenario: Scenario, preset: str) -> Edit:
    """Uses a supplied arm; keeps the drive if it has as many joints."""
    before, after = build_arm(scenario.arm), presets()[preset]
    rig = next((r for r in RIGS if r.slide), RIGS[0]) if _is_slide(after) else rig_of(scenario)
    is_other_kind = before.joints != after.joints or _is_slide(before) != _is_slide(after)
    rig = RIGS[0] if rig is None or (rig.slide and not _is_slide(after)) else rig

    def edit(document: ScenarioDict) -> None:
        begin_again(document)
        _put_arm(document, preset)
        if is_other_kind:
            document["drive"] = {"kind": rig.kind, **rig.start(after.joints)}

    return edit


def _is_slide(arm: Arm) -> bool:
    return arm.joints == 1 and arm.segments[0].joint == "prismatic"


def begin_again(document: ScenarioDict) -> None:
    """Removes simulated recordings and chooses the compared outputs again."""
    measured = [e for e in document.get("recordings", ()) if "simulate" not in e]
    document["recordings"] = with_lists(measured)
    identify = document.setdefault("identify", {})
    for name in ("output", "servo_hz", "torques_logged", "weights", "offsets"):
        identify.pop(name, None)
    document.pop("model", None)


def _put_arm(document: ScenarioDict, preset: str) -> None:
    document["arm"] = {"preset": preset}
    document["identify"] = {"parameters": to_estimate(presets()[preset])}


def to_estimate(arm: Arm) -> list[str]:
    """Bending parameters to estimate; of a rigid arm its first mass."""
    bends = [f"EI{k + 1}" for k, modes in enumerate(arm.modes) if modes]
    return bends or ["m1"]


def title_of(names: Sequence[str]) -> str:
    """What recordings are called together: 'posture', or the first one and how many more."""
    common = commonprefix(names).strip(" _-.") if len(names) > 1 else names[0]
    common = common.rstrip("0123456789").strip(" _-.") if len(names) > 1 else common
    return common or f"{names[0]} and {len(names) - 1} more"


def titled_edit(scenario: Scenario) -> Edit:
    """Edit that names the scenario after its files, unless a person has given it a title."""
    shipped = {made().title for made in EMBEDDED.values()}
    before = [spec.name for spec in scenario.recordings if spec.file is not None]

    def edit(document: ScenarioDict) -> None:
        names = [str(entry.get("name") or Path(entry["file"]).stem)
                 for entry in document["recordings"] if "file" in entry]  # fmt: skip
        if names and scenario.title in shipped | ({title_of(before)} if before else set()):
            document["title"] = title_of(names)

    return edit


def measured_edit(scenario: Scenario) -> Edit:
    """Defaults for own recordings: full equations, all outputs; explicit settings are kept."""
    shipped = [made() for made in EMBEDDED.values()]
    same = [one for one in shipped if scenario.identify.parameters == one.identify.parameters]
    levels = {"auto", *(one.model.level for one in shipped)}

    def edit(document: ScenarioDict) -> None:
        if same:
            before, now = [one.identify for one in same], document["identify"]
            own = {
                k: value
                for k, value in now.items()
                if all(getattr(scenario.identify, k) != getattr(one, k) for one in before)
            }
            document["identify"] = own | {"parameters": to_estimate(build_arm(scenario.arm))}
        if scenario.model.level in levels:
            document.setdefault("model", {})["level"] = "nonlinear"
        if any(scenario.sensors == one.sensors for one in shipped):
            document.pop("sensors", None)

    return edit


@dataclass(frozen=True)
class Experiments:
    """Experiments to simulate; by default the paper's seven working points."""

    first: float = math.pi / 8.0
    """rad"""
    last: float = 7.0 * math.pi / 8.0
    count: int = 7
    seconds: float = 3.0
    excitation: str = "prbs_balanced"
    amplitude: float = 0.3
    """rad/s"""
    seed: int = 1
    sweep: bool = True
    """Whether a validation sweep over the same range is made, without noise."""

    def edit(self, snr_db: float | None) -> Edit:
        """Replaces all simulated recordings by these with noise of `snr_db` in dB; files stay."""
        entries = self._entries(snr_db)

        def change(document: ScenarioDict) -> None:
            measured = [r for r in document.get("recordings", ()) if "simulate" not in r]
            names = {r.get("name") for r in measured}
            fresh = [r for r in entries if r["name"] not in names]
            document["recordings"] = [*fresh, *measured]

        return change

    def _entries(self, snr_db: float | None) -> list[dict[str, Any]]:
        common: dict[str, Any] = {
            "seconds": self.seconds, "excitation": self.excitation, "amplitude": self.amplitude,
        }  # fmt: skip
        noise = {} if snr_db is None else {"snr_db": snr_db}
        entries: list[dict[str, Any]] = []
        for k, theta2 in enumerate(np.linspace(self.first, self.last, self.count)):
            simulate = {"theta2": round(float(theta2), 10), "seed": self.seed + k}
            simulate |= common | noise
            entries.append({"name": point_name(float(theta2)), "simulate": simulate})
        if self.sweep and self.last > self.first:
            moving: dict[str, Any] = {
                "sweep": [round(self.first, 10), round(self.last, 10)], "seconds": 10.0,
                "excitation": "prbs", "seed": self.seed + 100,
            }  # fmt: skip
            entries.append({"name": "sweep", "role": "validate", "simulate": moving})
        return entries


def has_working_points(scenario: Scenario) -> bool:
    """Whether the rig can run these experiments: references and a second joint."""
    model = cached_model(scenario)
    references = model.drive.reference_channels(model.arm)
    follows = any(is_reference(name) for name in references)
    return model.arm.joints > 1 and follows and model.drive.torque_known


def point_name(theta2: float) -> str:
    """'θ2 = 3π/8' for theta2 in rad, or in degrees if it is not a multiple of π/8."""
    return f"θ2 = {angle(theta2)}"
