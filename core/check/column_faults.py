"""Faults of whole columns, and which correction makes the channels agree.

A fault counts only by its correction: the recording is corrected, and all relations between its
channels are computed again. Of equal corrections the usual ones (units, signs, swapped columns)
come before any factor.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..check.channel_relations import relations
from ..check.gain_and_lag import DIRECT, LOOP
from ..check.link_bending import LinkShape
from ..check.measured_recording import MeasuredRecording
from ..check.tip_geometry import TipGeometry
from ..recording.channels import DRIVES, Role, channel_kind, is_reference, role_of

DEGREES, MILLI = 180.0 / np.pi, 1000.0
FAMILIES = ("theta#", "z#", "u#", "i#", "deflection#", "dtheta#_ref", "theta#_ref", "i#_ref")
"""Channels of files; all others are computed."""
CLEAR = 1.0
"""Least disagreement: a sign counts three, an unexplained channel two."""
TIE = 0.1
"""Share of the best improvement by which a tie may be worse; less is no improvement."""
MOST = 3.0
"""Largest count of one relation: the logarithm of a gain of 20."""


@dataclass(frozen=True)
class ColumnFault:
    """Channels (or stated parameters) that are `factor` times what they should be."""

    fault: str
    channels: tuple[str, ...]
    factor: float = 1.0
    shift: float = 0.0
    """SI, by which a channel is too large."""
    since: float = -np.inf
    """s, from when on it is."""
    lag: float = 0.0
    """s, by which a channel is late."""
    swapped: str = ""
    """Two joint numbers: each channel holds the other's data."""
    rank: int = 1
    """Usual faults first."""
    alternatives: tuple[str, ...] = ()
    """Channels with an equally good correction."""

    def corrected(self, recording: MeasuredRecording) -> MeasuredRecording:
        """The recording with the fault corrected."""
        other = str.maketrans(self.swapped, self.swapped[::-1])
        channels, headers = dict(recording.channels), dict(recording.headers)
        values = dict(recording.values)
        for name in self.channels:
            source = name.translate(other)
            if name in recording.channels:
                values_read = recording.channels[source]
                if self.lag:
                    values_read = np.interp(
                        recording.time + self.lag, recording.grid, recording.even(source)
                    )
                shift = self.shift * (recording.time >= self.since)
                channels[name] = (values_read - shift) / self.factor
                headers |= {name: recording.headers[source]} if source in recording.headers else {}
            elif recording.model is not None and name in recording.model.parameters:
                values[name] = recording.model.parameters[name].value / self.factor
        time = recording.time / (self.factor if "t" in self.channels else 1.0)
        return replace(recording, time=time, channels=channels, headers=headers, values=values)

    def improvement(self, recording: MeasuredRecording) -> float:
        """By how much the correction reduces the disagreement of the channels."""
        return _reduction(disagreements(recording), disagreements(self.corrected(recording)))


def find_fault(
    recording: MeasuredRecording, free: Sequence[ColumnFault] = (), shape: LinkShape | None = None
) -> ColumnFault | None:
    """The fault with the best correction; None without disagreement or correction. `free`: causes
    of any size that the channels' gains suggest; `shape`: the links as the recordings show them,
    which only a correction of what drives the joints leaves as it is."""
    tip = TipGeometry.of(recording)
    off = np.inf if tip is None else tip.misfit()
    improving = []
    for cause in (*_usual_faults(recording), *free):
        links = shape if all(role_of(n) in DRIVES for n in cause.channels) else None
        before = disagreements(recording, links)
        if cause.rank < FREE_RANK and max(before.values(), default=0.0) <= CLEAR:
            continue
        after = cause.corrected(recording)
        tip_after = TipGeometry.of(after)
        gain = _reduction(before, disagreements(after, links))
        if gain > TIE and any(map(is_reference, cause.channels)):
            # A wrong correction that takes a reference's effect away is shown by its own gains.
            single = _reduction(*(disagreements(r, links, quick=False) for r in (recording, after)))
            gain = min(gain, single)
        worse = cause.rank >= FREE_RANK and tip_after is not None and tip_after.misfit() > off
        if gain > (CLEAR if cause.rank < FREE_RANK else TIE) and not worse:
            improving.append((gain, cause))
    if not improving:
        return None
    best = max(gain for gain, _ in improving)
    good = [
        (c.rank, len(c.channels), -gain, c) for gain, c in improving if gain >= (1.0 - TIE) * best
    ]
    rank, size, _, first = min(good, key=lambda each: each[:3])
    alike = {n: None for *each, c in good if each[:2] == [rank, size] for n in c.channels}
    return replace(first, alternatives=tuple(n for n in alike if n not in first.channels))


