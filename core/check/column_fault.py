"""Faults of whole columns, and how they are taken back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..model import Model
from ..recording.channels import FURTHER, Role, channel_kind, is_reference, joint_of, role_of
from ..recording.recording import Recording

DEGREES, MILLI = 180.0 / np.pi, 1000.0
NOT_MEASURED = (Role.TIME, Role.RIGID, Role.KNOWN_TORQUE)
"""Of channels that are computed or no part of the model's answer."""
RATES = (0.1, 0.2, 0.25, 0.4, 0.5, 2.0, 2.5, 4.0, 5.0, 10.0)
"""Wrong sample times are slips of rates: 1 and 2 kHz, 100 and 250 Hz, a decimal."""
TIME = "t"


@dataclass(frozen=True)
class ColumnFault:
    """Channels that are `factor` times what they should be, shifted, late, or each other's."""

    fault: str
    channels: tuple[str, ...]
    factor: float = 1.0
    shift: float = 0.0
    """SI, by which a channel is too large."""
    since: float = -np.inf
    """s, from when on it is."""
    lag: float = 0.0
    """s, by which a channel is late."""
    drift: float = 0.0
    """s/s, by which the lag grows."""
    swapped: str = ""
    """Two joint numbers: each channel holds the other's data."""
    is_usual: bool = True
    """Whether it has no size of its own: a unit, a sign, a swap."""
    alternatives: tuple[str, ...] = ()
    """Channels with an equally good correction."""
    deviation: float = 0.0
    """Standard deviation of the size."""
    explains: tuple[str, float, float] | None = None
    """The channel of which it explains most, and the shares of its variance that are unexplained
    before and after."""

    @property
    def size(self) -> float:
        """The one number that is not neutral: a shift (in SI), a lag (s), a drift (s/s) or a
        factor."""
        return self.shift or self.lag or self.drift or self.factor

    def with_more(self, found: ColumnFault) -> ColumnFault:
        """This one and a fault of the same kind, in the same channels, that was left by it."""
        explains = found.explains
        if self.explains and explains and self.explains[0] == explains[0]:
            explains = (explains[0], self.explains[1], explains[2])
        return replace(
            found, factor=self.factor * found.factor, shift=self.shift + found.shift,
            lag=self.lag + found.lag, drift=self.drift + found.drift,
            deviation=self.factor * found.deviation, explains=explains,
        )  # fmt: skip

    def corrected(self, recording: Recording) -> Recording:
        """The recording with the fault taken back."""
        other = str.maketrans(self.swapped, self.swapped[::-1])
        channels, counted = dict(recording.channels), dict(recording.counted)
        t = recording.time
        for name in self.channels:
            if name not in channels:
                continue  # the clock, or a parameter
            source = name.translate(other)
            x = recording[source]
            if source in recording.counted:
                counted[name] = recording.counted[source]
            if self.lag or self.drift:
                good = np.isfinite(x)
                late = t + self.lag + self.drift * (t - t[0])
                moved = np.interp(late, t[good], x[good])
                x = np.where(good, moved, np.nan)
            channels[name] = (x - self.shift * (t >= self.since)) / self.factor
        time = t / (self.factor if TIME in self.channels else 1.0)
        return replace(recording, time=time, channels=channels, counted=counted)


def columns(recording: Recording) -> list[str]:
    """The channels of a file that a model drives with, or answers."""
    kinds = {n: channel_kind(n) for n in recording.channels}
    return [n for n, kind in kinds.items() if kind.role not in NOT_MEASURED and kind != FURTHER]


def usual_faults(recording: Recording, model: Model) -> Iterator[ColumnFault]:
    """Units, signs, swapped columns and other rates, each in every channel or group that may have
    it."""
    names = columns(recording)
    places = [n for n in names if role_of(n) in (Role.PLACE, Role.SPEED, Role.TIP)]
    for fault, unit, factor in (("degrees", "rad", DEGREES), ("millimetres", "m", MILLI)):
        for group in _groups([n for n in places if unit_of(model, n).split("/")[0] == unit]):
            yield ColumnFault(fault, group, factor)
    yield from (ColumnFault("sign", (name,), -1.0) for name in names)
    for pair in combinations("123", 2):
        both = [n for n in names if _with(n, pair) and all(m in names for m in _with(n, pair))]
        for group in _groups(both):
            if len(group) > 1:
                yield ColumnFault("swapped_joints", group, swapped="".join(pair))
    if any(is_reference(n) and role_of(n) is Role.SPEED for n in names):
        yield from (ColumnFault("sample_time", (TIME,), factor) for factor in RATES)


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


def unit_of(model: Model | None, channel: str) -> str:
    """SI unit of a channel; a sliding joint has metres."""
    units, joint = channel_kind(channel).units, joint_of(channel) or 0
    slides = (
        model is not None
        and not channel_kind(channel).camera
        and joint < model.arm.joints
        and model.arm.segments[joint].joint != "revolute"
    )
    return units[-1] if slides and len(units) > 1 else units[0]
