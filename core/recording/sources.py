"""Which column of a file holds which channel of a recording, and its factor to SI.

The scenario or the column's name states it; else it is guessed from name and numbers, shown, and
verified by the check of the recording.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from ..errors import InputError
from ..recording.channels import channel_kind, is_channel
from ..recording.spec import UNKNOWN, RecordingSpec
from ..recording.table import Table, is_number, number
from ..sentences import did_you_mean, few
from ..units import factor_to_si, is_unit, parse_header, same_unit


class Source(NamedTuple):
    """Where a channel comes from."""

    header: str
    factor: float


def check_numbers(table: Table) -> None:
    """InputError where no column has numbers: a text that is no table of measurements is nobody's
    to quote in a sentence."""
    if table.unusable or any(has_numbers(column) for column in table.columns.values()):
        return
    raise InputError(
        f"{table.source} is not a table of measurements: no column has numbers; choose another "
        f"file."
    )


def has_numbers(column: np.ndarray) -> bool:
    """Whether any cell of a column (N,) is a number: a text beside it is a slip."""
    if column.dtype != object:
        return bool(np.isfinite(column).any())
    return any(is_number(cell) and np.isfinite(number(cell)) for cell in column)


def find_sources(table: Table, spec: RecordingSpec, units: Mapping[str, str]) -> dict[str, Source]:
    """Which column holds which channel: mapped ones first, then columns of a channel's name;
    InputError where two have it."""
    sources: dict[str, Source] = {}
    for channel, column in spec.columns.items():
        header = _mapped_header(table, channel, column.name)
        unit = parse_header(column.name)[1] or parse_header(header)[1]
        known = column.gain != UNKNOWN
        in_si = _unit_factor(table, header, unit, channel, units) if known else 1.0
        factor = column.factor * in_si
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


def _mapped_header(table: Table, channel: str, stated: str) -> str:
    """The header that `columns` means: the very text, or the same name with or without a unit."""
    name, unit = parse_header(stated)
    everything = (*table.columns, *table.unusable)
    fitting = [h for h in everything if h == stated] or [
        h for h in everything if parse_header(h)[0] == name
    ]
    fitting = fitting or [
        h for full_path, h in table.paths.items() if parse_header(full_path)[0] == name
    ]
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
    if unit and in_file and not same_unit(unit, in_file):
        raise InputError(
            f"{table.source}: column {header} is in [{in_file}] by its header and in [{unit}] by "
            f"columns.{channel}; correct one of them."
        )
    return header


def _unit_factor(
    table: Table, header: str, unit: str, channel: str, units: Mapping[str, str]
) -> float:
    si_units = (units[channel],) if channel in units else channel_kind(channel).units
    try:
        return factor_to_si(unit, si_units)
    except InputError as error:
        raise InputError(f"{table.source}: column {header}: {error}.") from None


def nearest(table: Table, name: str) -> str:
    """The end of a sentence about a column that a table lacks: what stands there instead."""
    same = [h for h in table.unusable if parse_header(h)[0] == name]
    if same:
        return f"its column {same[0]} {table.unusable[same[0]]}."
    return did_you_mean(name, [parse_header(header)[0] for header in table.columns])


def check_named(table: Table, spec: RecordingSpec, sources: dict[str, Source]) -> None:
    """What a mask or a logger's filter speaks of must be there; else InputError."""
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


SPELLINGS: dict[str, tuple[str, ...]] = {
    "time": ("t", "time", "clock", "timestamp", "stamp", "zeit", "sec", "seconds", "temps"),
    "reference": (
        "ref", "reference", "set", "setpoint", "cmd", "command", "commanded", "des", "desired",
        "target", "soll", "goal", "sp",
    ),
    "speed": (
        "vel", "velocity", "speed", "qd", "dq", "qdot", "omega", "rate", "dtheta", "thetadot", "w",
    ),
    "position": (
        "theta", "q", "pos", "position", "angle", "ang", "enc", "encoder", "phi", "joint", "winkel",
        "motor", "th", "alpha", "actual", "ist", "slide",
    ),
    "torque": ("torque", "tau", "moment", "u", "force", "trq", "f", "effort"),
    "current": ("current", "i", "cur", "amp", "amps", "ampere", "strom", "iq"),
    "voltage": ("voltage", "volt", "volts", "v", "vm", "um", "spannung"),
    "camera": ("cam", "camera", "tip", "ee", "effector", "marker", "mocap", "tcp", "z", "x", "y"),
    "deflection": (
        "deflection", "defl", "strain", "gauge", "bend", "bending", "dms", "flex", "alpha", "eps",
        "microstrain",
    ),
    "strain": ("strain", "gauge", "dms", "eps", "microstrain"),
    "acceleration": ("acceleration", "accelerometer", "accel", "acc"),
    "gyro": ("gyro", "gyroscope"),
    "link": ("link", "load", "arm", "output", "second", "secondary"),
    "known": ("pulse", "pulses", "known", "extra", "disturbance", "external"),
}  # fmt: skip
"""Kind of word -> how laboratories and drives write it, in lower case."""

MEANS: dict[str, tuple[str, ...]] = {
    "t": ("time",),
    "dtheta#_ref": ("reference", "speed"),
    "theta#_ref": ("reference", "position"),
    "theta#": ("position",),
    "u#": ("torque",),
    "i#_ref": ("reference", "current"),
    "i#": ("current",),
    "voltage#": ("voltage",),
    "known_torque#": ("known",),
    "z#": ("camera",),
    "deflection#": ("deflection",),
    "link_theta#": ("link", "position"),
    "strain#": ("deflection", "strain"),
    "acceleration#": ("acceleration",),
    "gyro#": ("gyro",),
}
"""Pattern of a channel -> the kinds of word that its heading should have."""

