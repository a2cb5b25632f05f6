"""Findings of a check as data, and how their line of TOML changes a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..units import parse_header

if TYPE_CHECKING:
    from ..check.case import Case


@dataclass(frozen=True)
class Picture:
    """Evidence as two curves over time; (K,) each."""

    time: np.ndarray
    shown: np.ndarray
    """The channel, or its residual."""
    expected: np.ndarray | None = None
    """The channel as predicted by the others."""
    unit: str = ""


@dataclass(frozen=True)
class Finding:
    """One fault of one channel."""

    fault: str
    recording: str
    channel: str
    size: float
    unit: str
    evidence: str
    """A sentence."""
    fix: str | None = None
    """The line of TOML, in the recording's table, that fixes it; None if none is safe."""
    picture: Picture | None = field(default=None, compare=False)
    is_fault: bool = True
    """False: no fault, but worth knowing."""

    @property
    def sentence(self) -> str:
        """Where, what and why, with the line that fixes it."""
        fix = f" In its table: {self.fix}" if self.fix else ""
        return f"{self.recording}, {self.channel}: {self.fault}. {self.evidence}{fix}"

    def as_json(self) -> dict[str, Any]:
        """The finding for a script, with the line that fixes it under `mend`."""
        shown = {k: v for k, v in asdict(self).items() if k not in ("picture", "is_fault", "fix")}
        return {**shown, "mend": self.fix}


class Check(ABC):
    """Looks for one kind of fault in one recording."""

    kind = ""
    """Id of the fault; of a check for several, its own id."""
    compares_channels: ClassVar[bool] = False
    """Whether it compares channels with what the others predict, which takes seconds."""

    @abstractmethod
    def find(self, case: Case) -> Iterable[Finding]:
        """The findings of this check; none in good data."""


Entry = dict[str, Any]

RESAMPLE_LINE = 'resample = { how = "interpolate" }'
"""Fixes the clock alone; if the rows were sampled evenly and only the stamps scatter, `count` is
right, which the file does not show."""


def fixed_columns(before: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """`columns` of a recording, updated by a line. A column of the file keeps its unit, gain and
    sign for any channel; those of the line multiply them, as the check saw the channel with
    them."""
    entries = {c: _entry(entry) for c, entry in before.items()}
    of_header = {parse_header(entry["name"])[0]: entry for entry in entries.values()}
    after = dict(before)
    for channel, value in line.items():
        stated = _entry(value)
        stated_entry = of_header.get(parse_header(stated["name"])[0], {"name": stated["name"]})
        name = stated["name"] if parse_header(stated["name"])[1] else stated_entry["name"]
        factors = {
            key: stated_entry.get(key, 1) * stated.get(key, 1)
            for key in ("gain", "sign")
            if key in stated_entry or key in stated
        }
        after[channel] = {"name": name, **factors}
    return after


def _entry(value: Any) -> Entry:
    return {"name": value} if isinstance(value, str) else dict(value)
