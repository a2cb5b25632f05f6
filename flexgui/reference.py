"""The scenario's reference as Markdown, generated from the schema and the catalogues."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.catalogue import ArmCatalogue
from flexgui.core.arm.presets import presets
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.drive import Drive, drive_classes
from flexgui.core.effects import catalogue
from flexgui.core.effects.effect import Effect
from flexgui.core.effects.sizes import typical
from flexgui.core.excitation.excitation import Excitation
from flexgui.core.field_texts import HEAD, field_texts
from flexgui.core.plugins import classes_of
from flexgui.core.recording.channels import known_kinds
from flexgui.core.scenario.rig_spec import EffectParameterSpec, SensorsSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sensors import sensors
from flexgui.core.sentences import first_sentence, one_line
from flexgui.export.template import environment
from flexgui.sentences.written import format_number
from flexgui.views.of_recording import recording_views

GATHERED = ("overrides", "further")
"""Fields that hold what stands beside the others in the file."""


def reference_text() -> str:
    """Write the whole reference as Markdown; the same on every machine."""
    plain = environment().overlay(autoescape=False, keep_trailing_newline=True)
    tables: list[type[BaseModel]] = [*_tables(Scenario), Segment, EffectParameterSpec]
    text = plain.get_template("scenario.md.j2").render(
        models={table.__name__: table for table in tables},
        presets=presets(),
        drives=sorted(drive_classes().items()),
        excitations=sorted(classes_of("flexgui.core.excitation", Excitation).items()),
        effects=sorted(catalogue().items()),
        sensors=list(_sensors()),
        further_noise=_further_noise(),
        columns=known_kinds(),
        views=recording_views(),
        doc=_doc, rows_of=_rows, parameters_of=_parameters, sizes_of=_sizes, columns_of=_columns,
    )  # fmt: skip
    return text.rstrip("\n") + "\n"


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    """The classes of all tables in a scenario, each with those in it."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from _tables(field.annotation)
    for inner in get_args(annotation):
        yield from _tables(inner)


def _parameters(arm: Arm) -> list[tuple[str, ...]]:
    return [
        (f"`{p.name}`", p.title or p.name, _number(p.value), p.unit)
        for p in ArmCatalogue(arm).parameters.values()
        if p.value
    ]


def _columns(drive: type[Drive]) -> list[str]:
    """That an arm of two joints needs; no drive's settings but these change them."""
    arm = presets()["paper"]
    return list(drive.model_construct(torque_constants=None).needed_channels(arm))


def _sensors() -> Iterator[tuple[str, ...]]:
    arm = presets()["paper"]
    for kind, one in sorted(sensors().items()):
        channels = ", ".join(f"{c.name} [{c.unit}]" for c in one.channels(arm))
        noise = f"`{one.noise}`" if one.noise else ""
        yield f"`{kind}`", one.title, channels, noise, first_sentence(_doc(type(one)))


def _further_noise() -> list[tuple[str, str]]:
    """Of sensors that are not in the schema."""
    own = {one.noise: one.title for one in sensors().values() if one.noise}
    further = own.keys() - SensorsSpec.model_fields.keys()
    return [(f"`{name}`", f"noise of the {own[name]}, SI") for name in sorted(further)]


def _sizes(effect: Effect) -> list[tuple[str, ...]]:
    """Of an effect's parameters on the paper's arm."""
    grown = effect.changed_arm(presets()["paper"], {})
    drive = drive_classes()["velocity_loop"].model_validate({"gains": (60.0, 30.0)})
    return [
        (
            f"`{k.parameter.name}`", k.parameter.title, k.parameter.unit or "1",
            _number(k.parameter.value), _number(k.neutral),
            f"{_number(k.parameter.lower)} … {_number(k.parameter.upper)}",
        )
        for k in effect.parameters(grown, drive, typical(grown))
    ]  # fmt: skip


def _rows(model: type[BaseModel]) -> list[tuple[str, ...]]:
    """Key, type, default and words of each setting."""
    return [
        (f"`{name}`", _type(field.annotation), _default(field), _words(model, name))
        for name, field in model.model_fields.items()
        if name not in GATHERED
    ]


def _type(annotation: Any) -> str:
    """An annotation as a person says it: number, text, list of numbers, table."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(inner[0])
    if origin is Literal:
        return ", ".join(f"`{_toml(each)}`" for each in inner)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(_type(x) for x in inner if x is not NoneType))
    if origin in (tuple, list):
        if inner[-1] is Ellipsis:
            return f"list of {_type(inner[0])}"
        return f"[{', '.join(_type(each) for each in inner)}]"
    if origin is dict:
        return "table"
    plain = {float: "number", int: "integer", bool: "`true`, `false`", str: "text"}
    return plain.get(annotation, "table")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**–**"
    value = field.get_default(call_default_factory=True)
    if value is None or value is PydanticUndefined or value in ((), {}):
        return ""
    return "" if isinstance(value, BaseModel) else f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return _number(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    return format_number(float(value), 4)


def _doc(kind: type) -> str:
    return one_line((inspect.getdoc(kind) or "").partition(HEAD)[0])


def _words(model: type[BaseModel], name: str) -> str:
    """The text below a field in its class, or in one that it derives from; else that of the class
    of its table. TOML has no None: such a key is left out."""
    for kind in model.__mro__:
        texts = dict(field_texts(kind))
        if name in texts:
            return re.sub(r"\bNone\b", "left out", texts[name])
    table = model.model_fields[name].annotation
    return _doc(table) if isinstance(table, type) and issubclass(table, BaseModel) else ""
