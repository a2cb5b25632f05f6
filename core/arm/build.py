"""From the `[arm]` of a scenario to an arm: a preset, changed segment by segment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from ..arm.arm import Arm, Pedestal
from ..arm.presets import presets
from ..arm.segment import Segment
from ..errors import InputError
from ..sentences import did_you_mean, one_line, predicate
from ..validation import Positive, gathered, validated

_SECTION = ("width", "young_modulus")


class ArmSpec(BaseModel):
    """`[arm]`: a preset or `segments`, and any segment's setting as an override.

    An override is one value for every segment or a list with one value per segment.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: str | None = None
    """An arm that comes with FlexGUI."""
    name: str | None = None
    """For display."""
    gravity: tuple[FiniteFloat, FiniteFloat] | None = None
    """m/s^2"""
    base_compliance: Positive | None = None
    """m/N, the same in both directions; None: the base does not move."""
    pedestal: Pedestal | None = None
    """What turns under the arm; None: the base does not turn."""
    segments: tuple[dict[str, Any], ...] = ()
    """Alone: the segments. On top of a preset: what differs from each of its segments."""
    overrides: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _gather_overrides(cls, data: Any) -> Any:
        """In the file the overrides stand in `[arm]` itself, beside `preset`."""
        return gathered(data, lambda key: key in Segment.model_fields, "overrides")

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        table: dict[str, Any] = handler(self)
        return {**table, **table.pop("overrides", {})}

    @classmethod
    def known_settings(cls) -> list[str]:
        """What may stand in `[arm]`."""
        own = [name for name in cls.model_fields if name != "overrides"]
        return own + list(Segment.model_fields)


def build_arm(spec: ArmSpec, base: Arm | None = None, label: str = "[arm]") -> Arm:
    """The arm that `spec` describes, as a change of `base` where it states no preset; messages name
    `label`."""
    below = _below(spec, base, label)
    tables = _laid_over(below, spec.segments, label)
    tables = [
        _changed(t, o) for t, o in zip(tables, _spread(spec, len(tables), label), strict=True)
    ]
    segments = tuple(_segment(table, k, label) for k, table in enumerate(tables))
    names = ArmSpec.model_fields.keys() & Arm.model_fields.keys() - {"segments"}
    stated = {name: getattr(spec, name) for name in sorted(names)}
    own = {name: value for name, value in stated.items() if value is not None}
    return validated(Arm, {**dict(below or {}), **own, "segments": segments}, label)


def _below(spec: ArmSpec, base: Arm | None, label: str) -> Arm | None:
    """The arm that the spec starts from; None where its segments stand alone."""
    if spec.preset is not None:
        arms = presets()
        if spec.preset not in arms:
            hint = did_you_mean(spec.preset, arms)
            raise InputError(one_line(f"{label} preset {spec.preset!r} is not known; {hint}"))
        return arms[spec.preset]
    if base is None and not spec.segments:
        hint = ", ".join(sorted(presets()))
        raise InputError(f"{label} needs a preset ({hint}) or segments of its own.")
    return base


def _laid_over(
    below: Arm | None, segments: tuple[dict[str, Any], ...], label: str
) -> list[dict[str, Any]]:
    if below is None:
        return [dict(table) for table in segments]
    tables = [segment.model_dump(exclude_none=True) for segment in below.segments]
    if not segments:
        return tables
    if len(segments) != len(tables):
        raise InputError(
            f"{label} segments has {len(segments)} entries where the arm {below.name} has "
            f"{len(tables)} segments; give one per segment, or leave out the preset."
        )
    return [_changed(table, change) for table, change in zip(tables, segments, strict=True)]


def _changed(table: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """A segment's table with a change; stiffness and section are two ways to say one thing."""
    kept = dict(table)
    if "EI" in change:
        kept = {k: v for k, v in kept.items() if k not in _SECTION}
    elif any(name in change for name in _SECTION):
        kept.pop("EI", None)
    return {**kept, **change}


def _spread(spec: ArmSpec, count: int, label: str) -> list[dict[str, Any]]:
    """The overrides as one table per segment."""
    tables: list[dict[str, Any]] = [{} for _ in range(count)]
    for name, value in spec.overrides.items():
        values = list(value) if isinstance(value, list | tuple) else [value] * count
        if len(values) != count:
            raise InputError(
                f"{label} {name} has {len(values)} entries where the arm has {count} segments; "
                f"give one per segment, or one value for all."
            )
        for table, entry in zip(tables, values, strict=True):
            table[name] = entry
    return tables


def _segment(table: Mapping[str, Any], index: int, label: str) -> Segment:
    try:
        return Segment.model_validate(dict(table))
    except ValidationError as error:
        faults: list[Any] = list(error.errors(include_url=False))
        fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
        raise InputError(one_line(f"{label} {_segment_fault(fault, index)}")) from None


def _segment_fault(fault: Mapping[str, Any], index: int) -> str:
    if not fault["loc"]:
        return f"segment {index + 1}: {predicate(fault)}."
    key = str(fault["loc"][0])
    if fault["type"] == "extra_forbidden":
        hint = did_you_mean(key, Segment.model_fields)
        return f"{key} of segment {index + 1} is not a setting; {hint}"
    return f"{key} of segment {index + 1} {predicate(fault)}"
