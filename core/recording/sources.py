"""Which column of a file holds which channel of a recording, and its factor to SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from core.errors import InputError
from core.recording.channels import channel_kind, is_channel
from core.recording.spec import RecordingSpec
from core.recording.table import Table, is_number, number
from core.sentences import did_you_mean, few
from core.written import factor_to_si, parse_header


class Source(NamedTuple):
    """Where a channel comes from."""

    header: str
    factor: float


def check_numbers(table: Table) -> None:
    """A text that is no table of measurements is nobody's to quote in a sentence."""
    if table.unusable or any(_is_numeric(column) for column in table.columns.values()):
        return
    raise InputError(
        f"{table.source} is no table of measurements: no column holds numbers; choose another file."
    )


def _is_numeric(column: np.ndarray) -> bool:
    """Whether any cell is a number; a slip among numbers has a sentence of its own."""
    if column.dtype != object:
        return bool(np.isfinite(column).any())
    return any(is_number(cell) and np.isfinite(number(cell)) for cell in column)


def find_sources(table: Table, spec: RecordingSpec, units: Mapping[str, str]) -> dict[str, Source]:
    """Which column holds which channel: mapped ones first, then columns of a channel's name."""
    sources: dict[str, Source] = {}
    for channel, column in spec.columns.items():
        header = _mapped_header(table, channel, column.name)
        unit = parse_header(column.name)[1] or parse_header(header)[1]
        factor = column.factor * _unit_factor(table, header, unit, channel, units)
        sources[channel] = Source(header, factor)
    taken = {source.header for source in sources.values()}
    mapped = set(sources)
    for header in table.columns:
        name, unit = parse_header(header)
        if header in taken or not is_channel(name) or name in mapped:
            continue
        if name in sources:
            raise InputError(
                f"{table.source} has two columns {name} ([{parse_header(sources[name].header)[1]}] "
                f"and [{unit}]); remove one, or choose one under columns."
            )
        sources[name] = Source(header, _unit_factor(table, header, unit, name, units))
    return sources


def _mapped_header(table: Table, channel: str, wanted: str) -> str:
    """The header that `columns` means: the very text, or the same name with or without a unit."""
    name, unit = parse_header(wanted)
    everything = (*table.columns, *table.unusable)
    fitting = [h for h in everything if h == wanted] or [
        h for h in everything if parse_header(h)[0] == name
    ]
    fitting = fitting or [h for whole, h in table.paths.items() if parse_header(whole)[0] == name]
    if not fitting:
        raise InputError(
            f"{table.source} has no column {name}, which columns.{channel} names; "
            f"{nearest(table, name)}"
        )
    header = fitting[0]
    if header in table.unusable:
        raise InputError(
            f"{table.source}: column {header} {table.unusable[header]}; store it as one vector "
            f"with a value per sample."
        )
    in_file = parse_header(header)[1]
    if unit and in_file and unit != in_file:
        raise InputError(
            f"{table.source}: column {header} is in [{in_file}] by its header and in [{unit}] by "
            f"columns.{channel}; correct one of them."
        )
    return header


def _unit_factor(
    table: Table, header: str, unit: str, channel: str, units: Mapping[str, str]
) -> float:
    known = (units[channel],) if channel in units else channel_kind(channel).units
    try:
        return factor_to_si(unit, known)
    except InputError as error:
        raise InputError(f"{table.source}: column {header}: {error}.") from error


def nearest(table: Table, name: str) -> str:
    """The end of a sentence about a column that a table lacks: what stands there instead."""
    same = [h for h in table.unusable if parse_header(h)[0] == name]
    if same:
        return f"what it calls {same[0]} {table.unusable[same[0]]}."
    return did_you_mean(name, [parse_header(header)[0] for header in table.columns])


def check_named(table: Table, spec: RecordingSpec, sources: dict[str, Source]) -> None:
    """What a mask or a logger's filter speaks of must be there."""
    for setting, names in (("mask", spec.mask), ("logger_filter", spec.logger_filter)):
        for name in names:
            if name not in sources or name == "t":
                raise InputError(
                    f"{table.source}: {setting} names the channel {name}, but no column holds it; "
                    f"{did_you_mean(name, [n for n in sources if n != 't'])}"
                )


def unused(table: Table, sources: dict[str, Source]) -> list[str]:
    """A sentence on the columns that are no channel's source; none where there are none."""
    used = {source.header for source in sources.values()}
    left = [h for h in (*table.columns, *table.unusable) if h not in used]
    return [f"Not used from {table.source}: {few(left)}."] if left else []
