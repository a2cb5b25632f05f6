"""Previews: all channels of a recording, small columns, findings of the check."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from flexgui.core.check.finding import Finding
from flexgui.core.recording.channels import Role, channel_kind, is_channel, joint_of
from flexgui.core.recording.recording import Recording
from flexgui.sentences.written import (
    ShownUnit,
    channel_symbol,
    format_number,
    quantity,
    reference_symbol,
    shown_unit,
)
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, line, number, panes, trace
from flexgui.views.sketch import PANEL_POINTS, sparkline

PREVIEW_COLUMNS = 6
"""Of a file that is not read yet."""
ROWS, MOST_ROWS = 5, 8
"""More kinds than these do not fit beside the arm: the first ones are shown, and most where a
person has picked them."""
GROUPS = {
    Role.PLACE: "joint angles", Role.SPEED: "joint angles",
    Role.TORQUE: "torques", Role.CURRENT: "torques", Role.VOLTAGE: "torques",
    Role.KNOWN_TORQUE: "torques", Role.TIP: "tip",
    Role.DEFLECTION: "deflections", Role.RIGID: "fictitious rigid arm",
}  # fmt: skip
"""What a channel measures -> the group in which it is picked; others by the title of their kind."""
COMMANDED = "references"
ORDER = ("dtheta#_ref", "theta#_ref", "i#_ref", "u#", "i#", "theta#", "z#", "deflection#", "ydot#")
LAST = ("y#",)
"""Follow from others in most recordings."""
FLAT = 0.35
"""Share of an axis: signals that move less are drawn as changes from their start."""


def preview(
    recording: Recording, slides: Sequence[bool] = (), picked: Collection[str] | None = None
) -> Figure:
    """References and measurements over time in s; stretches that do not count are grey, and signals
    that stay the same are left out where others move.

    Args:
        recording: What is drawn.
        slides: For each joint whether it slides: its positions are in m then.
        picked: Of `groups`; None: the first kinds that fit.
    """
    kinds, parts = _kinds(recording, picked), []
    for names in kinds:
        starts = _starts(recording, names)
        values = np.concatenate([recording[n] - s for n, s in zip(names, starts, strict=True)])
        si = _unit(names[0], slides)
        unit = shown_unit(values, si)
        change = "Δ" if any(starts) else ""
        symbols = [reference_symbol(name, si) for name in names]
        label = unit.label(", ".join(change + symbol for symbol in symbols))
        each = zip(names, starts, symbols, strict=True)
        parts.append(Pane([_line(recording, n, s, unit, text) for n, s, text in each], axis(label)))
    shapes = masked(recording, kinds)
    return panes(parts, axis("time [s]"), hovermode="x unified", shapes=shapes)


def groups(recording: Recording) -> dict[str, bool]:
    """Groups of the recording's signals, in the order of the picture, and whether they are in it
    where nobody has picked any."""
    first = [_group(names[0]) for names in _kinds(recording, None)]
    every = [_group(names[0]) for names in _moving(_all_kinds(recording), recording)]
    return {group: group in first for group in every}


def _group(channel: str) -> str:
    kind = channel_kind(channel)
    return COMMANDED if kind.reference else GROUPS.get(kind.role, kind.title)


def planned(experiments: Sequence[Recording], slides: Sequence[bool] = ()) -> Figure | None:
    """References of planned experiments over time in s, a row each; None without any."""
    parts = []
    for place, references in enumerate(experiments, start=1):
        names = sorted(references.channels)
        si = _unit(names[0], slides)
        unit = shown_unit(np.concatenate([references[name] for name in names]), si)
        symbols = [reference_symbol(name, si) for name in names]
        lines = [_line(references, n, 0.0, unit, s) for n, s in zip(names, symbols, strict=True)]
        parts.append(Pane(lines, axis(f"{place}: {unit.label(', '.join(symbols))}", nticks=4)))
    height = AROUND + PER_EXPERIMENT * len(parts)
    return panes(parts, axis("time [s]"), "", height, hovermode="x unified") if parts else None


AROUND, PER_EXPERIMENT = 90, 110
"""px of the figure of planned references: its legend and axis, and each row."""


def constants(recording: Recording, slides: Sequence[bool] = ()) -> str:
    """'Constant: u₃ 0 N m.', of the signals that `preview` leaves out; empty without any."""
    every = _all_kinds(recording)
    shown = {name for names in _moving(every, recording) for name in names}
    left = [name for names in every for name in names if name not in shown]
    values = [
        f"{reference_symbol(n, u)} {quantity(_finite(recording[n])[0], u)}"
        for n, u in ((name, _unit(name, slides)) for name in left)
    ]
    return f"Constant: {', '.join(values)}." if values else ""


def constant_columns(pictures: Mapping[str, tuple[np.ndarray, np.ndarray]], time: str) -> str:
    """'Constant: gain 1.', of the columns that `as_in_file` leaves out; empty without any."""
    values = [
        f"{heading} {format_number(float(column[0]), 4)}"
        for heading, (_, column) in pictures.items()
        if heading != time and _is_constant([column])
    ]
    return f"Constant: {', '.join(values)}." if values else ""


def as_in_file(
    pictures: Mapping[str, tuple[np.ndarray, np.ndarray]], time: str, first: Sequence[str]
) -> Figure | None:
    """Columns of an unread file over time or rows, by heading; `first`: those on top.

    None where no column but the time changes.
    """
    ordered = [
        heading
        for heading in dict.fromkeys((*first, *pictures))
        if heading in pictures and heading != time and not _is_constant([pictures[heading][1]])
    ]
    clock, parts = pictures.get(time, ((), ())), list[Pane]()
    for k, heading in enumerate(ordered[:PREVIEW_COLUMNS]):
        rows, values = pictures[heading]
        x = np.interp(rows, *clock) if len(clock[0]) else rows
        hover = "%{y:.4g}<extra></extra>"
        drawn = line(x, values, "", colours.series(k), hover, width=1.3)
        parts.append(Pane([drawn], axis(heading, nticks=4)))
    return panes(parts, axis(time or "row"), hovermode="x unified") if parts else None


def _starts(recording: Recording, names: Sequence[str]) -> list[float]:
    """Offsets to subtract from each signal; zeros if the signals are drawn as they are."""
    finite = [_finite(recording[name]) for name in names]
    if not all(values.size for values in finite):
        return [0.0] * len(names)
    whole = np.concatenate([*finite, [0.0]])
    span, moved = float(np.ptp(whole)), max(float(np.ptp(values)) for values in finite)
    flat = 0.0 < moved < FLAT * span
    return [float(values[0]) if flat else 0.0 for values in finite]


def _kinds(recording: Recording, picked: Collection[str] | None) -> list[list[str]]:
    every = _moving(_all_kinds(recording), recording)
    if picked is None:
        return every[:ROWS]
    return [names for names in every if _group(names[0]) in picked][:MOST_ROWS]


def _all_kinds(recording: Recording) -> list[list[str]]:
    by_kind: dict[str, list[str]] = {}
    for name in sorted(recording.channels):
        by_kind.setdefault(channel_kind(name).pattern, []).append(name)
    first = [p for p in ORDER if p in by_kind]
    others = [p for p in by_kind if p not in (*ORDER, *LAST)]
    last = [p for p in LAST if p in by_kind]
    return [by_kind[p] for p in (*first, *others, *last)]


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _is_constant(signals: Sequence[np.ndarray]) -> bool:
    """Whether none of some signals (N,) each changes."""
    return all(len(kept := _finite(values)) and np.ptp(kept) == 0.0 for values in signals)


def _moving(kinds: list[list[str]], recording: Recording) -> list[list[str]]:
    """The kinds with a signal that changes; all of them where nothing does."""
    signals = {name: recording[name] for names in kinds for name in names}
    moving = [names for names in kinds if not _is_constant([signals[n] for n in names])]
    return moving or kinds


def _unit(name: str, slides: Sequence[bool]) -> str:
    """The first of a channel's units belongs to joints that turn, the second to slides."""
    units, joint = channel_kind(name).units, joint_of(name)
    sliding = joint is not None and joint < len(slides) and slides[joint]
    return units[-1] if sliding else units[0]


