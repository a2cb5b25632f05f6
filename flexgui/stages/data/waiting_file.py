"""An uploaded file whose columns are not assigned to channels yet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from flexgui.core.arm.arm import Arm
from flexgui.core.errors import InputError
from flexgui.core.recording.channels import (
    channel_kind,
    channel_names,
    is_channel,
    is_reference,
    joint_of,
)
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sensors import sensors
from flexgui.core.units import parse_header
from flexgui.sentences.written import channel_symbol
from flexgui.session.scenario_edits import apply_edits, cached_model
from flexgui.stages.data.inspect import Inspection, RigColumns
from flexgui.stages.data.rigs import RIGS, rig_edit
from flexgui.stages.data.rows import SPLIT, Rows, chosen_headers, settings

POINT = "theta2"
"""The channel that says at which working point the arm stood, where nothing else does."""


@dataclass(frozen=True)
class Companion:
    """A file with the same columns as the waiting one, uploaded with it."""

    file: str
    rows: Rows
    """What its rows are like."""


@dataclass(frozen=True)
class WaitingFile:
    """An uploaded file that is read after its columns are assigned."""

    file: str
    headers: tuple[str, ...]
    """Of its columns."""
    offered: tuple[str, ...]
    """Channels that the arm may have; those that every recording needs come first."""
    needed: frozenset[str]
    useful: frozenset[str] = frozenset()
    """Asked for as well; a file may have none of them."""
    units: Mapping[str, str] = field(default_factory=dict)
    """SI units of the joints' channels."""
    columns: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Channel -> the scenario's entry under `columns`."""
    headers_of: dict[str, str] = field(default_factory=dict)
    """Channel -> the header that was chosen for it."""
    absent: frozenset[str] = frozenset()
    """Channels of which the person said that the file has none."""
    theta2: float | None = None
    """rad (m): where joint 2 stood, in a file without a column of it."""
    recording: str = ""
    """The recording that is read again; a new one where empty."""
    inspection: Inspection | None = None
    """What a first look into the file has found; None before it."""
    gaps: str = ""
    """How gaps are treated (`GapsSpec.how`); empty: as `rows.settings` proposes."""
    clock: str = "interpolate"
    """How uneven rows are made even, as in `resample` of a scenario."""
    rate: float | None = None
    """Hz, that is kept of a fast log; None: all of it."""
    companions: tuple[Companion, ...] = ()
    """Files that are read with the same columns."""

    def guessed(self, inspection: Inspection) -> WaitingFile:
        """With the columns that the inspection guesses."""
        columns = {c: {"gain": 1.0, "sign": 1, **entry} for c, entry in inspection.columns.items()}
        chosen = chosen_headers(self.headers, columns)
        return replace(self, columns=columns, headers_of=chosen, inspection=inspection)

    @property
    def rows(self) -> tuple[Rows, ...]:
        """Gaps and clock of the file and its companions."""
        own = Rows() if self.inspection is None else self.inspection.rows
        return (own, *(each.rows for each in self.companions))

    @property
    def files(self) -> tuple[str, ...]:
        """The file and its companions."""
        return (self.file, *(each.file for each in self.companions))

    def settings(self, index: int = 0) -> dict[str, Any]:
        """The scenario's entries on clock and gaps of one of the files."""
        entries = settings(self.rows[index], self.gaps, self.clock)
        if self.recording and "windows" in entries:  # it is one recording and stays one
            entries = settings(self.rows[index], "cut", self.clock)
        if self.rate is not None:
            entries["resample"] = {**entries.get("resample", {}), "rate": self.rate}
        return entries

    @property
    def gaps_chosen(self) -> str:
        """How gaps are treated now; empty if no file has gaps."""
        settings = [self.settings(k) for k in range(len(self.rows))]
        ways = (SPLIT if "windows" in each else str(each["gaps"]["how"])
                for each in settings if "gaps" in each)  # fmt: skip
        return next(ways, "")

    def wording_of(self, channel: str) -> tuple[str, str] | None:
        """Fault and evidence of a channel whose guess was not changed."""
        inspection = self.inspection
        if inspection is None or self.columns.get(channel) != self._as_guessed(channel):
            return None
        return inspection.findings.get(channel)

    def _as_guessed(self, channel: str) -> dict[str, Any] | None:
        entry = None if self.inspection is None else self.inspection.columns.get(channel)
        return None if entry is None else {"gain": 1.0, "sign": 1, **entry}

    @property
    def known(self) -> dict[str, str]:
        """Channel -> header: assigned columns, then columns named as a channel."""
        taken = set(self.headers_of.values())
        own = {parse_header(h)[0]: h for h in self.headers if h not in taken}
        plain = {name: h for name, h in own.items() if is_channel(name)}
        return {**plain, **self.headers_of}

    @property
    def _held(self) -> frozenset[str]:
        return frozenset({*self.known, *((POINT,) if self.theta2 is not None else ())})

    @property
    def unused(self) -> tuple[str, ...]:
        """Columns that are not assigned yet, in the file's order."""
        used = set(self.known.values())
        return tuple(header for header in self.headers if header not in used)

    @property
    def missing(self) -> tuple[str, ...]:
        """Required channels without a column, in order."""
        return tuple(c for c in self.offered if c in self.needed - self._held)

    @property
    def questions(self) -> tuple[str, ...]:
        """Channels to ask for: required ones, and optional ones while columns are unused."""
        open_ = self.useful - self._held - self.absent if self.unused else frozenset()
        more = [c for c in self.offered if c in open_]
        return tuple(dict.fromkeys((*self.missing, *more)))

    @property
    def suits(self) -> str:
        """Another kind of rig that the columns fit, if they do not fit this one."""
        own = self.needed - {"t", POINT}
        other = bool(own) and own <= set(self.missing)
        return self.inspection.rig if self.inspection is not None and other else ""

    def mapped(self, channel: str, header: str, gain: float, sign: int, unit: str) -> WaitingFile:
        """With one more channel assigned, the column times the factors `gain` and `sign`;
        InputError if the column is assigned already."""
        other = next((c for c, h in self.headers_of.items() if h == header and c != channel), None)
        if other is not None:
            raise InputError(
                f"Column {header} is already {self.words(other)}. Choose another column, or start "
                f"over."
            )
        name, stated = parse_header(header)
        wanted = f"{name} [{unit.strip()}]" if unit.strip() and not stated else header
        entry = {"name": wanted, "gain": gain, "sign": sign}
        return replace(
            self,
            columns={**self.columns, channel: entry},
            headers_of={**self.headers_of, channel: header},
            theta2=None if channel == POINT and not self.recording else self.theta2,
        )

    def without(self, channel: str) -> WaitingFile:
        """With the answer that the file has no such column."""
        return replace(self, absent=self.absent | {channel})

    def without_answers(self) -> WaitingFile:
        """Without all answers."""
        theta2 = self.theta2 if self.recording else None
        inspection = self.inspection and replace(self.inspection, findings={}, taken_in={}, rig="")
        return replace(
            self,
            columns={},
            headers_of={},
            absent=frozenset(),
            theta2=theta2,
            inspection=inspection,
        )

    def words(self, channel: str) -> str:
        """'the time t [s]'"""
        kind = channel_kind(channel)
        name, star = (channel[:-4], "*") if channel.endswith("_ref") else (channel, "")
        unit = self.units.get(channel, kind.units[0])
        return f"the {kind.title} {channel_symbol(name, unit)}{star}{f' [{unit}]' if unit else ''}"


