"""From a file and what the scenario says about it to a recording in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..recording.channels import channel_kind
from ..recording.clock import (
    MIN_SAMPLES,
    bridged,
    check_rising,
    choose_rows,
    even_time,
    in_base_frame,
    longest_complete,
    shifted,
)
from ..recording.read_table import known_suffix, read_table
from ..recording.recording import Recording
from ..recording.resampling import INPUTS, Even, at_rate, even_table
from ..recording.sources import Source, check_named, check_numbers, find_sources, nearest, unused
from ..recording.spec import GapsSpec, RecordingSpec
from ..recording.table import Table, Watching
from ..sentences import brief
from ..validation import LARGEST


def load_recording(
    path: Path,
    spec: RecordingSpec,
    required: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    progress: Watching | None = None,
) -> Recording:
    """The recording in the file, checked (InputError); `required` channels must be in it.

    `progress` hears how much of the file is read. `units` are the SI units of channels whose
    dimension the arm fixes: a joint turns or slides.
    """
    try:
        # Damaged files hold numbers that overflow; the checks find them, warnings would not help.
        with np.errstate(over="ignore", invalid="ignore"):
            return _load(read_table(path, progress), spec, required, units or {})
    except InputError as error:
        raise InputError(brief(str(error))) from None


def _load(
    table: Table, spec: RecordingSpec, required: Sequence[str], units: Mapping[str, str]
) -> Recording:
    check_numbers(table)
    sources = find_sources(table, spec, units)
    for name in ("t", *required):
        if name not in sources:
            raise InputError(
                f"{table.source} has no column {name}, and columns maps none to it; "
                f"{nearest(table, name)}"
            )
    check_named(table, spec, sources)
    table, factor, resampled = _even(table, spec, sources)
    rows, time = _read_time(table, spec, sources["t"])
    values = {n: _numbers(table, s, rows) for n, s in sources.items() if n != "t"}
    part = _complete(values, len(time), spec.gaps)
    warnings = [*table.warnings, *([resampled] if resampled else [])]
    if part.stop - part.start < len(time):
        time = _cut(table, time[part])
        warnings.append(f"Kept {time[0]:.6g} to {time[-1]:.6g} s, the longest part without a gap.")
    channels: dict[str, np.ndarray] = {}
    counted = {name: outside(time, stretches) for name, stretches in spec.mask.items()}
    for name, column in values.items():
        header, x = sources[name].header, column[part]
        if np.isnan(x).all() and (_sparse(name) or spec.gaps is not None):
            warnings.append(f"Column {header} has no samples and is left out.")
            continue
        filled = _without_gaps(name, x, time, spec.gaps)
        _check_gaps(table, name, header, filled, rows.start, time, spec)
        empty = np.isnan(x) & ~np.isnan(filled)
        if empty.any():
            warnings.append(f"Column {header}: {int(empty.sum())} cells bridged.")
            if spec.gaps is not None and spec.gaps.how == "mask":
                counted[name] = counted.get(name, np.ones(len(time), dtype=bool)) & ~empty
        channels[name] = filled
        warnings += _remarks(header, filled)
    dt = float(time[-1] - time[0]) / (len(time) - 1)
    warnings += _apply_camera(channels, spec, dt, table.source)
    warnings += unused(table, sources)
    recording = Recording(
        name=spec.name or file_stem(table.source),
        time=time,
        channels=channels,
        role=spec.role,
        counted=counted,
        logger_filters=spec.logger_filters,
        unknown_gains=spec.unknown_gains,
        camera=spec.camera_in_base_frame,
        source=table.source,
        warnings=tuple(warnings),
        theta2=spec.theta2,
    )
    return at_rate(recording, factor)


class Unchecked(NamedTuple):
    """Channels as the file and the scenario state them, in SI, before anything is required."""

    table: Table
    time: np.ndarray | None
    """s (N,) as it stands; None where no column is the time."""
    channels: dict[str, np.ndarray]
    """(N,), NaN where a cell is empty."""
    headers: dict[str, str]
    """Channel -> column of the file."""


def load_unchecked(
    path: Path,
    spec: RecordingSpec,
    units: Mapping[str, str] | None = None,
    progress: Watching | None = None,
) -> Unchecked:
    """What `load_recording` would check, for those who look for faults in it. InputError for no
    table, a unit that does not fit, or a cell that is no number."""
    with np.errstate(over="ignore", invalid="ignore"):
        table = read_table(path, progress)
        check_numbers(table)
        sources = find_sources(table, spec, units or {})
        if "t" in sources:
            table = _even(table, spec, sources).table
        values = {c: s.factor * table.numbers(s.header) for c, s in sources.items()}
    time = values.pop("t", None)
    if time is not None:
        low, high = spec.window or (-np.inf, np.inf)
        # Rows without a time are kept: they are one of the faults.
        keep = ~((time < low) | (time > high))
        time, values = time[keep], {c: v[keep] for c, v in values.items()}
        part = _complete(values, len(time), spec.gaps)
        time = time[part]
        values = {c: _without_gaps(c, v[part], time, spec.gaps) for c, v in values.items()}
    return Unchecked(table, time, values, {c: s.header for c, s in sources.items()})


def _complete(values: Mapping[str, np.ndarray], N: int, gaps: GapsSpec | None) -> slice:
    """The rows, of N, that are kept: the longest complete stretch where gaps are cut."""
    if gaps is None or gaps.how != "cut":
        return slice(0, N)
    empties = (np.isnan(v) for c, v in values.items() if not _sparse(c))
    return longest_complete([empty for empty in empties if not empty.all()], N)


def _without_gaps(
    channel: str, values: np.ndarray, time: np.ndarray, gaps: GapsSpec | None
) -> np.ndarray:
    """Without the gaps of which a person has said that they are bridged."""
    if gaps is None or gaps.how == "cut" or _sparse(channel):
        return values
    steps = np.diff(time[np.isfinite(time)])
    usual = float(np.median(steps)) if steps.size else 0.0
    most = int(gaps.longest / usual + 0.5) if usual > 0 else len(values)
    return bridged(values, max(most, 1), channel_kind(channel).pattern in INPUTS)


def _sparse(channel: str) -> bool:
    return channel_kind(channel).sparse


def file_stem(file: str) -> str:
    """`th_0.5` of `data/th_0.5.csv.gz`."""
    path = Path(file)
    return path.name[: -len(known_suffix(path)) or None] or path.name


def _even(table: Table, spec: RecordingSpec, sources: Mapping[str, Source]) -> Even:
    """The table on an even clock where the scenario says so."""
    if spec.resample is None:
        return Even(table, 1, "")
    clock = sources["t"]
    _check_sizes(table, clock.header, clock.factor * table.numbers(clock.header), 0)
    headers = {c: s.header for c, s in sources.items()}
    return even_table(table, headers, clock.factor, spec.resample, spec.window)


def _read_time(table: Table, spec: RecordingSpec, source: Source) -> tuple[slice, np.ndarray]:
    time = source.factor * table.numbers(source.header)
    _check_sizes(table, source.header, time, 0)
    check_rising(table, source.header, time)
    rows = choose_rows(table, source.header, time, spec.window)
    return rows, even_time(table, source.header, time[rows], rows.start)


def _numbers(table: Table, source: Source, rows: slice) -> np.ndarray:
    values = source.factor * table.numbers(source.header)[rows]
    _check_sizes(table, source.header, values, rows.start)
    return values


def _cut(table: Table, time: np.ndarray) -> np.ndarray:
    if len(time) < MIN_SAMPLES:
        raise InputError(
            f"{table.source} has no {MIN_SAMPLES} successive rows without an empty cell; bridge "
            f'the gaps with gaps = {{ how = "interpolate" }}.'
        )
    return time


def _check_gaps(
    table: Table, channel: str, header: str, values: np.ndarray, first: int, time: np.ndarray,
    spec: RecordingSpec,
) -> None:  # fmt: skip
    """Empty cells are let through where somebody has said what happens to them."""
    empty = np.flatnonzero(np.isnan(values))
    if not empty.size or _sparse(channel):
        return
    if spec.gaps is not None:
        raise InputError(
            f"{table.source}: column {header} has a gap from {time[empty[0]]:.6g} s on that is "
            f"longer than gaps.longest ({spec.gaps.longest:g} s) or at an end; raise longest, cut, "
            f"or set a window."
        )
    row = table.row(first + int(empty[0]))
    row += " of the resampled table" if spec.resample is not None else ""
    raise InputError(
        f"{table.source}: column {header} is empty in {row}; only camera and strain columns may "
        f"have empty cells. Fill the cell, cut the row off with window, or state what happens to "
        f'gaps, such as gaps = {{ how = "mask" }}.'
    )


def _check_sizes(table: Table, header: str, values: np.ndarray, first_row: int) -> None:
    """Squares and sums of what is further used must stay numbers."""
    huge = np.flatnonzero(np.abs(values) > LARGEST)
    if huge.size:
        k = int(huge[0])
        raise InputError(
            f"{table.source}: column {header} holds {values[k]:.3g} (SI) in "
            f"{table.row(first_row + k)}, beyond the range of any sensor; correct it."
        )


def _remarks(header: str, values: np.ndarray) -> list[str]:
    sampled = values[np.isfinite(values)]
    remarks = []
    if np.ptp(sampled) == 0.0:
        remarks.append(f"Column {header} never changes (it is {sampled[0]:g}).")
    if len(sampled) < len(values):
        share = 100.0 * len(sampled) / len(values)
        remarks.append(f"Column {header} has a sample in {share:.3g} % of the rows.")
    return remarks


def _apply_camera(
    channels: dict[str, np.ndarray], spec: RecordingSpec, dt: float, source: str
) -> list[str]:
    """Turn the camera's channels into the base frame and its clock into the logger's."""
    names = [name for name in channels if channel_kind(name).camera]
    pose = spec.camera.pose()
    if (pose.origin, pose.angle, pose.scale) != ((0.0, 0.0), 0.0, 1.0):
        if "z1" not in channels or "z2" not in channels:
            raise InputError(
                f"{source}: the camera's pose needs both columns z1 and z2; "
                f"add them, or leave out origin, angle and scale."
            )
        channels["z1"], channels["z2"] = in_base_frame(channels["z1"], channels["z2"], pose)
    if spec.time_shift == 0.0:
        return []
    for name in names:
        channels[name] = shifted(channels[name], spec.time_shift / dt)
        if np.isnan(channels[name]).all():
            raise InputError(
                f"{source}: a time_shift of {spec.time_shift:g} s moves every sample of {name} out "
                f"of the recording; make it smaller."
            )
    return [] if names else ["time_shift has no effect, because there is no camera column."]


def outside(time: np.ndarray, stretches: Sequence[tuple[float, float]]) -> np.ndarray:
    """(N,) whether a time is in none of the stretches."""
    counted = np.ones(len(time), dtype=bool)
    for low, high in stretches:
        counted &= (time < low) | (time > high)
    return counted
