"""The data sheet of a rig: what a person states of arm, drive and sensors, as rows of numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import ArmSpec, build_arm
from flexgui.core.arm.mount import Mount
from flexgui.core.drives.drive import drive_classes
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sensors import sensors
from flexgui.core.sensors.link_sensor import LinkSensor
from flexgui.core.sentences import listed
from flexgui.session.scenario_edits import Edit, ScenarioDict, cached_model, with_lists
from flexgui.stages.data.rigs import CONSTANTS, begin_again, to_estimate

Value = float | None
"""In the row's unit; None: not stated."""


class Quantity(NamedTuple):
    """A setting with one number per link, joint or axis."""

    setting: str
    label: str
    unit: str
    factor: float = 1.0
    """SI per unit."""
    hint: str = ""
    whole: bool = False
    required: bool = False


LINK = (
    Quantity("length", "Length", "m", required=True),
    Quantity("mass", "Mass", "kg", hint="Of the link alone, without its motor.", required=True),
    Quantity("EI", "Stiffness EI", "N m²", hint="Young modulus times second moment of area. "
             "Empty: the link is rigid."),
    Quantity("modes", "Bending modes", "", hint="0: rigid; 1 to 3.", whole=True,
             required=True),
    Quantity("centre_of_mass", "Centre of mass", "m", hint="Of a rigid link, from its joint along "
             "it. Empty: the middle."),
    Quantity("inertia", "Inertia of link", "kg m²", hint="Of a rigid link about its centre of "
             "mass. Empty: mass × length² / 12."),
    Quantity("hub_inertia", "Inertia of geared motor", "kg m²", hint="Rotor and gear as the "
             "joint feels it (times the gear ratio squared)."),
    Quantity("rotor_inertia", "Inertia of direct drive", "kg m²", hint="Of the rotor of a motor "
             "without a gear."),
    Quantity("tip_mass", "Load at its end", "kg", hint="Next motor, flange or payload."),
)  # fmt: skip
GRAVITY = Quantity("gravity", "Gravity along x, y", "m/s²", hint="0, 0: the arm lies flat.")
LIMITS = Quantity("limits", "Largest torque", "N m", hint="Where the amplifier saturates. Empty: "
                  "never.")  # fmt: skip
NOISE_UNITS = {"m": ("mm", 1e-3), "rad": ("mrad", 1e-3), "": ("µm/m", 1e-6)}
"""SI unit of a sensor -> the unit in which its noise is a usual number."""


PLACE = Quantity("place", "place", "m", hint="From the link's joint. Empty: a gauge is at the "
                 "root, other sensors are at the end.")  # fmt: skip
DISTANCE = Quantity("distance", "from neutral fibre", "mm", 1e-3, hint="Half the thickness, with a "
                    "sign. Empty: unknown, so the gauge's scale is estimated.")  # fmt: skip


@dataclass(frozen=True)
class SheetRow:
    """One quantity with its values."""

    table: str
    """Where the setting stands in the scenario: arm, segments, drive, sensors or one of these."""
    quantity: Quantity
    values: tuple[Value, ...]

    def key(self, k: int) -> str:
        """The name of the k-th field."""
        return f"{self.table}.{self.quantity.setting}.{k}"

    def text(self, k: int) -> str:
        """The k-th value as it is shown."""
        value = self.values[k]
        return "" if value is None else f"{value:.6g}"


def sheet_rows(scenario: Scenario) -> tuple[SheetRow, ...]:
    """What can be stated of the scenario's rig, with the present values."""
    arm = build_arm(scenario.arm)
    return (
        *_link_rows(arm),
        SheetRow("arm", GRAVITY, tuple(arm.gravity)),
        *_drive_rows(scenario, arm),
        *_sensor_rows(scenario, arm),
        *_mount_rows(scenario, arm),
    )


def _link_rows(arm: Arm) -> list[SheetRow]:
    rows = []
    for quantity in LINK:
        stated: list[Value] = [getattr(segment, quantity.setting) for segment in arm.segments]
        if quantity.setting == "EI":
            stated = [segment.bending_stiffness or None for segment in arm.segments]
        rows.append(SheetRow("segments", quantity, tuple(stated)))
    return rows


