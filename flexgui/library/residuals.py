"""Residual analysis as tables, figures and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flexgui.core.residual_analysis import MeasuredResponse, ResidualCorrelation
from flexgui.core.residual_analysis import ResidualAnalysis as Found
from flexgui.library.shown import chosen, looked_up
from flexgui.sentences.written import format_number
from flexgui.views.residual_analysis import correlations, responses

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


@dataclass(frozen=True, repr=False)
class ResidualAnalysis:
    """Whether what a model leaves is white and no longer follows the inputs.

    Where the model is complete, a correlation lies in its band with the stated probability. A
    residual that is correlated with an input holds dynamics that the model lacks; one that is
    correlated with itself alone may be coloured noise.
    """

    _found: Found

    @property
    def correlations(self) -> tuple[ResidualCorrelation, ...]:
        """Per recording and output, with itself (`input` is empty) and with each input."""
        return self._found.correlations

    @property
    def responses(self) -> tuple[MeasuredResponse, ...]:
        """Measured and modelled frequency responses, per recording, output and input."""
        return self._found.responses

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate the correlations: share of lags outside the band, and the worst lag in s."""
        from flexgui.export.tables import residual_table

        return residual_table(self._found)

    def plot(self, view: str = "correlations", recording: str | None = None) -> go.Figure:
        """Draw the analysis of one recording.

        Args:
            view: 'correlations' or 'responses'.
            recording: Its name; the first where not given.

        Raises:
            InputError: Where view or recording is not known, or there is nothing to show.
        """
        names = dict.fromkeys(c.recording for c in self.correlations)
        name = recording or next(iter(names), "")
        looked_up(names, name, f"There is no recording {name!r} with enough samples")
        views: dict[str, Any] = {
            "correlations": lambda: correlations(self._found, name),
            "responses": lambda: responses(self._found, name),
        }
        return chosen(views, view)

    def __repr__(self) -> str:
        groups = {
            "themselves": [c for c in self.correlations if not c.input],
            "the inputs": [c for c in self.correlations if c.input],
        }
        level = format_number(100.0 * self._found.level, 3)
        lines = [f"Residual analysis, bands of {level} %:"]
        lines += [f"  with {name}: {_share(group)}" for name, group in groups.items() if group]
        return "\n".join(lines)


def _share(group: Sequence[ResidualCorrelation]) -> str:
    outside = sum(c.outside for c in group) / len(group)
    worst = max(group, key=lambda c: abs(c.value[c.worst]) / c.band[c.worst])
    ratio = abs(worst.value[worst.worst]) / worst.band[worst.worst]
    place = f"{worst.channel} of {worst.recording}" + (f", {worst.input}" if worst.input else "")
    return (
        f"{format_number(100.0 * outside, 2)} % of the lags lie outside; the furthest is "
        f"{format_number(ratio, 2)} times its band ({place})."
    )
