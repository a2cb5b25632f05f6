"""A simulated recording, and measured against modelled: as tables and as figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.recording.clock import JITTER
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import recording_frame
from flexgui.core.recording.sources import find_sources
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.recording.table import Table, in_seconds
from flexgui.core.results import (
    ErrorMaps,
    RecordingComparison,
)
from flexgui.library.shown import chosen, from_dict, looked_up, paragraphs
from flexgui.views.comparison import comparison
from flexgui.views.fit_table import fit_dots, fit_table
from flexgui.views.missing_torque import missing_over_time, missing_over_velocity
from flexgui.views.of_recording import recording_views
from flexgui.views.of_recording.view import RecordingView, Seen, believable_floors
from flexgui.views.preview import preview
from flexgui.views.summary import quality
from flexgui.views.table import html_table

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

    from flexgui.library.residuals import ResidualAnalysis


@dataclass(frozen=True, repr=False)
class Simulation:
    """A recording made in simulation."""

    recording: Recording
    """The signals, SI."""
    units: Mapping[str, str] = field(default_factory=dict)
    """SI units of the channels of each joint, which turns or slides."""

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate time and channels; each heading has its unit, and `project` reads it back."""
        return recording_frame(self.recording, self.units)

    def plot(self) -> go.Figure:
        """Draw references and measurements over time."""
        joints = sum(name in self.units for name in ("u1", "u2", "u3"))
        slides = [self.units[f"theta{k + 1}"] == "m" for k in range(joints)]
        return from_dict(preview(self.recording, slides))

    def __repr__(self) -> str:
        r, names = self.recording, ", ".join(sorted(self.recording.channels))
        return f"Recording {r.name}: {len(r.time)} samples at {r.sample_time:g} s, {names}."

    def _repr_html_(self) -> str:
        return str(paragraphs([repr(self)]))


def with_its_clock(table: pd.DataFrame) -> pd.DataFrame:
    """With the index as a column where it is more than row numbers: named, or times."""
    times = table.index.dtype.kind in "mM" and "t" not in table
    if table.index.name is None and not times:
        return table
    return table.rename_axis(index=table.index.name or "t").reset_index()


def reference_signals(
    table: pd.DataFrame, channels: Sequence[str], units: Mapping[str, str]
) -> tuple[np.ndarray, dict[str, float]]:
    """References of one's own, and the clock on which they are played.

    Args:
        table: With `t`, at even times, and `channels`, in SI units or those of the headings.
        channels: References of the drive.
        units: SI units of the joints' channels.

    Returns:
        (N, channels), and the settings `seconds` and `sample_time` of an experiment.

    Raises:
        InputError: Where a column is missing, a value is no number, or times are not even.
    """
    columns = with_its_clock(table).items()
    read = Table("references", dict(in_seconds(str(h), c.to_numpy()) for h, c in columns))
    sources = find_sources(read, RecordingSpec(file=read.source), units)
    missing = [name for name in ("t", *channels) if name not in sources]
    if missing:
        raise InputError(
            f"references has no column {', '.join(missing)}; it needs t and {', '.join(channels)}."
        )
    ordered = [sources[name] for name in ("t", *channels)]
    numbers = np.column_stack([s.factor * read.numbers(s.header) for s in ordered])
    steps = np.diff(numbers[:, 0])
    if not np.isfinite(numbers).all() or len(numbers) < 2:
        raise InputError("references has an empty cell or fewer than two rows; fill every cell.")
    step = float(np.mean(steps))
    if step <= 0.0 or np.abs(steps - step).max() > JITTER * step:
        raise InputError("references: the times t are not even and increasing; resample the table.")
    return numbers[:, 1:], {"seconds": len(numbers) * step, "sample_time": step}


@dataclass(frozen=True, repr=False)
class Comparison:
    """Measured against modelled, recording by recording."""

    recordings: tuple[RecordingComparison, ...]
    """One per recording."""
    floors: Mapping[str, float] | None = None
    """channel -> floor in its unit, where a diagnosis has found them."""

    @cached_property
    def maps(self) -> ErrorMaps:
        """Where the model fails: errors by time, by frequency, and over the motion."""
        from flexgui.core.error_maps import error_maps

        floors = believable_floors(self.recordings) if self.floors is None else self.floors
        return error_maps(self.recordings, floors)

    def __getitem__(self, recording: str) -> RecordingComparison:
        """The comparison of the recording of that name.

        Args:
            recording: Its name.

        Raises:
            InputError: Where there is none.
        """
        known = {each.recording: each for each in self.recordings}
        return looked_up(known, recording, f"There is no recording {recording!r}")

    def to_dataframe(self, recording: str | None = None) -> pd.DataFrame:
        """Tabulate the errors, or the signals of one recording.

        Args:
            recording: Its name; None: a row per recording and output with FIT in %, rms, unit.

        Raises:
            InputError: Where there is no such recording.
        """
        from flexgui.export.tables import error_table, recording_table

        if recording is not None:
            return recording_table(self[recording])
        return error_table(self.recordings)

    def residuals(self, recording: str | None = None) -> pd.DataFrame:
        """Tabulate what the model misses: measured minus modelled, in SI units.

        Args:
            recording: Its name; None: all recordings below each other.

        Returns:
            Columns `recording`, `t` in s, and one per channel; NaN where nothing was measured.

        Raises:
            InputError: Where there is no such recording.
        """
        import pandas as pd

        comparisons = self.recordings if recording is None else (self[recording],)
        tables = {
            each.recording: pd.DataFrame(
                {c.channel: pd.Series(c.residual, index=c.time) for c in each.channels}
            )
            for each in comparisons
        }
        return pd.concat(tables, names=["recording", "t"]).reset_index()

    def residual_analysis(self, lags: int = 25, level: float = 0.99) -> ResidualAnalysis:
        """Ask whether what the model leaves is white and no longer follows the inputs.

        Args:
            lags: Of each correlation, in samples of the output.
            level: Probability of the bands, where the model is complete.

        Returns:
            Autocorrelations, correlations with the inputs, and frequency responses.
        """
        from flexgui.core.residual_analysis import residual_analysis
        from flexgui.library.residuals import ResidualAnalysis

        return ResidualAnalysis(residual_analysis(self.recordings, lags, level))

    def plot(self, view: str = "signals", recording: str | None = None) -> go.Figure:
        """Draw the comparison.

        Args:
            view: 'signals', 'fit', 'missing_torque', 'torque_over_velocity', or the id of a view
                in flexgui/views/of_recording such as 'error_by_frequency'.
            recording: Its name; the first where not given.

        Raises:
            InputError: Where view or recording is not known, or there is nothing to show.
        """
        seen = self.recordings[0] if recording is None else self[recording]
        fitted = [c for c in seen.channels if c.fitted]
        torques = seen.missing_torque
        views: dict[str, Any] = {
            "signals": lambda: comparison(seen, fitted or None),
            "fit": lambda: fit_dots(self.recordings),
            "missing_torque": lambda: missing_over_time(torques) if torques else None,
            "torque_over_velocity": lambda: missing_over_velocity(torques) if torques else None,
        }
        views |= {kind: self._drawn_by(one, seen) for kind, one in recording_views().items()}
        return chosen(views, view)

    def _drawn_by(self, view: RecordingView, current: RecordingComparison) -> Any:
        return lambda: view.draw(Seen(current, self.recordings, self.maps))

    def __repr__(self) -> str:
        reached = quality(self.recordings) or "nothing that was measured"
        return f"Comparison of {len(self.recordings)} recordings: the model reaches {reached}."

    def _repr_html_(self) -> str:
        return str(html_table(fit_table(self.recordings)))