def _drive_rows(scenario: Scenario, arm: Arm) -> list[SheetRow]:
    kind, options = drive_classes()[scenario.drive.kind], scenario.drive.options
    known = [Quantity(s.setting, s.hint.rstrip("."), s.unit) for s in kind.sliders]
    known += [Quantity(name, *unit) for name, unit in CONSTANTS.items() if options.get(name)]
    known += [LIMITS] if LIMITS.setting in kind.model_fields else []
    nothing = (None,) * arm.joints
    return [SheetRow("drive", each, tuple(options.get(each.setting) or nothing)) for each in known]


def _sensor_rows(scenario: Scenario, arm: Arm) -> list[SheetRow]:
    """Those that most rigs have, and any whose noise is stated."""
    rows = []
    for sensor in sensors().values():
        noise = scenario.sensors.noise_of(sensor.noise)
        channels = sensor.channels(arm) if sensor.noise and sensor.defined_on(arm) else ()
        if not channels:
            continue
        rare = sensor.optional or not sensor.primary
        if noise is None and rare and not _recorded(scenario, [c.name for c in channels]):
            continue
        si = channels[0].unit
        unit, factor = NOISE_UNITS.get(si, (si, 1.0))
        quantity = Quantity(sensor.noise, f"Noise, {sensor.title}", unit, factor, NOISE_HINT)
        rows.append(SheetRow("sensors", quantity, (None if noise is None else noise / factor,)))
    return rows


def _mount_rows(scenario: Scenario, arm: Arm) -> list[SheetRow]:
    """Where recorded sensors sit on their links."""
    rows = []
    for sensor in sensors().values():
        if not isinstance(sensor, LinkSensor):
            continue
        for name in _recorded(scenario, [c.name for c in sensor.channels(arm)]):
            mount = scenario.sensors.mounts.get(name, Mount())
            for each in (PLACE, DISTANCE)[: 2 if sensor.on_bending_links else 1]:
                value = getattr(mount, each.setting)
                own = each._replace(label=f"{name}, {each.label}")
                shown = None if value is None else value / each.factor
                rows.append(SheetRow(f"sensors.{name}", own, (shown,)))
    return rows


def _recorded(scenario: Scenario, names: Sequence[str]) -> list[str]:
    """Those of some channels that a recording's columns or `[sensors]` name."""
    known = {n for r in scenario.recordings for n in r.columns} | scenario.sensors.mounts.keys()
    return [name for name in names if name in known]


NOISE_HINT = "Standard deviation. Empty: it is estimated from the recordings."


def sheet_edit(scenario: Scenario, texts: Mapping[str, str]) -> Edit:
    """Edit that states the values of a sheet; InputError names the first entry that is none.

    Args:
        scenario: Whose sheet was filled in.
        texts: Name of a field (`SheetRow.key`) -> what stands in it; other fields stay as they are.
    """
    rows = sheet_rows(scenario)
    changes = {row: _changed(row, texts) for row in rows}
    arm = build_arm(scenario.arm)

    def edit(document: ScenarioDict) -> None:
        links = [(r, v) for r, v in changes.items() if r.table == "segments" and v != r.values]
        spec = document.setdefault("arm", {})
        spec["name"] = spec.get("name") or STATED
        if links:
            document["arm"] = _with_segments(spec, _segments(arm, links))
        for row, values in changes.items():
            if row.table != "segments" and values != row.values:
                table = document
                for part in row.table.split("."):
                    table = table.setdefault(part, {})
                _put(table, row, values)
        _choose_parameters(document, arm)

    return edit


STATED = "as stated"
"""The name of an arm whose sheet a person has filled in."""


def is_stated(scenario: Scenario) -> bool:
    """Whether the arm is not simply one that comes with FlexGUI."""
    spec = scenario.arm
    return spec.preset is None or spec.name is not None or bool(spec.segments or spec.overrides)


def estimated(scenario: Scenario) -> str:
    """What a fit does not take as stated: parameters, and the scales of what is recorded whose
    sensors are not stated, with their names in words."""
    model = cached_model(scenario)
    names = [n for n in scenario.identify.parameters if n in model.parameters]
    scales = [
        f"scale of {name}"
        for sensor in sensors().values()
        for name in _recorded(scenario, [c.name for c in sensor.channels(model.arm)])
        if sensor.gain_unit(model.arm, name) is not None
    ]
    return listed([*(f"{model.parameters[n].title} ({n})" for n in names), *scales])


