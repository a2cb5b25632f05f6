"""The rows of a file: uneven time stamps, empty cells and gaps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.recording.channels import channel_kind, is_channel
from flexgui.core.recording.clock import JITTER, MIN_SAMPLES, runs
from flexgui.core.recording.load import file_stem
from flexgui.core.recording.resampling import GAP
from flexgui.core.units import factor_to_si, parse_header


@dataclass(frozen=True)
class Rows:
    """Gaps and clock of a file."""

    empty: Mapping[str, int] = field(default_factory=dict)
    """Header -> its empty cells, of columns that need a number in every row."""
    longest_gap: float = 0.0
    """s, without a row or without a number in such a column."""
    uneven: str = ""
    """What is wrong with the clock; empty where it is even."""
    rate: float = 0.0
    """Hz, the usual one; 0 without a clock."""
    parts: tuple[tuple[float, float], ...] = ()
    """s, from where to where nothing is missing for long."""


def rows(
    numbers: Mapping[str, np.ndarray], headers: Mapping[str, str], columns: Mapping[str, Any]
) -> Rows:
    """Gaps and clock of the columns (N,) of a file; `headers`: channel -> column."""
    needed = [h for c, h in headers.items() if c != "t" and not channel_kind(c).sparse]
    empty = {h: np.isnan(numbers[h]) for h in needed if h in numbers}
    most = max((b - a for mask in empty.values() for a, b in runs(mask)), default=0)
    time = _seconds(numbers, headers, columns)
    usual, sentence, missing = _clock(time)
    return Rows(
        {h: int(mask.sum()) for h, mask in empty.items() if mask.any()},
        max(most * usual, missing), sentence, 1.0 / usual if usual > 0 else 0.0,
        _parts(time, empty.values()),
    )  # fmt: skip


def _parts(time: np.ndarray, empty: Iterable[np.ndarray]) -> tuple[tuple[float, float], ...]:
    if not len(time):
        return ()
    stamps = np.sort(time[np.isfinite(time) & ~np.any([np.isnan(time), *empty], axis=0)])
    pieces = np.split(stamps, np.flatnonzero(np.diff(stamps) > SHORT_GAP) + 1)
    return tuple((float(p[0]), float(p[-1])) for p in pieces if len(p) >= MIN_SAMPLES)


SHORT_GAP = 0.02
"""s, as `GapsSpec.longest` of a recording, which a test holds: hides no swing of a link."""


SPLIT = "split"
"""Into a recording before each long gap and one after it."""


def parted(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One entry per recording of a file: one for each of its `windows`."""
    own = {key: value for key, value in entry.items() if key != "windows"}
    stem = file_stem(str(own.get("file", "")))
    parts = enumerate(entry.get("windows", ()), 1)
    return [{**own, "name": f"{stem} {k}", "window": list(w)} for k, w in parts] or [own]


def settings(rows_read: Rows, how: str = "", clock: str = "interpolate") -> dict[str, Any]:
    """The scenario's entries that make such a file readable; none for a regular file.

    Args:
        rows_read: Its gaps and its clock.
        how: Of the gaps; left out: short ones are bridged, and a file is split at long ones, into
            recordings with the `windows` among the entries (see `parted`).
        clock: How an uneven clock is made even.
    """
    entries: dict[str, Any] = {"resample": {"how": clock}} if rows_read.uneven else {}
    if not rows_read.empty and not rows_read.longest_gap:
        return entries
    long = rows_read.longest_gap > SHORT_GAP
    for_long = SPLIT if len(rows_read.parts) > 1 else "mask"
    chosen = how or (for_long if long else "interpolate")
    entries["gaps"] = {"how": chosen}
    if chosen == SPLIT:
        return {**entries, "gaps": {"how": "interpolate"}, "windows": rows_read.parts}
    if long and chosen != "cut":
        entries["gaps"]["longest"] = round(1.01 * rows_read.longest_gap, 6)
    return entries


def chosen_headers(headers: tuple[str, ...], columns: Mapping[str, Any]) -> dict[str, str]:
    """Channel -> header that its entry of `columns` names, without its unit; else empty."""
    plain = {parse_header(h)[0]: h for h in headers}
    return {c: plain.get(parse_header(entry["name"])[0], "") for c, entry in columns.items()}


def unit_of(entry: Mapping[str, Any] | None, header: str) -> str:
    """The unit that an entry of `columns` states, else that of the heading; empty without one."""
    return parse_header((entry or {}).get("name", ""))[1] or parse_header(header)[1]


def headers_of(headers: tuple[str, ...], columns: Mapping[str, Any]) -> dict[str, str]:
    """Channel -> header: what `columns` names, then columns of a channel's own name."""
    plain = {parse_header(h)[0]: h for h in headers}
    named = chosen_headers(headers, columns)
    own = {name: h for name, h in plain.items() if is_channel(name) and h not in named.values()}
    return {c: h for c, h in {**own, **named}.items() if h}


def _seconds(
    numbers: Mapping[str, np.ndarray], headers: Mapping[str, str], columns: Mapping[str, Any]
) -> np.ndarray:
    """(N,) s; nothing where no column is the time."""
    header = headers.get("t", "")
    if header not in numbers:
        return np.zeros(0)
    entry = columns.get("t", {})
    try:
        factor = factor_to_si(unit_of(entry, header), ("s",)) * entry.get("gain", 1.0)
    except InputError:  # the reader has a sentence on that
        return np.zeros(0)
    return np.asarray(factor * numbers[header])


def _clock(time: np.ndarray) -> tuple[float, str, float]:
    """Usual step in s, irregularities, and the longest gap in s."""
    good = time[np.isfinite(time)]
    steps = np.diff(good)
    rising = steps[steps > 0]
    if not rising.size:
        return 0.0, "", 0.0
    usual = float(np.median(rising))
    off = int(np.sum(np.abs(steps - usual) > JITTER * usual))
    repeated, lost = int(np.sum(steps <= 0)), len(time) - len(good)
    if not off and not lost:
        return usual, "", 0.0
    wide = np.sort(good)[1:] - np.sort(good)[:-1]
    irregularities = [f"{off} of {len(steps)} steps differ from {1e3 * usual:.4g} ms"]
    irregularities += [f"{repeated} non-increasing timestamps"] if repeated else []
    irregularities += [f"{lost} rows without a time"] if lost else []
    longest = float(wide.max())
    missing = longest > GAP * usual and np.mean(wide > GAP * usual) < 0.5 / GAP
    irregularities += [f"the longest takes {longest:.3g} s"] if missing else []
    return usual, f"The time is uneven: {', '.join(irregularities)}.", longest if missing else 0.0
