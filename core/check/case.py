"""One recording of a scenario, with what several checks need."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..check.channel_relations import relations
from ..check.column_faults import FREE_RANK, ColumnFault, find_fault
from ..check.finding import Finding, Picture
from ..check.gain_and_lag import GAIN_EXPLAINED, LOOP, Relation
from ..check.late_channels import LateResult, late_channel, shape_of
from ..check.link_bending import LinkShape
from ..check.measured_recording import MeasuredRecording, jumps
from ..check.suspect_channels import Suspect, contrast, late_suspects, suspects
from ..check.tip_geometry import TipGeometry
from ..recording.channels import Role, channel_kind, is_reference, role_of
from ..units import parse_header

MOST_POINTS = 600
"""Points of a picture; a screen shows no more."""
ROUNDS = 4
"""Faults hide one another: several are found one after the other."""
SMALLEST, LARGEST = 3, 300
"""A factor of two is a scale as often as a gear; above, a unit."""
WHOLE = 0.03
"""Share by which a gear's factor may differ from a whole number, by friction and noise."""


@dataclass(frozen=True)
class Dynamics:
    """Relations between the channels of a recording, taken as they are."""

    recording: MeasuredRecording
    others: Sequence[Case] = field(default=(), repr=False, compare=False)

    @cached_property
    def shape(self) -> LinkShape | None:
        """The links by this recording's channels as they are; None if none shows them."""
        return shape_of(self.recording)

    @cached_property
    def late(self) -> LateResult | None:
        """Which channel is late, whatever the stiffness."""
        shapes = (o.dynamics.shape for o in self.others)
        return late_channel(self.recording, [shape for shape in shapes if shape is not None])

    @cached_property
    def stiffness(self) -> dict[str, float]:
        """EI of the segments by the recordings, the median of all; empty if none shows it, and the
        scenario's counts."""
        shapes = (self.shape, *(o.dynamics.shape for o in self.others))
        known_shapes, model = [shape for shape in shapes if shape is not None], self.recording.model
        if not known_shapes or model is None:
            return {}
        factors = np.exp(np.median([np.log(shape.stiffness) for shape in known_shapes], axis=0))
        bending = [k for k, modes in enumerate(model.arm.modes) if modes]
        named = {f"EI{k + 1}": f for k, f in zip(bending, factors, strict=True)}
        return {n: model.parameters[n].value * f for n, f in named.items() if n in model.parameters}

    @cached_property
    def relations(self) -> tuple[Relation, ...]:
        """With the stiffness that explains more."""
        stated = relations(self.recording, shape=self.shape)
        if not self.stiffness:
            return stated
        softer = replace(self.recording, values={**self.recording.values, **self.stiffness})
        fitted = relations(softer, shape=self.shape)
        # A loop that explains little with any stiffness lacks something else, which a fit hides.
        return fitted if _explained(fitted) > max(_explained(stated), GAIN_EXPLAINED) else stated

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """The channels that disagree with all others by a factor or a delay."""
        if self.shape is None:
            return self._by_relations
        return (*self._by_relations, *late_suspects(self.late, self.recording.step))

    @cached_property
    def _by_relations(self) -> tuple[Suspect, ...]:
        """The suspects by the relations alone; without lags where the links show those."""
        own, others = self._own_and_others
        if self.shape is None:
            return suspects(own, others)
        return suspects([r.timeless for r in own], [[r.timeless for r in o] for o in others])

    @property
    def _own_and_others(self) -> tuple[Sequence[Relation], list[Sequence[Relation]]]:
        return self.relations, [other.dynamics.relations for other in self.others]

    @property
    def fault(self) -> ColumnFault | None:
        """The fault with the best correction. A unit and a factor that make a gear are that
        gear."""
        fault = find_fault(self.recording, self.factors, self.shape)
        if fault is None or fault.factor == 1.0 or len(fault.channels) > 1:
            return fault
        after, channel = self.without(fault), fault.channels[0]
        left = [one.factor for one in after.factors if one.channels == fault.channels]
        left = [factor for factor in (*left, contrast(after.relations, channel)) if factor != 1.0]
        both = [_factor_fault(channel, fault.factor * factor) for factor in left]
        gears = [gear for gear in both if gear.fault == "gear_ratio"]
        return max([fault, *gears], key=lambda each: each.improvement(self.recording))

    def without(self, fault: ColumnFault) -> Dynamics:
        """The same relations with a fault corrected."""
        return Dynamics(fault.corrected(self.recording), self.others)

    @property
    def factors(self) -> list[ColumnFault]:
        """Factors, delays and offsets of single channels suggested by camera, encoders and
        dynamics."""
        faults = [
            _factor_fault(suspect.channel, suspect.factor)
            for suspect in self._by_relations
            if suspect.factor != 1.0
        ]
        tip = TipGeometry.of(self.recording)
        own, others = self._own_and_others
        faults += [
            ColumnFault("delay", (suspect.channel,), lag=suspect.delay, rank=FREE_RANK + 1)
            for suspect in suspects(own, others)
            if suspect.delay > 0.0 and is_reference(suspect.channel)
        ]
        if tip is None or tip.misfit() <= tip.tolerance:
            return faults
        faults += [_factor_fault(name, factor) for name, factor in tip.factors()]
        return faults + [
            ColumnFault("offset", (n,), shift=s, rank=FREE_RANK + 1) for n, s in tip.shifts()
        ]