def _changed(row: SheetRow, texts: Mapping[str, str]) -> tuple[Value, ...]:
    """The values of a row; those whose text was not touched keep all their digits."""
    values = list(row.values)
    for k in range(len(values)):
        text = texts.get(row.key(k), row.text(k)).strip()
        if text != row.text(k):
            values[k] = _number(text, row, k)
    stated = [value for value in values if value is not None]
    if row.table == "drive" and 0 < len(stated) < len(values):
        raise InputError(f"{row.quantity.label}: give one number per joint, or none at all.")
    return tuple(values)


def _number(text: str, row: SheetRow, k: int) -> Value:
    quantity = row.quantity
    if not text:
        if quantity.required:
            raise InputError(f"{_place(row, k)}: a number is needed.")
        return None
    try:
        value = float(text.replace(",", ".").replace("−", "-"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or (quantity.whole and value != round(value)):
        kind = "a whole number" if quantity.whole else "a number"
        raise InputError(f"{_place(row, k)}: {text!r} is not {kind}.")
    return int(value) if quantity.whole else value


def _place(row: SheetRow, k: int) -> str:
    """'Length of link 2'"""
    label = row.quantity.label
    if len(row.values) == 1:
        return label
    return f"{label} of {'link' if row.table == 'segments' else 'joint'} {k + 1}"


def _segments(arm: Arm, changed: Sequence[tuple[SheetRow, tuple[Value, ...]]]) -> list[Any]:
    """The tables of all segments, with what was changed."""
    tables = _tables(arm)
    for row, values in changed:
        setting = row.quantity.setting
        for table, before, value in zip(tables, row.values, values, strict=True):
            if value == before:
                continue
            if setting == "EI":
                for name in ("width", "young_modulus", "EI"):
                    table.pop(name, None)
                table["modes"] = 0 if value is None else table.get("modes", 1) or 1
            if value is None:
                table.pop(setting, None)
            else:
                table[setting] = value
    return tables


def _tables(arm: Arm) -> list[ScenarioDict]:
    return [s.model_dump(exclude_none=True, exclude_defaults=True) for s in arm.segments]


def _with_segments(spec: ScenarioDict, tables: list[Any]) -> ScenarioDict:
    """`[arm]` with segments of its own, and what it says beyond them."""
    arm = {name: spec[name] for name in ("name", "gravity", "base_compliance", "pedestal")
           if spec.get(name) is not None}  # fmt: skip
    return {**arm, "segments": tables}


def _put(table: ScenarioDict, row: SheetRow, values: tuple[Value, ...]) -> None:
    setting, factor = row.quantity.setting, row.quantity.factor
    stated = [value * factor for value in values if value is not None]
    if not stated:
        table.pop(setting, None)
    else:
        table[setting] = stated[0] if row.table.startswith("sensors") else stated


def _choose_parameters(document: ScenarioDict, before: Arm) -> None:
    """Estimates what bends, where the sheet has changed what can be estimated."""
    after = build_arm(ArmSpec.model_validate(document["arm"]))
    kinds = [(s.has_section, s.modes > 0) for s in before.segments]
    if kinds != [(s.has_section, s.modes > 0) for s in after.segments]:
        identify = document.setdefault("identify", {})
        for name in ("bounds", "start", "prior", "per_recording"):
            identify.pop(name, None)
        identify["parameters"] = to_estimate(after)


def with_links(scenario: Scenario, count: int) -> Edit:
    """Edit that gives the arm another number of links: as the last one where there are more."""
    arm = build_arm(scenario.arm)
    tables = _tables(arm)
    tables = [*tables, *[dict(tables[-1])] * count][:count]

    def edit(document: ScenarioDict) -> None:
        begin_again(document)
        document["arm"] = _with_segments(document.get("arm", {}), tables)
        document["arm"]["name"] = STATED
        for setting, values in document.get("drive", {}).items():
            if isinstance(values, list) and len(values) == arm.joints:
                document["drive"][setting] = with_lists([*values, *[values[-1]] * count][:count])
        made = build_arm(ArmSpec.model_validate(document["arm"]))
        document["identify"] = {"parameters": to_estimate(made)}

    return edit
