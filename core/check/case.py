"""One recording among those of its scenario, with what several checks need of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from core.check.finding import Finding, Picture
from core.check.geometry import Misfit, geometric_misfits
from core.check.measured import Measured
from core.check.relations import Relation, relations
from core.check.suspects import Suspect, suspects
from core.recording.channels import channel_kind
from core.units import parse_header

MOST_POINTS = 600
"""Of a picture; a column on a screen is not wider."""


@dataclass(frozen=True)
class Case:
    """What a check looks at."""

    recording: Measured
    others: Sequence[Case] = field(default=(), repr=False, compare=False)
    """The scenario's other recordings."""

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """Channels that contradict the arm's geometry, with the factor or shift that mends it."""
        return geometric_misfits(self.recording)

    @cached_property
    def relations(self) -> tuple[Relation, ...]:
        """What the channels say of each other."""
        return relations(self.recording, self.misfits)

    @cached_property
    def suspects(self) -> tuple[Suspect, ...]:
        """The channels that disagree with all others by a factor or a delay."""
        return suspects(self.relations, [other.relations for other in self.others])

    def finding(
        self, fault: str, channel: str, size: float, unit: str, evidence: str,
        mend: str | None = None, expected: np.ndarray | None = None,
    ) -> Finding:  # fmt: skip
        """A finding about a channel of this recording, with its picture."""
        evidence = evidence if evidence.endswith(".") else f"{evidence}."
        picture = self._picture(channel, expected)
        name = self.recording.name
        return Finding(fault, name, channel, float(size), unit, evidence, mend, picture)

    def column(self, channel: str, **settings: object) -> str | None:
        """`columns = {z1 = {name = "z1 [mm]"}}`; None where no file holds the channel."""
        header = self.recording.headers.get(channel)
        if header is None:
            return None
        unit = settings.pop("unit", "")
        name = parse_header(header)[0]
        named = f"{name} [{unit}]" if unit else header
        rest = "".join(f", {key} = {value}" for key, value in settings.items())
        return f'columns = {{ {channel} = {{ name = "{named}"{rest} }} }}'

    def _picture(self, channel: str, expected: np.ndarray | None) -> Picture | None:
        if channel not in self.recording.channels:
            return None
        thin = slice(None, None, max(self.recording.rows // MOST_POINTS, 1))
        unit = channel_kind(channel).units[0]
        shown = self.recording.channels[channel][thin]
        return Picture(self.recording.time[thin], shown, expected, unit)
