"""Signals in groups with clocks of their own (topics, groups, channels) made one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..recording.channels import channel_kind, is_channel, is_reference
from ..recording.clock import JITTER
from ..recording.table import Listed, Reading, Table
from ..sentences import few
from ..units import factor_to_si, parse_header

TIME_NAMES = ("t", "time", "timestamp", "stamp", "times", "timestamps")
"""How loggers call the time column, in lower case."""


@dataclass
class Group:
    """Columns that share one clock."""

    name: str
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    """Header (a path such as `rig/theta1 [deg]`) -> values (N,)."""
    time: np.ndarray | None = None
    """s (N,); None where the group has no clock of its own."""

    @property
    def rows(self) -> int:
        """Number of samples."""
        return len(next(iter(self.columns.values()), ()))

    def listed(self) -> Listed:
        """Its rate and span, as a person is shown them."""
        span = rate = None
        if self.time is not None and len(self.time) > 1:
            span = float(self.time[-1] - self.time[0])
            rate = (len(self.time) - 1) / span if span > 0 else None
        return Listed(self.name, tuple(self.columns), self.rows, rate, span)


def with_clock(group: Group) -> Group:
    """The group with its own time column, if it has one, as its clock in s."""
    for header in group.columns:
        name, unit = parse_header(header)
        if name.rsplit("/", 1)[-1].lower() in TIME_NAMES:
            values = group.columns[header]
            if values.dtype.kind not in "iuf":
                continue
            factor = factor_to_si(unit, ("s",))
            others = {h: v for h, v in group.columns.items() if h != header}
            return Group(group.name, others, factor * values.astype(float))
    return group


def by_length(name: str, columns: Mapping[str, np.ndarray]) -> list[Group]:
    """Columns of one place in a file, a group for each length; each with its clock."""
    groups: dict[int, Group] = {}
    for header, values in columns.items():
        groups.setdefault(len(values), Group(name)).columns[header] = values
    return [with_clock(group) for group in groups.values()]


def merged(
    path: Path,
    groups: Sequence[Group],
    reading: Reading,
    unusable: Mapping[str, str] | None = None,
    warnings: Iterable[str] = (),
) -> Table:
    """One table on the clock of the longest group that holds a channel.

    A camera's or gauge's sample goes to the row that is nearest in time, at most half a row away;
    a reference keeps its value until the next one; other signals are interpolated linearly. The
    table's warnings say so. InputError where no group has a time.
    """
    groups = [group for group in groups if group.rows or group.time is not None]
    bad = dict(unusable or {})
    clocked = _with_shared_clocks(groups, bad)
    if not clocked:
        raise InputError(
            f"{path.name} holds no signals with a time; store t or time beside the channels."
        )
    base = max(clocked, key=lambda g: (_has_channel(g), g.rows or _length(g)))
    rows = _length(base)
    reading.holds(rows, sum(len(g.columns) for g in clocked) + 1)
    assert base.time is not None
    columns: dict[str, np.ndarray] = {"t": base.time}
    messages = list(warnings)
    for group in clocked:
        moved, how = _onto(group, base)
        columns |= moved
        messages += how
    keep = _inside(columns, [g for g in clocked if _has_channel(g)], base.time)
    names = short_names(columns)
    return Table(
        path.name,
        {names[h]: v[keep] for h, v in columns.items()},
        unusable=bad,
        warnings=tuple(messages),
        groups=tuple(group.listed() for group in groups),
        paths={h: names[h] for h in columns if names[h] != h},
    )


def short_names(headers: Iterable[str]) -> dict[str, str]:
    """Path -> header: the channel's own name where the path ends in it, once in the file."""
    shortened = {header: _channel_header(header) for header in headers}
    times = Counter(parse_header(short)[0] for short in shortened.values() if short)
    return {
        header: short if short and times[parse_header(short)[0]] == 1 else header
        for header, short in shortened.items()
    }