def waiting_for(
    file: str, headers: tuple[str, ...], arm: Arm, references: Iterable[str]
) -> WaitingFile | None:
    """The waiting file; None if its columns need no questions."""
    waiting = _waiting(file, headers, arm, tuple(references))
    return waiting if waiting.questions else None


def waiting_again(
    headers: tuple[str, ...], arm: Arm, references: Iterable[str], spec: RecordingSpec
) -> WaitingFile:
    """A recording of the scenario whose columns are chosen again."""
    waiting = _waiting(spec.file or "", headers, arm, tuple(references))
    columns = {c: column.model_dump() for c, column in spec.columns.items()}
    chosen = chosen_headers(waiting.headers, columns)
    return replace(
        waiting, columns=columns, headers_of=chosen, theta2=spec.theta2, recording=spec.name
    )


def wanted_channels(arm: Arm, references: Iterable[str]) -> tuple[str, ...]:
    """Channels to look for in a file of that rig, without derived ones."""
    waiting = _waiting("", (), arm, tuple(references))
    derived = ("y", "ydot")
    channels = {*waiting.needed, *waiting.useful}
    bends = [f"deflection{k + 1}" for k, modes in enumerate(arm.modes) if modes]
    turns = any(segment.joint == "revolute" for segment in arm.segments)
    camera = ("z1", "z2") if turns else ()  # a slide's encoder says all that a camera could
    links = [c.name for s in sensors().values() if s.optional for c in s.channels(arm)]
    more = (*bends, *links, *camera)
    channels |= set(more)
    return tuple(c for c in waiting.offered if c in channels and c[:-1] not in derived)


def columns_of_rigs(scenario: Scenario) -> tuple[RigColumns, ...]:
    """Columns of a file of each kind of rig, with the scenario's arm if that fits."""
    columns = []
    for rig in RIGS:
        model = cached_model(apply_edits(scenario, rig_edit(scenario, rig)))
        needed = model.drive.needed_channels(model.arm)
        wanted = wanted_channels(model.arm, needed)
        columns.append(RigColumns(rig.title, frozenset(("t", *needed)), wanted, rig.signs))
    return tuple(columns)


def _waiting(
    file: str, headers: tuple[str, ...], arm: Arm, references: tuple[str, ...]
) -> WaitingFile:
    from flexgui.core.loading import joint_units

    encoders = tuple(f"theta{k + 1}" for k in range(arm.joints))
    # Where torques are recorded the encoders are enough; of a rig in loops the camera says most.
    loops = any(is_reference(name) for name in references)
    useful = (*encoders, *(("z1", "z2") if loops else ()))
    needed = ("t", *references, *((POINT,) if arm.joints > 1 else ()))
    joints = [(name, joint_of(name)) for name in channel_names()]
    own = [name for name, joint in joints if joint is None or joint < arm.joints]
    offered = tuple(dict.fromkeys(("t", *references, *useful, *own)))
    return WaitingFile(
        file, headers, offered, frozenset(needed), frozenset(useful), joint_units(arm)
    )
