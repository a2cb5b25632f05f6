"""A file whose columns have names of their own: which of them holds which channel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from core.arm.arm import Arm
from core.errors import InputError
from core.recording.channels import channel_names, joint_of
from core.recording.read_table import read_table
from core.recording.spec import RecordingSpec
from core.units import parse_header


@dataclass(frozen=True)
class Waiting:
    """A file that is read once a person has said what its columns hold."""

    file: str
    headers: tuple[str, ...]
    """Of its columns."""
    offered: tuple[str, ...]
    """Channels that the arm may have; those that every recording needs come first."""
    needed: frozenset[str]
    columns: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Channel -> the scenario's entry under `columns`."""
    recording: str = ""
    """The recording that is read anew; a new one where empty."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Needed channels that nothing holds yet, in order."""
        own = {parse_header(header)[0] for header in self.headers}
        return tuple(c for c in self.offered if c in self.needed - own - set(self.columns))

    def mapped(self, channel: str, header: str, gain: float, sign: int, unit: str) -> Waiting:
        """With one more channel known; `unit` is for a heading without one."""
        name, stated = parse_header(header)
        wanted = f"{name} [{unit.strip()}]" if unit.strip() and not stated else header
        entry = {"name": wanted, "gain": gain, "sign": sign}
        return replace(self, columns={**self.columns, channel: entry})


def waiting_for(path: Path, arm: Arm, needed: Iterable[str]) -> Waiting | None:
    """None where the file cannot be read at all, or has every needed column by its name."""
    try:
        headers = tuple(read_table(path).columns)
    except InputError:
        return None
    found = Waiting(path.name, headers, _offered(arm, needed), frozenset(("t", *needed)))
    return found if found.missing else None


def waiting_again(path: Path, arm: Arm, needed: Iterable[str], spec: RecordingSpec) -> Waiting:
    """A recording of the scenario, to choose other columns; InputError where its file is gone."""
    headers = tuple(read_table(path).columns)
    columns = {c: column.model_dump() for c, column in spec.columns.items()}
    wanted = frozenset(("t", *needed))
    return Waiting(path.name, headers, _offered(arm, needed), wanted, columns, spec.name)


def _offered(arm: Arm, needed: Iterable[str]) -> tuple[str, ...]:
    first = ("t", *needed)
    joints = [(name, joint_of(name)) for name in channel_names()]
    own = [name for name, joint in joints if joint is None or joint < arm.joints]
    return tuple(dict.fromkeys((*first, *own)))
