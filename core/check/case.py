"""One recording of a scenario, with what several checks need."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..check.column_fault import ColumnFault
from ..check.column_search import Search, search
from ..check.comparison import Comparison
from ..check.finding import Finding, Picture
from ..check.lengths import tip_products, wrong_lengths
from ..check.measured_recording import MeasuredRecording
from ..check.signals import jumps
from ..recording.channels import channel_kind
from ..units import parse_header

MOST_POINTS = 600
"""Points of a picture; a screen shows no more."""


@dataclass(frozen=True)
class Case:
    """What a check looks at."""

    recording: MeasuredRecording
    others: list[Case] = field(default_factory=list, repr=False, compare=False)
    """The scenario's other recordings."""
    place: int = 0
    """How many of them come before."""
    stopped: Callable[[], bool] = field(default=lambda: False, repr=False, compare=False)
    sized: bool = True
    """Whether gains, offsets, delays and clocks are asked for."""

    @cached_property
    def jumps(self) -> tuple[ColumnFault, ...]:
        """Encoders that are shifted from a sample on."""
        return tuple(_jumps(self.recording))

    @cached_property
    def tip_products(self) -> np.ndarray | None:
        """What its camera and encoders show of the links: see `core.check.lengths`."""
        return None if self.jumps else tip_products(self.recording)

    @cached_property
    def wrong_lengths(self) -> dict[int, float]:
        """Segment (from 0) -> its length in m as all recordings show it, where another is stated;
        none without a camera here."""
        own, model = self.tip_products, self.recording.model
        if model is None or own is None:
            return {}
        others = (o.tip_products for o in self.others)
        return wrong_lengths(model.arm, [own, *(p for p in others if p is not None)])

    @cached_property
    def comparison(self) -> Comparison | None:
        """With a model, once the encoders' jumps are taken back; None where it lacks something, or
        is that of another arm."""
        return None if self.wrong_lengths else Comparison.of(self.recording, self.jumps)

    @cached_property
    def search(self) -> Search | None:
        """Of the columns with a model; None where the recording lacks something."""
        if self.comparison is None:
            return None
        before = self.others[: self.place]
        searches = [c.search for c in before]
        return search(self.comparison, [s for s in searches if s], self.stopped, self.sized)

    @cached_property
    def wrong_columns(self) -> tuple[ColumnFault, ...]:
        """Faults of whole columns, one after the other."""
        return (*self.jumps, *(() if self.search is None else self.search.faults))

    def finding(
        self, fault: str, channel: str, size: float, unit: str, evidence: str,
        fix: str | None = None, modelled: bool = False,
    ) -> Finding:  # fmt: skip
        """A finding of a `size` in its `unit` about a channel of this recording, with its picture;
        `modelled`: beside what the other channels make of it."""
        evidence = evidence if evidence.endswith(".") else f"{evidence}."
        picture = self._beside_model(channel) if modelled else self._picture(channel)
        name = self.recording.name
        return Finding(fault, name, channel, float(size), unit, evidence, fix, picture)

    def columns(self, wanted: Mapping[str, tuple[str, Mapping[str, Any]]]) -> str | None:
        """`columns = { z1 = { name = "z1 [mm]" } }` of channel -> (source channel, settings); None
        if a source is in no file."""
        entries = []
        for channel, (source, settings) in wanted.items():
            header = self.recording.headers.get(source)
            if header is None:
                return None
            unit = settings.get("unit")
            named = f"{parse_header(header)[0]} [{unit}]" if unit else header
            other_settings = "".join(f", {k} = {v}" for k, v in settings.items() if k != "unit")
            entries.append(f'{channel} = {{ name = "{named}"{other_settings} }}')
        return f"columns = {{ {', '.join(entries)} }}"

    def _picture(self, channel: str) -> Picture | None:
        if channel not in self.recording.channels:
            return None
        thin = slice(None, None, max(self.recording.rows // MOST_POINTS, 1))
        shown, unit = self.recording.channels[channel][thin], channel_kind(channel).units[0]
        return Picture(self.recording.time[thin], shown, None, unit)

    def _beside_model(self, channel: str) -> Picture | None:
        equations = () if self.search is None else self.search.fit.answer.of(channel)
        if self.comparison is None or not equations:
            return self._picture(channel)
        recorded, last = self.comparison.recording, equations[-1]
        good = np.isfinite(recorded[channel])
        shown = np.interp(last.time, recorded.time[good], recorded[channel][good])
        return Picture(last.time, shown, last.modelled, channel_kind(channel).units[0])


def _jumps(recording: MeasuredRecording) -> Iterator[ColumnFault]:
    for name in recording.names("theta#"):
        for k, shift in jumps(recording.even(name)):
            since = float(recording.grid[k] - 0.5 * recording.step)
            yield ColumnFault("offset", (name,), shift=shift, since=since)