def _channel_header(header: str) -> str:
    name, unit = parse_header(header)
    last = name.rsplit("/", 1)[-1]
    if not is_channel(last):
        return ""
    return f"{last} [{unit}]" if unit else last


def _length(group: Group) -> int:
    return 0 if group.time is None else len(group.time)


def _has_channel(group: Group) -> bool:
    return any(_channel_header(header) for header in group.columns)


def _with_shared_clocks(groups: Sequence[Group], bad: dict[str, str]) -> list[Group]:
    """Each with a time; a group without one takes that of a group as long as it is."""
    clocked = []
    for group in groups:
        time = group.time
        if time is None:
            same = [g.time for g in groups if g.time is not None and len(g.time) == group.rows]
            time = same[0] if same else None
        if time is None:
            bad |= dict.fromkeys(group.columns, "has no time column of the same length")
            continue
        for header in [h for h, v in group.columns.items() if len(v) != len(time)]:
            bad[header] = f"has {len(group.columns[header])} values for {len(time)} times"
            del group.columns[header]
        clocked.append(Group(group.name, group.columns, time))
    return clocked


def _onto(group: Group, base: Group) -> tuple[dict[str, np.ndarray], list[str]]:
    """The group's columns on the clock of `base`, and what was done to them."""
    assert group.time is not None and base.time is not None
    usual = float(np.median(np.diff(base.time))) if len(base.time) > 1 else 0.0
    alike = len(group.time) == len(base.time)
    if alike and float(np.max(np.abs(group.time - base.time), initial=0.0)) <= JITTER * abs(usual):
        return dict(group.columns), []
    if len(group.time) == 0 or not group.columns:
        return {h: np.full(len(base.time), np.nan) for h in group.columns}, []
    order = np.argsort(group.time, kind="stable")
    time = group.time[order]
    moved, methods = {}, set()
    for header, values in group.columns.items():
        if values.dtype.kind in "iufb":
            resample, method = _resampling(header)
            moved[header] = resample(time, values[order].astype(float), base.time)
            methods.add(method)
    message = f"{group.name} has its own clock: {few(list(moved))} moved to the clock of t, "
    return moved, [f"{message}{' and '.join(sorted(methods))}."] if moved else []


def _nearest(time: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    out = np.full(len(grid), np.nan)
    if len(grid) < 2:
        return out
    half = 0.5 * float(np.median(np.diff(grid)))
    rows = np.clip(np.searchsorted(grid, time), 1, len(grid) - 1)
    rows -= (time - grid[rows - 1]) < (grid[rows] - time)
    close = np.abs(grid[rows] - time) <= half
    out[rows[close]] = values[close]
    return out


def _linear(time: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    return np.interp(grid, time, values, left=np.nan, right=np.nan)


def _hold(time: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    rows = np.searchsorted(time, grid, side="right") - 1
    return np.where(rows < 0, np.nan, values[np.maximum(rows, 0)])


_Resample = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(times, values, wanted times) -> values there."""


def _resampling(header: str) -> tuple[_Resample, str]:
    """How a column is put on another clock, and in words."""
    if _sparse(header):
        return _nearest, "each sample in the nearest row"
    hold = is_reference(parse_header(_channel_header(header))[0])
    return (_hold, "held") if hold else (_linear, "linearly")


def _inside(columns: Mapping[str, np.ndarray], groups: Sequence[Group], time: np.ndarray) -> slice:
    """The rows in which every group that holds a complete channel has begun and not ended."""
    low, high = -np.inf, np.inf
    for group in groups:
        if group.time is None or not len(group.time) or all(_sparse(h) for h in group.columns):
            continue
        low, high = max(low, group.time[0]), min(high, group.time[-1])
    keep = np.flatnonzero((time >= low) & (time <= high))
    return slice(int(keep[0]), int(keep[-1]) + 1) if keep.size else slice(0, len(time))


def _sparse(header: str) -> bool:
    name = parse_header(_channel_header(header))[0]
    return bool(name) and channel_kind(name).sparse