JOINT = {"first": 1, "one": 1, "shoulder": 1, "base": 1, "second": 2, "two": 2, "elbow": 2,
         "x": 1, "y": 2}  # fmt: skip
"""Words that state the number of a joint or an axis."""

UNIT_SPELLINGS = {
    "deg": "deg", "degree": "deg", "degrees": "deg", "mm": "mm", "cm": "cm", "ms": "ms", "us": "us",
    "rpm": "rpm", "mnm": "mN m", "ma": "mA", "mv": "mV", "mrad": "mrad", "degps": "deg/s",
    "dps": "deg/s",
}  # fmt: skip
"""Parts of a name that are a unit."""

FITS, HALF, WRONG, NUMBERED, MISNUMBERED = 4.0, 1.5, -3.0, 2.0, -4.0
"""Scores: each kind of word that is there, one of two, one that belongs to another channel, the
right number and a wrong one. One wrong word weighs more than a number that fits."""
UNIT_FITS, MORE_WORDS = 1.0, -0.1
"""Scores of a unit that the channel may have, and of each word that it does not need: they decide
where two channels fit."""
LEAST_SCORE = 2.0
"""Score below which nothing is guessed: a number alone says nothing."""


@dataclass(frozen=True)
class Guess:
    """A column for a channel."""

    header: str
    unit: str = ""
    """Where the heading says one without brackets, as in `angle_deg`."""


def guess_columns(columns: Mapping[str, np.ndarray], channels: Sequence[str]) -> dict[str, Guess]:
    """Channel -> guess, for those of the wanted channels, most important first, of which a heading
    says enough. `columns`: header -> numbers (N,). No column is used twice; one of a channel's very
    name is that channel."""
    headers = list(columns)
    numbers = _numbered_from(headers)
    scores = np.array(
        [[_score(c, h, columns[h], numbers) for h in headers] for c in channels], dtype=float
    ).reshape(len(channels), len(headers))
    rows, chosen = scipy.optimize.linear_sum_assignment(-np.maximum(scores, 0.0))
    guesses = {
        channels[i]: Guess(headers[j], _unit_in(headers[j], channels[i]))
        for i, j in zip(rows, chosen, strict=True)
        if scores[i, j] >= LEAST_SCORE
    }
    for channel in [c for c in guesses if c.startswith("link_")]:
        only = channel.removeprefix("link_")
        if (
            only in channels and only not in guesses
        ):  # the joint's only encoder, whatever it is called
            guesses[only] = guesses.pop(channel)
    return {c: guesses[c] for c in channels if c in guesses}


def _parts(header: str) -> list[str]:
    """`Motor1_Pos (deg)` -> motor, 1, pos, deg"""
    name = re.sub(r"([a-z])([A-Z])", r"\1 \2", parse_header(header)[0])
    return re.findall(r"[a-zµ]+|\d+", name.lower())


def _numbered_from(headers: Sequence[str]) -> int:
    """1, or 0 where the file counts its joints from zero."""
    digits = {int(p) for h in headers for p in _parts(h) if p.isdigit()}
    return 0 if 0 in digits else 1


def _kinds(parts: Sequence[str]) -> set[str]:
    return {kind for kind, names in SPELLINGS.items() if any(p in names for p in parts)}


def _score(channel: str, header: str, values: np.ndarray, first: int) -> float:
    if is_channel(parse_header(header)[0]):  # it says itself what it is
        return 100.0 if parse_header(header)[0] == channel else WRONG
    pattern, parts = channel_kind(channel).pattern, _parts(header)
    wants, has = MEANS.get(pattern, ()), _kinds(parts)
    if channel == "t":
        rising = len(values) > 1 and bool(np.all(np.diff(values[np.isfinite(values)]) > 0))
        return (FITS + NUMBERED if rising else 0.0) if "time" in has else (HALF + 1.0) * rising
    matching = sum(kind in has for kind in wants)
    if not wants or not matching:
        return WRONG
    score = FITS if matching == len(wants) else HALF * matching
    # 'q1_cmd' names a position and a reference: the second word excludes the plain encoder.
    apart = {"reference", "speed", "time", "torque", "current", "voltage", "deflection", "known",
             "acceleration", "gyro"}  # fmt: skip
    score += WRONG * len((has & apart) - set(wants)) + WRONG * (
        "link" in has and "link" not in wants
    )
    score += _units(channel, parse_header(header)[1]) + MORE_WORDS * len(has - set(wants))
    return score + _numbers(channel, parts, first)


def _units(channel: str, unit: str) -> float:
    if not unit:
        return 0.0
    try:
        factor_to_si(unit, channel_kind(channel).units)
    except InputError:
        return WRONG
    return UNIT_FITS


def _numbers(channel: str, parts: Sequence[str], first: int) -> float:
    own = re.search(r"\d", channel)
    indices = [int(p) + 1 - first for p in parts if p.isdigit()]
    indices += [] if indices else [JOINT[p] for p in parts if p in JOINT]
    if own is None or not indices:
        return 0.0
    return NUMBERED if int(own.group()) in indices else MISNUMBERED


def _unit_in(header: str, channel: str) -> str:
    """The unit that the name itself ends in, for a heading without brackets."""
    if parse_header(header)[1] or parse_header(header)[0] == channel:
        return ""
    parts = _parts(header)
    unit = next((UNIT_SPELLINGS[p] for p in reversed(parts) if p in UNIT_SPELLINGS), "")
    speed = channel_kind(channel).units[0].endswith("/s")
    if unit and speed and not unit.endswith("/s") and unit != "rpm":
        unit = f"{unit}/s"
    return unit if is_unit(unit) else ""