FREE_RANK = 3
"""Rank from which a fault has a free size."""


def disagreements(
    recording: MeasuredRecording, shape: LinkShape | None = None, quick: bool = True
) -> dict[object, float]:
    """Disagreement of each relation, and of the camera with the encoders; 0: agrees, within
    friction and unexplained variance."""
    by_relation: dict[object, float] = {}
    for relation in relations(recording, quick, shape):
        unknown = np.sqrt(max(1.0 - relation.explained, 0.0))
        slack = max(relation.tolerance - LOOP + DIRECT, DIRECT, unknown)
        off = np.clip(abs(np.log(abs(relation.gain))) - slack, 0.0, MOST)
        share = float(np.clip(relation.explained, 0.0, 1.0))
        wrong_way = MOST * (relation.gain < 0)
        by_relation[relation.key, relation.tolerance] = share * (float(off) + wrong_way) + 2.0 * (
            1.0 - share
        )
    tip = TipGeometry.of(recording)
    if tip is not None:
        off = np.log(max(tip.misfit() / tip.tolerance, 1.0))
        by_relation["camera"] = float(min(off, MOST)) * (1 + recording.model.arm.joints)  # type: ignore[union-attr]
    return by_relation


def _reduction(before: Mapping[object, float], after: Mapping[object, float]) -> float:
    """The reduction; a relation that is not explained counts as a disagreement of two."""
    keys = {*before, *after}
    return sum(before.get(k, 2.0) - after.get(k, 2.0) for k in keys)


def _usual_faults(recording: MeasuredRecording) -> Iterable[ColumnFault]:
    names = [
        n for n in recording.channels if channel_kind(n).pattern in FAMILIES and recording.has(n)
    ]
    places = [n for n in names if role_of(n) in (Role.PLACE, Role.SPEED, Role.TIP)]
    for fault, unit, factor in (("degrees", "rad", DEGREES), ("millimetres", "m", MILLI)):
        for group in _groups([n for n in places if unit_of(recording, n).split("/")[0] == unit]):
            yield ColumnFault(fault, group, factor)
    yield from (ColumnFault("sign", (name,), -1.0) for name in names)
    for pair in combinations("123", 2):
        both = [n for n in names if _with(n, pair) and all(m in names for m in _with(n, pair))]
        for group in _groups(both):
            if len(group) > 1:
                yield ColumnFault("swapped_joints", group, swapped="".join(pair))
    model = recording.model
    if model is not None:
        stiff = tuple(f"EI{k + 1}" for k, modes in enumerate(model.arm.modes) if modes)
        if stiff and all(n in model.parameters for n in stiff):
            yield from (
                ColumnFault("stated_stiffness", stiff, f, rank=2) for f in (MILLI, 1.0 / MILLI)
            )


def _with(name: str, pair: tuple[str, ...]) -> list[str]:
    """The channels of a family with both numbers; none if the channel has another."""
    number = next((c for c in name if c.isdigit()), "")
    return [name.replace(number, p) for p in pair] if number in pair else []


def _groups(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Groups: each channel, each family, and all of joints and drives."""
    families: dict[str, list[str]] = {}
    for name in names:
        families.setdefault(channel_kind(name).pattern, []).append(name)
    joints = tuple(n for n in names if not channel_kind(n).sparse)
    groups = [*((n,) for n in names), *(tuple(f) for f in families.values()), joints]
    return [group for group in dict.fromkeys(groups) if group]


def unit_of(recording: MeasuredRecording, channel: str) -> str:
    """SI unit of a channel; a sliding joint has metres."""
    units = channel_kind(channel).units
    joint = recording.joint(channel)
    slides = (
        recording.model is not None
        and not channel_kind(channel).camera
        and joint < recording.model.arm.joints
        and recording.model.arm.segments[joint].joint != "revolute"
    )
    return units[-1] if slides and len(units) > 1 else units[0]
