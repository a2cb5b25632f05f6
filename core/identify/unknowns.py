"""What is estimated: parameters shared by all recordings or belonging to one, as one vector."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..identify.first_states import START, first_state_names
from ..model import Model
from ..parameters import Parameter, ParameterSet
from ..recording.recording import Beginning, Recording
from ..results.identification import labelled
from ..scenario.schema import IdentifySpec, Scenario
from ..scenario.stated_effects import base_model, candidate_effects, with_effect_parameters
from ..sensors import sensors
from ..sentences import did_you_mean
from ..validation import naming_scenario

OFFSET, GAIN = "offset_", "gain_"

WIDE = 1e3
"""Bounds of offsets and initial states, in units of their scale; only to be finite."""


@dataclass(frozen=True)
class Unknown:
    """One entry of the vector: a parameter and the recording it belongs to (None: all)."""

    parameter: Parameter
    recording: str | None = None
    searched: bool = True
    """Whether the evolution searches it; offsets, gains and initial states are nearly linear and
    left to refinement."""

    @property
    def label(self) -> str:
        """Its parameter's name, with the recording where it belongs to one."""
        return labelled(self.parameter.name, self.recording)


@dataclass(frozen=True)
class Unknowns:
    """The layout of the vector (P,)."""

    items: tuple[Unknown, ...]

    def __len__(self) -> int:
        return len(self.items)

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels in the order of the vector."""
        return tuple(item.label for item in self.items)

    @property
    def parameters(self) -> ParameterSet:
        """The unknowns as parameters named by their labels."""
        return ParameterSet(tuple(replace(item.parameter, name=item.label) for item in self.items))

    def values_for(self, recording: str | None, vector: np.ndarray) -> dict[str, float]:
        """name -> value as one recording sees the vector (P,); None: only what all share."""
        return {
            item.parameter.name: float(value)
            for item, value in zip(self.items, vector, strict=True)
            if item.recording in (None, recording)
        }

    def concerning(self, recording: str) -> np.ndarray:
        """(P,) bool: entries on which a recording's prediction depends."""
        return np.array([item.recording in (None, recording) for item in self.items], dtype=bool)


def collect_unknowns(model: Model, spec: IdentifySpec, recordings: Sequence[Recording]) -> Unknowns:
    """The vector that a scenario's [identify] asks for."""
    names = list(spec.parameters) + [n for n in spec.per_recording if n not in spec.parameters]
    names += [OFFSET + channel for channel in spec.offsets if OFFSET + channel not in names]
    own = dict.fromkeys([*spec.per_recording, *(OFFSET + c for c in spec.offsets)], recordings)
    starting = [r for r in recordings if starts_unknown(spec, r)]
    if starting:
        starts = first_state_names(model, min(r.sample_time for r in starting))
        names += [n for n in starts if n not in names]
        own = dict.fromkeys(starts, starting) | own
    _check_mentioned(spec, names)
    items: list[Unknown] = []
    for name in names:
        parameter = _stated(_parameter(model, name, recordings), spec)
        searched = not name.startswith((OFFSET, GAIN, START))
        if name in own:
            items += [Unknown(parameter, recording.name, searched) for recording in own[name]]
        else:
            items.append(Unknown(parameter, None, searched))
    return Unknowns(tuple(items))


@naming_scenario
def check_names(scenario: Scenario) -> None:
    """InputError for an unknown parameter, effect or channel, before any recording is read."""
    model = base_model(scenario)
    candidate_effects(scenario.diagnose)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    offsets = (OFFSET + channel for channel in spec.offsets)
    for name in (*spec.parameters, *spec.per_recording, *offsets):
        _parameter(model, name, ())


def starts_unknown(spec: IdentifySpec, recording: Recording) -> bool:
    """Whether the state in which a recording begins is estimated."""
    stated = spec.initial_state
    rests = recording.beginning in (Beginning.REST, Beginning.EQUILIBRIUM)
    return not rests if stated is None else stated


def with_first_states_of(
    items: Sequence[Unknown], model: Model, sample_time: float
) -> tuple[Unknown, ...]:
    """The unknowns of the same recordings, the fastest with samples every `sample_time` s, for a
    model with other bending shapes."""
    names = first_state_names(model, sample_time)
    rates = f"{START}d"
    moving = dict.fromkeys(u.recording for u in items if u.parameter.name.startswith(rates))
    known = {(u.recording, u.parameter.name): u for u in items}
    states = [
        known.get((r, name)) or Unknown(start_parameter(model, name.removeprefix(START)), r, False)
        for r in moving for name in names
    ]  # fmt: skip
    others = [
        u for u in items if u.recording not in moving or not u.parameter.name.startswith(START)
    ]
    return (*others, *states)


