"""What a check says: data, not prose alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from core.check.case import Case


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

    def as_json(self) -> dict[str, Any]:
        """Without the picture."""
        return {k: v for k, v in asdict(self).items() if k != "picture"}


class Check(ABC):
    """Looks for one kind of fault in one recording."""

    kind = ""
    """The id of the fault."""

    @abstractmethod
    def look(self, case: Case) -> Iterable[Finding]:
        """What it finds; nothing in good data."""
