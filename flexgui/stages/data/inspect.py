"""Inspects an uploaded file in one job: pictures of its columns, guessed channels, its rows."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flexgui.core.arm.build import build_arm
from flexgui.core.check.finding import Finding
from flexgui.core.errors import InputError
from flexgui.core.recording.channels import is_channel
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.read_table import read_table
from flexgui.core.recording.sources import guess_columns, has_numbers
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.units import parse_header
from flexgui.stages.data.fixes import fixed_columns
from flexgui.stages.data.rows import Rows, headers_of, parted, rows, settings, unit_of
from flexgui.views.layout import trace
from flexgui.views.sketch import PANEL_POINTS

if TYPE_CHECKING:
    from flexgui.core.progress import Progress
    from flexgui.core.recording.table import Table
    from flexgui.core.scenario.schema import Scenario

ROUNDS = 3
"""Faults hide one another."""
SWAPPED = "swapped_joints"
TAKEN_IN = ("degrees", "millimetres", "sign", SWAPPED)
"""Faults that are nothing but a wrong guess of a column, its unit or its sign."""
CONTRADICT = (*TAKEN_IN, "gear_ratio", "scale", "offset", "delay", "clock_drift", "weak_excitation")
"""Faults by which the channels of a file contradict one another."""


class RigColumns(NamedTuple):
    """Columns that a file of one kind of rig holds."""

    title: str
    needed: frozenset[str]
    wanted: tuple[str, ...]
    signs: frozenset[str]
    """Words and units of headings of which one must be there; none: any will do."""


@dataclass(frozen=True)
class Inspection:
    """What the import shows of a file before it is read."""

    headers: tuple[str, ...]
    columns: Mapping[str, dict[str, Any]]
    """Channel -> the scenario's entry under `columns`, as guessed."""
    pictures: Mapping[str, tuple[np.ndarray, np.ndarray]]
    """Header -> rows and values (K,), as they stand in the file; NaN: a gap."""
    findings: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Channel -> fault and evidence, of what the check finds in the file as guessed."""
    taken_in: Mapping[str, str] = field(default_factory=dict)
    """Channel -> evidence that changed the guess."""
    rows: Rows = Rows()
    """Whether its rows are even in time, and what is empty."""
    rows_as_known: Rows | None = None
    """The same by columns that were chosen before, where the headings are the same."""
    words: str = ""
    """Length and rate, where the file can be read as it is; else empty."""
    unread: tuple[str, ...] = ()
    """A sentence on each column with a text among its numbers."""
    refusal: str = ""
    """Why it cannot be read as it is."""
    rig: str = ""
    """The kind of rig that its columns suit best; empty where they suit none."""


@dataclass(frozen=True)
class _File:
    """One file of a folder, for a scenario."""

    folder: Path
    name: str
    scenario: Scenario
    progress: Progress
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Of the recording, beside its columns."""

    def findings(self, columns: Mapping[str, Any]) -> tuple[Finding, ...]:
        """Findings about this file alone; none if it cannot be checked yet."""
        from flexgui.core.check.run_checks import check_scenario

        entry = {"name": self.name, "file": self.name, "columns": dict(columns)}
        entry |= self.settings
        try:
            specs = tuple(RecordingSpec.model_validate(part) for part in parted(entry))
            alone = self.scenario.model_copy(update={"recordings": specs})
            folder = ConfinedFolder(self.folder)
            # What a column is shows without sizes; these are asked for with all recordings.
            return tuple(check_scenario(alone, folder, None, self.progress, sized=False))
        except InputError:
            return ()


def inspect_file(
    folder: str,
    file: str,
    scenario: Scenario,
    wanted: tuple[str, ...],
    like: tuple[tuple[str, ...], Mapping[str, Any]] | None = None,
    rigs: Sequence[RigColumns] = (),
    *,
    progress: Progress,
) -> Inspection:
    """Inspects one file; InputError if it is not a table or not in the folder.

    Args:
        folder: The session's.
        file: A name in it.
        scenario: Whose arm and drive the file is to suit.
        wanted: Channels to look for, those that matter most first.
        like: Headings and columns of a file that waits already.
        rigs: Among which the one is sought that the columns suit.
        progress: How much of the file is read.
    """
    table = read_table(ConfinedFolder(Path(folder)).find(file), progress)
    numbers, unread = _numbers(table)
    titles = _usable(table, unread)
    if not numbers:
        raise InputError(
            f"{file} has no column of numbers; choose a table of measurements, one row per sample."
        )
    columns = _guessed(numbers, wanted)
    read = rows(numbers, headers_of(titles, columns), columns)
    inspected = _File(Path(folder), file, scenario, progress, settings(read))
    columns, findings, taken_in = _checked(inspected, columns, numbers)
    known = like[1] if like is not None and like[0] == titles else None
    words = refusal = ""
    try:
        words = read_file(folder, file, [{"file": file}], scenario, progress=progress)[0]
    except InputError as error:
        refusal = str(error)
    return Inspection(
        headers=titles,
        unread=tuple(s for h, s in unread.items() if has_numbers(table.columns[h])),
        columns=columns,
        pictures={h: trace(np.arange(len(x)), x, PANEL_POINTS) for h, x in numbers.items()},
        findings=findings,
        taken_in=taken_in,
        rows=rows(numbers, headers_of(titles, columns), columns),
        rows_as_known=rows(numbers, headers_of(titles, known), known) if known else None,
        words=words,
        refusal=refusal,
        rig=_suited(numbers, rigs),
    )