def _line(recording: Recording, name: str, start: float, unit: ShownUnit, symbol: str) -> Figure:
    """A line in the colour and dash of its joint."""
    x, y = trace(recording.time, (recording[name] - start) * unit.factor, PANEL_POINTS)
    joint = joint_of(name)
    style = colours.joint(int(re.sub(r"\D", "", name) or 1) - 1)
    colour = colours.MEASURED if joint is None else style["color"]
    group = f"tip {symbol}" if joint is None else f"joint {joint + 1}"
    hover = f"{'Δ' if start else ''}{symbol} %{{y:.4g}} {unit.name}<extra></extra>"
    return line(x, y, group, colour, hover, width=1.3, dash=style["dash"])


def masked(recording: Recording, kinds: Sequence[Sequence[str]]) -> list[Figure]:
    """Grey bands over the masked time ranges of a channel."""
    shapes = []
    for row, names in enumerate(kinds):
        for name in names:
            counted = recording.counted.get(name, np.ones(0))
            edges = np.flatnonzero(np.diff(np.concatenate([[1], counted.astype(int), [1]])))
            shapes += [
                {
                    "type": "rect", "xref": "x", "yref": f"y{number(row)} domain",
                    "x0": float(recording.time[start]), "x1": float(recording.time[stop - 1]),
                    "y0": 0, "y1": 1,
                    "fillcolor": colours.faded(colours.START, 0.35), "line": {"width": 0},
                }
                for start, stop in edges.reshape(-1, 2)
            ]  # fmt: skip
    return shapes


