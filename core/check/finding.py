"""Findings of a check as data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

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

    @property
    def key(self) -> str:
        """Channel and fault, as a recording's `dismissed` names it."""
        return f"{self.channel}: {self.fault}"

    def as_json(self) -> dict[str, Any]:
        """The finding for a script, with the line that fixes it under `mend`."""
        shown = {k: v for k, v in asdict(self).items() if k not in ("picture", "is_fault", "fix")}
        return {**shown, "mend": self.fix}


class Check(ABC):
    """Looks for one kind of fault in one recording."""

    kind = ""
    """Id of the fault; of a check for several, its own id."""

    @abstractmethod
    def find(self, case: Case) -> Iterable[Finding]:
        """The findings of this check; none in good data."""


RESAMPLE_LINE = 'resample = { how = "interpolate" }'
"""Fixes the clock alone; if the rows were sampled evenly and only the stamps scatter, `count` is
right, which the file does not show."""