def _suited(numbers: Mapping[str, np.ndarray], rigs: Sequence[RigColumns]) -> str:
    """The rig that has all its signals and uses most columns; of equals the later one."""
    best, most = "", 0
    for rig in rigs:
        guesses = guess_columns(numbers, rig.wanted)
        names = [parse_header(guesses[c].header) for c in rig.needed if c in guesses]
        there = {word for name, _ in names for word in re.findall(r"[a-z]+", name.lower())}
        there |= {f"[{unit.lower()}]" for _, unit in names}
        suits = len(names) == len(rig.needed) and (not rig.signs or rig.signs & there)
        if suits and len(guesses) >= most:
            best, most = rig.title, len(guesses)
    return best


def headers(folder: str, file: str, *, progress: Progress) -> tuple[str, ...]:
    """The headings of a table; InputError if it is not one, or not in the folder."""
    table = read_table(ConfinedFolder(Path(folder)).find(file), progress)
    return _usable(table, _numbers(table)[1])


def read_file(
    folder: str,
    file: str,
    entries: Sequence[Mapping[str, Any]],
    scenario: Scenario,
    *,
    progress: Progress,
) -> tuple[str, ...]:
    """Length and rate of each recording of a file, as text; InputError if a signal is missing."""
    from flexgui.core.loading import joint_units

    model = base_model(scenario)
    references, units = model.drive.needed_channels(model.arm), joint_units(model.arm)
    path, words = ConfinedFolder(Path(folder)).find(file), []
    for entry in entries:
        spec = RecordingSpec.model_validate(dict(entry))
        recording = load_recording(path, spec, references, units, progress)
        if model.arm.joints > 1 and recording.theta2 is None and not recording.has("theta2"):
            raise InputError(f"{file} does not give the position of joint 2; add a column theta2.")
        name, samples = entry.get("name", file), len(recording.time)
        rate = 1.0 / recording.sample_time
        words.append(f"{name}: {samples} samples at {rate:.4g} Hz, {samples / rate:.2f} s.")
    return tuple(words)


def _numbers(table: Table) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Header -> (N,), of the columns that hold numbers, and why not of the others."""
    channels, unread = dict[str, np.ndarray](), dict[str, str]()
    for header in table.columns:
        try:
            channels[header] = table.numbers(header)
        except InputError as error:
            unread[header] = str(error)
    return channels, unread


def _usable(table: Table, unread: Mapping[str, str]) -> tuple[str, ...]:
    """Headers that a signal can be assigned to: no texts, unless they are named as a channel, which
    is refused with what stands in the way."""
    return tuple(h for h in table.columns if h not in unread or is_channel(parse_header(h)[0]))


def _guessed(numbers: Mapping[str, np.ndarray], wanted: tuple[str, ...]) -> dict[str, Any]:
    """Entries for `columns`; a column named as a channel needs none."""
    columns = {}
    for channel, guess in guess_columns(numbers, wanted).items():
        if parse_header(guess.header)[0] != channel:
            columns[channel] = {
                "name": f"{guess.header} [{guess.unit}]" if guess.unit else guess.header
            }
    return columns


def _checked(
    file: _File, columns: dict[str, Any], numbers: Mapping[str, np.ndarray]
) -> tuple[dict[str, Any], dict[str, tuple[str, str]], dict[str, str]]:
    """Guessed columns corrected by the check, remaining findings, and the reasons."""
    columns, taken_in = _in_plausible_units(file, columns, numbers)
    findings = file.findings(columns)
    for _ in range(ROUNDS):
        mended = [f for f in findings if f.fault in TAKEN_IN and f.fix is not None]
        if any(f.fault == SWAPPED for f in mended):
            mended = mended[:1]  # what comes after it is said of the swapped columns
        tried, reasons = columns, dict[str, str]()
        for finding in mended:
            line = tomllib.loads(finding.fix or "").get("columns", {})
            tried = fixed_columns(tried, line)
            reasons |= dict.fromkeys(line, finding.evidence)
        after = file.findings(tried) if mended else findings
        if _contradictions(after) >= _contradictions(findings):
            break  # nothing to mend, or it breaks another: the fault lies elsewhere
        columns, findings = tried, after
        taken_in |= reasons
    return columns, {f.channel: (f.fault, f.evidence) for f in findings}, taken_in


TURNS = 1.5
"""Turns of a joint beyond which its numbers are rather degrees: cables end before that."""
BEYOND = 5.0
"""Times the arm's reach beyond which a camera's numbers are rather millimetres."""


def _in_plausible_units(
    file: _File, columns: dict[str, Any], numbers: Mapping[str, np.ndarray]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Columns without a unit in degrees or mm, if rad or m are impossible."""
    arm = build_arm(file.scenario.arm)
    reach = sum(segment.length for segment in arm.segments)
    turning = [f"theta{k + 1}" for k, s in enumerate(arm.segments) if s.joint == "revolute"]
    headers = headers_of(tuple(numbers), columns)
    changed, findings = dict(columns), {}
    for kind, most, unit in ((turning, TURNS * 2.0 * np.pi, "deg"),
                             (["z1", "z2"], BEYOND * reach, "mm")):  # fmt: skip
        bare = [c for c in kind if c in headers and not unit_of(columns.get(c), headers[c])]
        sizes = [float(np.nanmax(np.abs(numbers[headers[c]]), initial=0.0)) for c in bare]
        if max(sizes, default=0.0) <= most:
            continue
        for c in bare:
            name = parse_header(headers[c])[0]
            changed[c] = {**columns.get(c, {}), "name": f"{name} [{unit}]"}
            findings[c] = f"Taken as {unit}: up to {max(sizes):.3g}."
    return changed, findings


def _contradictions(findings: Iterable[Finding]) -> int:
    """Number of findings about what a channel is, not about its quality."""
    return sum(finding.fault in CONTRADICT for finding in findings)