SIZE = (340, 54)
"""px: five of them and their sentences fit a screen of 900."""

TITLES = {
    "degrees": "Degrees, not radians",
    "millimetres": "Millimetres, not metres",
    "sign": "Wrong sign",
    "swapped_joints": "Swapped columns",
    "gear_ratio": "Gear ratio missing",
    "scale": "Wrong scale",
    "tip": "Camera and encoders disagree",
    "stated_length": "Length as stated",
    "stated_stiffness": "Stiffness as stated",
    "delay": "Delayed",
    "dead": "Frozen",
    "clipped": "Clipped",
    "quantised": "Coarsely quantised",
    "dropouts": "Missing samples",
    "repeated_times": "Repeated time stamps",
    "jitter": "Jittering clock",
    "sample_time": "Wrong sample time",
    "clock_drift": "Drifting clock",
    "time_unit": "Unit of the time",
    "outliers": "Outliers",
    "offset": "Offset",
    "weak_excitation": "Weak excitation",
    "drive_saturated": "Saturated drive",
    "repeated_cycles": "Repeated cycles",
    "starts_moving": "Starts in motion",
    "different_rig": "Another rig",
}
"""Of the faults that ship; another one is called by its id."""


def title_of(fault: str) -> str:
    """Title of a fault."""
    return TITLES.get(fault, fault.replace("_", " ").capitalize())


def finding_html(finding: Finding) -> Markup:
    """Title, picture and evidence of a finding."""
    title, symbol = title_of(finding.fault), channel_symbol(finding.channel)
    head = Markup("<p><b>{}</b> {}</p>").format(title, symbol)
    evidence = Markup("<p class='soft'>{}</p>").format(with_symbols(finding.evidence))
    return head + _picture(finding) + evidence


def _picture(finding: Finding) -> Markup:
    picture = finding.picture
    if picture is None or len(picture.time) < 2:
        return Markup("")
    title = f"{finding.channel} over time"
    shown, expected = _apart(picture.shown, picture.expected)
    return sparkline(picture.time, shown, expected, SIZE, title)


FLAT_ENOUGH = 0.1
"""Share of the picture's height below which both curves are drawn as changes from their medians: a
sign or a unit puts them so far apart that neither is seen to move."""


def _apart(shown: np.ndarray, expected: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Both signals as they are, or both without their medians."""
    if expected is None or not np.isfinite(shown).any() or not np.isfinite(expected).any():
        return shown, expected
    both = [shown[np.isfinite(shown)], expected[np.isfinite(expected)]]
    whole = float(np.ptp(np.concatenate(both)))
    if max(float(np.ptp(x)) for x in both) >= FLAT_ENOUGH * whole:
        return shown, expected
    return shown - np.median(both[0]), expected - np.median(both[1])


def with_symbols(sentence: str) -> str:
    """The text with symbols instead of channel names: θ₁ for theta1."""

    def symbol(word: re.Match[str]) -> str:
        name = word.group()
        return reference_symbol(name) if is_channel(name) and name != "t" else name

    return re.sub(r"[a-z_]+\d(?:_ref)?", symbol, sentence)


def lines_applied(lines: Sequence[str]) -> Markup:
    """Lines that fixes have added to the scenario."""
    if not lines:
        return Markup("")
    items = Markup("").join(Markup("<li>{}</li>").format(line) for line in lines)
    return Markup("<p class='soft'>In the scenario now:</p><ul class='soft'>{}</ul>").format(items)
