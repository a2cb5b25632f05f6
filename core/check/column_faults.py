"""What may be wrong with whole columns, and which of it makes the channels agree once taken back.

A cause counts only by what it mends: the recording is changed as the cause says, and all that its
channels say of each other is worked out again. Of causes that mend as much the known ones (units,
signs, swapped columns) come before any factor.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..check.channel_relations import relations
from ..check.gain_and_lag import DIRECT, LOOP
from ..check.measured_recording import MeasuredRecording
from ..check.tip_geometry import TipGeometry
from ..recording.channels import Role, channel_kind, role_of

DEGREES, MILLI = 180.0 / np.pi, 1000.0
FAMILIES = ("theta#", "z#", "u#", "i#", "deflection#", "dtheta#_ref", "theta#_ref", "i#_ref")
"""What a file holds; all else is worked out of it."""
CLEAR = 1.0
"""A contradiction: a sign counts three, a channel of which nothing is explained two."""
TIE = 0.1
"""Of what the best cause mends may one leave and still be as good; less is no mend at all."""
MOST = 3.0
"""Counted of one relation: the logarithm of a gain of 20."""


@dataclass(frozen=True)
class ColumnFault:
    """Channels (or stated parameters) that are `factor` times what they should be."""

    fault: str
    channels: tuple[str, ...]
    factor: float = 1.0
    shift: float = 0.0
    """SI, by which a channel is too large."""
    exchanged: str = ""
    """Two numbers: each channel holds what the one with the other number should."""
    rank: int = 1
    """Known ones first."""
    alternatives: tuple[str, ...] = ()
    """Channels of which the same would mend as much."""

    def mended(self, found: MeasuredRecording) -> MeasuredRecording:
        """The recording without it."""
        other = str.maketrans(self.exchanged, self.exchanged[::-1])
        channels, headers, values = dict(found.channels), dict(found.headers), dict(found.values)
        for name in self.channels:
            source = name.translate(other)
            if name in found.channels:
                channels[name] = (found.channels[source] - self.shift) / self.factor
                headers |= {name: found.headers[source]} if source in found.headers else {}
            elif found.model is not None and name in found.model.parameters:
                values[name] = found.model.parameters[name].value / self.factor
        time = found.time / (self.factor if "t" in self.channels else 1.0)
        return replace(found, time=time, channels=channels, headers=headers, values=values)

    def mends(self, found: MeasuredRecording) -> float:
        """By how much less the channels contradict each other without it."""
        return _reduction(disagreements(found), disagreements(self.mended(found)))


def find_fault(found: MeasuredRecording, free: Sequence[ColumnFault] = ()) -> ColumnFault | None:
    """What mends most; None where nothing contradicts, or where nothing mends it.

    Args:
        free: Causes of any size that the channels' gains suggest.
    """
    before, tip = disagreements(found), TipGeometry.of(found)
    clear = any(value > CLEAR for value in before.values())
    tried = [*(_usual_faults(found) if clear else ()), *free]
    off = np.inf if tip is None else tip.misfit()
    mending = []
    for cause in tried:
        after = cause.mended(found)
        left = TipGeometry.of(after)
        gain = _reduction(before, disagreements(after))
        worse = cause.rank >= FREE_RANK and left is not None and left.misfit() > off
        if gain > (CLEAR if cause.rank < FREE_RANK else TIE) and not worse:
            mending.append((gain, cause))
    if not mending:
        return None
    best = max(gain for gain, _ in mending)
    good = [cause for gain, cause in mending if gain >= (1.0 - TIE) * best]
    first = min(good, key=lambda c: (c.rank, len(c.channels)))
    alike = [c for c in good if (c.rank, len(c.channels)) == (first.rank, len(first.channels))]
    return replace(first, alternatives=tuple(n for c in alike if c != first for n in c.channels))


FREE_RANK = 3
"""Rank from which a cause's size is no known one."""


def disagreements(found: MeasuredRecording) -> dict[object, float]:
    """Of each relation, and of the camera with the encoders: how far it is from what it should be;
    0: it agrees, beside friction and what is not explained of its variance."""
    made: dict[object, float] = {}
    for one in relations(found, quick=True):
        unknown = np.sqrt(max(1.0 - one.explained, 0.0))
        slack = max(one.tolerance - LOOP + DIRECT, DIRECT, unknown)
        off = np.clip(abs(np.log(abs(one.gain))) - slack, 0.0, MOST)
        share = float(np.clip(one.explained, 0.0, 1.0))
        wrong_way = MOST * (one.gain < 0)
        made[one.key, one.tolerance] = share * (float(off) + wrong_way) + 2.0 * (1.0 - share)
    tip = TipGeometry.of(found)
    if tip is not None:
        off = np.log(max(tip.misfit() / tip.tolerance, 1.0))
        made["camera"] = float(min(off, MOST)) * (1 + found.model.arm.joints)  # type: ignore[union-attr]
    return made


def _reduction(before: Mapping[object, float], after: Mapping[object, float]) -> float:
    """By how much; what is not explained well enough to be a relation counts as such."""
    keys = {*before, *after}
    return sum(before.get(k, 2.0) - after.get(k, 2.0) for k in keys)


def _usual_faults(found: MeasuredRecording) -> Iterable[ColumnFault]:
    names = [n for n in found.channels if channel_kind(n).pattern in FAMILIES and found.has(n)]
    places = [n for n in names if role_of(n) in (Role.PLACE, Role.SPEED, Role.TIP)]
    for fault, unit, factor in (("degrees", "rad", DEGREES), ("millimetres", "m", MILLI)):
        for group in _groups([n for n in places if unit_of(found, n).split("/")[0] == unit]):
            yield ColumnFault(fault, group, factor)
    yield from (ColumnFault("sign", (name,), -1.0) for name in names)
    for pair in combinations("123", 2):
        both = [n for n in names if _with(n, pair) and all(m in names for m in _with(n, pair))]
        for group in _groups(both):
            if len(group) > 1:
                yield ColumnFault("swapped_joints", group, exchanged="".join(pair))
    model = found.model
    if model is not None:
        stiff = tuple(f"EI{k + 1}" for k, modes in enumerate(model.arm.modes) if modes)
        if stiff and all(n in model.parameters for n in stiff):
            yield from (
                ColumnFault("stated_stiffness", stiff, f, rank=2) for f in (MILLI, 1.0 / MILLI)
            )


def _with(name: str, pair: tuple[str, ...]) -> list[str]:
    """The channels of a family with both numbers; none where the channel has another."""
    number = next((c for c in name if c.isdigit()), "")
    return [name.replace(number, p) for p in pair] if number in pair else []


def _groups(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Each channel, each family of them, and all that joints and their drives have."""
    families: dict[str, list[str]] = {}
    for name in names:
        families.setdefault(channel_kind(name).pattern, []).append(name)
    joints = tuple(n for n in names if not channel_kind(n).sparse)
    made = [*((n,) for n in names), *(tuple(f) for f in families.values()), joints]
    return [group for group in dict.fromkeys(made) if group]


def unit_of(found: MeasuredRecording, channel: str) -> str:
    """SI, of the arm's joints: a sliding one has metres."""
    units = channel_kind(channel).units
    joint = found.joint(channel)
    slides = (
        found.model is not None
        and not channel_kind(channel).camera
        and joint < found.model.arm.joints
        and found.model.arm.segments[joint].joint != "revolute"
    )
    return units[-1] if slides and len(units) > 1 else units[0]