def is_neutral(values: Mapping[str, float]) -> bool:
    """Whether offsets, gains and initial deviations are neutral."""
    gains = all(value == 1.0 for name, value in values.items() if name.startswith(GAIN))
    shifts = (value for name, value in values.items() if name.startswith((OFFSET, START)))
    return gains and not any(shifts)


def _check_mentioned(spec: IdentifySpec, names: Sequence[str]) -> None:
    """Bounds and priors must concern estimated parameters."""
    for setting in ("bounds", "prior"):
        for name in getattr(spec, setting):
            if name not in names:
                raise InputError(
                    f"[identify] {setting} names {name!r}, which is not estimated; "
                    f"{did_you_mean(name, names)}"
                )


def _parameter(model: Model, name: str, recordings: Sequence[Recording]) -> Parameter:
    for prefix, make in ((OFFSET, _offset), (GAIN, _gain)):
        if name.startswith(prefix):
            return make(model, name.removeprefix(prefix), recordings)
    if name.startswith(START):
        return start_parameter(model, name.removeprefix(START))
    return model.parameter(name)


def _channel_unit(model: Model, channel: str) -> str:
    units = {c.name: c.unit for s in sensors().values() for c in s.channels(model.arm)}
    if channel not in units:
        raise InputError(
            f"[identify] {channel!r} is not an output of this arm; {did_you_mean(channel, units)}"
        )
    return units[channel]


def _spread(channel: str, recordings: Sequence[Recording]) -> float:
    sizes = [np.nanstd(r[channel]) for r in recordings if r.has(channel)]
    return float(max([size for size in sizes if np.isfinite(size) and size > 0.0], default=1.0))


def _offset(model: Model, channel: str, recordings: Sequence[Recording]) -> Parameter:
    unit, scale = _channel_unit(model, channel), _spread(channel, recordings)
    title = f"offset of {channel}"
    symbol = rf"o_{{\mathrm{{{channel}}}}}"
    return Parameter(
        OFFSET + channel, 0.0, unit, -WIDE * scale, WIDE * scale, symbol, title, scale=scale
    )


def _gain(model: Model, channel: str, recordings: Sequence[Recording]) -> Parameter:
    _channel_unit(model, channel)
    symbol = rf"\gamma_{{\mathrm{{{channel}}}}}"
    return Parameter(GAIN + channel, 1.0, "", 0.1, 10.0, symbol, f"gain of {channel}")


def gain_parameter(model: Model, name: str, value: float, unit: str) -> Parameter:
    """A gain that nobody states, about a first estimate in its `unit`; one of a drive keeps its
    sign."""
    if name.startswith(GAIN):
        plain, size = _gain(model, name.removeprefix(GAIN), ()), abs(value)
        return replace(
            plain, value=value, unit=unit, lower=-WIDE * size, upper=WIDE * size, scale=size
        )
    low, high = sorted((value / WIDE, value * WIDE))
    return replace(model.parameter(name), value=value, lower=low, upper=high, scale=abs(value))


def start_parameter(model: Model, coordinate: str) -> Parameter:
    """Difference of an initial coordinate or rate from the encoders (zero bending)."""
    bare = coordinate.removeprefix("d") if coordinate.startswith("d") else coordinate
    if bare not in model.arm.coordinate_names:
        raise InputError(
            f"[identify] {START + coordinate!r} is not a coordinate; "
            f"{did_you_mean(bare, model.arm.coordinate_names)}"
        )
    unit = "1/s" if coordinate.startswith("d") else ""
    title = f"initial deviation of {coordinate}"
    scale = 0.1 if coordinate.startswith("d") else 0.01
    return Parameter(
        START + coordinate, 0.0, unit, -WIDE * scale, WIDE * scale,
        rf"\mathrm{{{coordinate}}}(0)", title, scale=scale,
    )  # fmt: skip


def _stated(parameter: Parameter, spec: IdentifySpec) -> Parameter:
    """The parameter with the scenario's bounds, start and prior."""
    name = parameter.name
    value = spec.start.get(name, parameter.value)
    lower, upper = spec.bounds.get(name, (parameter.lower, parameter.upper))
    prior = spec.prior.get(name)
    std = mean = None
    if prior is not None:
        std, mean = prior.std, prior.value
        value = prior.value if prior.value is not None and name not in spec.start else value
    return replace(
        parameter, value=value, lower=lower, upper=upper, prior_std=std,
        prior_mean=value if std is not None and mean is None else mean,
    )  # fmt: skip


def fixed_values(model: Model, spec: IdentifySpec, unknowns: Unknowns) -> Mapping[str, float]:
    """Starts that the scenario states for parameters it does not estimate: they are held there."""
    estimated = {item.parameter.name for item in unknowns.items}
    fixed = {name: value for name, value in spec.start.items() if name not in estimated}
    own = {n: x for n, x in fixed.items() if not n.startswith((OFFSET, GAIN, START))}
    model.check_values(own, "[identify] start")
    return fixed
