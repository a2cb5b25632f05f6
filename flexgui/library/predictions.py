"""Predicted outputs with their bands, and the profile of a parameter: frozen, as tables and
figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.recording.recording import Recording
from flexgui.core.results import Profile as Found
from flexgui.library.shown import from_dict
from flexgui.views.prediction import prediction
from flexgui.views.profile import interval_sentence, profile

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


@dataclass(frozen=True, repr=False)
class Prediction:
    """A predicted experiment, and how far its outputs may be from that."""

    recording: Recording
    """Without noise, at the estimates."""
    spread: Mapping[str, np.ndarray]
    """Output -> (N,) standard deviation that the estimates' uncertainty causes, SI"""
    noise: Mapping[str, float]
    """Output -> standard deviation of the measurements about the identified model, SI; none for
    outputs that were not compared"""
    level: float
    """Probability of the bands."""
    units: Mapping[str, str] = field(default_factory=dict)

    def band(self, channel: str) -> tuple[np.ndarray, np.ndarray]:
        """Compute the band in which a measurement lies.

        Args:
            channel: An output, a key of `spread`.

        Returns:
            Lower and upper end (N,), SI.
        """
        from scipy.stats import norm

        std = np.hypot(self.spread[channel], self.noise.get(channel, 0.0))
        middle, half = self.recording[channel], norm.ppf(0.5 + self.level / 2.0) * std
        return middle - half, middle + half

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate time in s and, of each output, prediction, lower and upper end, SI."""
        import pandas as pd

        columns = {"t": self.recording.time}
        for channel in self.spread:
            lower, upper = self.band(channel)
            parts = {"": self.recording[channel], " lower": lower, " upper": upper}
            columns |= {f"{channel}{part}": values for part, values in parts.items()}
        return pd.DataFrame(columns)

    def plot(self) -> go.Figure:
        """Draw each output with its band."""
        bands = {channel: self.band(channel) for channel in self.spread}
        return from_dict(prediction(self.recording, bands, self.units, self.level))

    def __repr__(self) -> str:
        r = self.recording
        return (
            f"Prediction {r.name}: {len(r.time)} samples at {r.sample_time:g} s, "
            f"{100.0 * self.level:g} % bands of {', '.join(self.spread)}."
        )


@dataclass(frozen=True, repr=False)
class Profile:
    """The profile likelihood of one parameter: how much worse the best fit is beside its
    estimate."""

    found: Found
    """Values (K,), deviance (K,) and the values of the other parameters (K, others)."""

    @property
    def interval(self) -> tuple[float, float]:
        """The values that the recordings do not exclude, SI; infinite without an end."""
        return self.found.interval

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate values, deviance, and what the others were then, SI."""
        import pandas as pd

        others = dict(zip(self.found.others, self.found.paths.T, strict=True))
        own = {self.found.estimate.label: self.found.values, "deviance": self.found.deviance}
        return pd.DataFrame({**own, **others})

    def plot(self) -> go.Figure:
        """Draw the deviance over the parameter, and how the others follow."""
        return from_dict(profile(self.found))

    def __repr__(self) -> str:
        return f"Profile of {interval_sentence(self.found)}"
