"""What a check says, data and not prose alone, and what its line of TOML does to a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..units import parse_header

if TYPE_CHECKING:
    from ..check.case import Case


@dataclass(frozen=True)
class Picture:
    """Evidence as two curves over time; (K,) each."""

    time: np.ndarray
    shown: np.ndarray
    """The channel, or what is left of it."""
    expected: np.ndarray | None = None
    """What the other channels say it should be."""
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
    mend: str | None = None
    """The line of TOML, in the recording's table, that mends it; None where nothing safe does."""
    picture: Picture | None = field(default=None, compare=False)
    is_fault: bool = True
    """False: nothing is wrong, but it is worth knowing."""

    @property
    def sentence(self) -> str:
        """Where, what and why, with the line that mends it."""
        mend = f" In its table: {self.mend}" if self.mend else ""
        return f"{self.recording}, {self.channel}: {self.fault}. {self.evidence}{mend}"

    def as_json(self) -> dict[str, Any]:
        """What a script needs to find and mend it."""
        return {k: v for k, v in asdict(self).items() if k not in ("picture", "is_fault")}


class Check(ABC):
    """Looks for one kind of fault in one recording."""

    kind = ""
    """The id of the fault; of a check that looks for several, its own."""

    @abstractmethod
    def look(self, case: Case) -> Iterable[Finding]:
        """What it finds; nothing in good data."""


Entry = dict[str, Any]

RESAMPLE_LINE = 'resample = { how = "interpolate" }'
"""Mends what is wrong with the clock alone; where the rows were taken evenly and only the stamps
scatter, `count` is right, which nobody can see in the file."""


def fixed_columns(before: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """`columns` of a recording with those of a line on top.

    A column of the file keeps its unit, gain and sign, whichever channel it goes to; what the line
    says of them multiplies them, since the check saw the channel with them.
    """
    entries = {c: _entry(entry) for c, entry in before.items()}
    of_header = {parse_header(entry["name"])[0]: entry for entry in entries.values()}
    after = dict(before)
    for channel, value in line.items():
        stated = _entry(value)
        known = of_header.get(parse_header(stated["name"])[0], {"name": stated["name"]})
        name = stated["name"] if parse_header(stated["name"])[1] else known["name"]
        factors = {
            key: known.get(key, 1) * stated.get(key, 1)
            for key in ("gain", "sign")
            if key in known or key in stated
        }
        after[channel] = {"name": name, **factors}
    return after


def _entry(value: Any) -> Entry:
    return {"name": value} if isinstance(value, str) else dict(value)