def _jumps(recording: MeasuredRecording) -> Iterator[ColumnFault]:
    """Encoders that are shifted from a sample on."""
    for name in recording.names("theta#"):
        for k, shift in jumps(recording.even(name)):
            since = float(recording.grid[k] - 0.5 * recording.step)
            yield ColumnFault("offset", (name,), shift=shift, since=since)


def _factor_fault(channel: str, factor: float) -> ColumnFault:
    ratio = round(factor)
    whole = abs(factor / max(ratio, 1) - 1.0) < max(WHOLE, 0.3 / max(ratio, 1))
    encoder = channel_kind(channel).pattern == "theta#"
    if encoder and SMALLEST <= ratio <= LARGEST and whole:
        return ColumnFault("gear_ratio", (channel,), float(ratio), rank=FREE_RANK)
    return ColumnFault("scale", (channel,), factor, rank=FREE_RANK + 1)


@dataclass(frozen=True)
class Case:
    """What a check looks at."""

    recording: MeasuredRecording
    others: Sequence[Case] = field(default=(), repr=False, compare=False)
    """The scenario's other recordings."""

    @cached_property
    def causes(self) -> tuple[ColumnFault, ...]:
        """Faults of whole columns, one after the other."""
        return self._corrected[0]

    @property
    def corrected(self) -> MeasuredRecording:
        """The recording with those faults corrected."""
        return self._corrected[1].recording

    @property
    def dynamics(self) -> Dynamics:
        """The dynamics of the corrected recording."""
        return self._corrected[1]

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """Late or wrongly scaled channels of the corrected recording."""
        return self.dynamics.suspects

    @cached_property
    def _corrected(self) -> tuple[tuple[ColumnFault, ...], Dynamics]:
        found = self.recording
        for jump in (faults := list(_jumps(found))):
            found = jump.corrected(found)
        dynamics = Dynamics(found, self.others)
        for _ in range(ROUNDS):
            fault = dynamics.fault
            if fault is None:
                break
            faults.append(fault)
            dynamics = dynamics.without(fault)
        return tuple(faults), dynamics

    @property
    def tip_off(self) -> tuple[float, float] | None:
        """m: (disagreement of camera and encoders on the tip, reach); None if they agree once
        columns are corrected."""
        tip = TipGeometry.of(self.corrected)
        off = 0.0 if tip is None else tip.misfit()
        return (off, tip.reach) if tip is not None and off > tip.tolerance else None

    def finding(
        self, fault: str, channel: str, size: float, unit: str, evidence: str,
        fix: str | None = None, expected: np.ndarray | None = None,
    ) -> Finding:  # fmt: skip
        """A finding about a channel of this recording, with its picture."""
        evidence = evidence if evidence.endswith(".") else f"{evidence}."
        picture = self._picture(channel, expected)
        name = self.recording.name
        return Finding(fault, name, channel, float(size), unit, evidence, fix, picture)

    def columns(self, wanted: Mapping[str, tuple[str, Mapping[str, Any]]]) -> str | None:
        """`columns = { z1 = { name = "z1 [mm]" } }` of channel -> (source channel, settings); None
        if a source is in no file."""
        entries = []
        for channel, (source, settings) in wanted.items():
            header = self.recording.headers.get(source)
            if header is None:
                return None
            unit = settings.get("unit")
            named = f"{parse_header(header)[0]} [{unit}]" if unit else header
            other_settings = "".join(f", {k} = {v}" for k, v in settings.items() if k != "unit")
            entries.append(f'{channel} = {{ name = "{named}"{other_settings} }}')
        return f"columns = {{ {', '.join(entries)} }}"

    def _picture(self, channel: str, expected: np.ndarray | None) -> Picture | None:
        if channel not in self.recording.channels:
            return None
        thin = slice(None, None, max(self.recording.rows // MOST_POINTS, 1))
        unit = channel_kind(channel).units[0]
        shown = self.recording.channels[channel][thin]
        return Picture(self.recording.time[thin], shown, expected, unit)


def _explained(relations_seen: Sequence[Relation]) -> float:
    """Mean share of the encoders' variance that the scenario's loop explains."""
    shares = [
        r.explained
        for r in relations_seen
        if r.tolerance == LOOP and role_of(r.output) is Role.PLACE
    ]
    return float(np.mean(shares)) if shares else 0.0
