"""What an identification gives: shown in notebooks, as tables and as figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.recording.channels import channel_kind
from flexgui.core.results.identification import labelled
from flexgui.core.sentences import few, listed
from flexgui.library.comparison import Simulation
from flexgui.library.run_result import RunResult
from flexgui.library.shown import chosen, looked_up
from flexgui.sentences.identifiability import sentences_of_fits
from flexgui.views.convergence import convergence
from flexgui.views.fit_table import fit_dots
from flexgui.views.headline import (
    fitted_values,
)
from flexgui.views.identifiability import correlation, valley
from flexgui.views.names import is_of_a_start
from flexgui.views.pooled import ESTIMATE, channel_errors, with_role

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

    from flexgui.library.linear_model import LinearModel
    from flexgui.library.predictions import Prediction


@dataclass(frozen=True, repr=False)
class Identification(RunResult):
    """Estimated parameters, and how far the measurements fix them."""

    @property
    def words(self) -> tuple[str, ...]:
        """What the measurements leave free, in words, a sentence each."""
        return sentences_of_fits(self.outcome.fits)

    def covariance(self) -> pd.DataFrame:
        """Tabulate the covariance of the estimates, in their SI units.

        It holds for coloured residuals, and only if the model is complete. What the measurements
        leave free has NaN. Of local fits there is a block per recording.

        Returns:
            Square, parameters by parameters: `name`, or `name@recording` of one recording's own.
        """
        import pandas as pd

        local = len(self.outcome.fits) > 1
        blocks = []
        for fit in self.outcome.fits:
            shown = [k for k, e in enumerate(fit.estimates) if not is_of_a_start(e)]
            estimates = [fit.estimates[k] for k in shown]
            names = [labelled(e.name, fit.label) if local else e.label for e in estimates]
            std = np.array([np.nan if e.std is None else e.std for e in estimates])
            correlation = fit.correlation[np.ix_(shown, shown)]
            blocks.append(pd.DataFrame(correlation * np.outer(std, std), names, names))
        return pd.concat(blocks)

    def simulate(self, *, recording: str | None = None, **settings: Any) -> Simulation:
        """Predict an experiment with the identified model; without noise unless stated.

        Args:
            recording: The one whose own values are taken; None: what all recordings share.
            **settings: As for `Project.simulate`: references, theta2, seconds, noise, ...

        Returns:
            The predicted recording.

        Raises:
            InputError: Where a setting is wrong, or a parameter differs by recording and neither
                `recording` nor `values` says its value.
        """
        values = self._values_in(recording, settings.pop("values", None))
        return self.given.simulate(**{"noise": False, **settings, "values": values})

    def predict(
        self, *, recording: str | None = None, level: float = 0.95, **settings: Any
    ) -> Prediction:
        """Predict an experiment with the bands in which its measurements will lie.

        The uncertainty of the estimates, by their covariance, and the noise that was seen about
        the model on the recordings to estimate go through to the outputs. The bands hold only if
        the model is complete.

        Args:
            recording: As for `simulate`.
            level: Probability of the bands.
            **settings: As for `Project.simulate`: references, theta2, seconds, ...

        Returns:
            The predicted recording with its bands.

        Raises:
            InputError: As for `simulate`.
        """
        from flexgui.library.predictions import Prediction

        middle = self.simulate(recording=recording, **settings)
        values = self._values_in(recording, settings.pop("values", None))
        moved = [
            self.simulate(recording=recording, values={**values, **shift}, **settings).recording
            for shift in self._deviations(values, recording)
        ]
        outputs = [name for name in middle.recording.channels if not channel_kind(name).reference]
        spread = {name: np.zeros(len(middle.recording.time)) for name in outputs}
        for below, above in zip(moved[::2], moved[1::2], strict=True):
            for name in outputs:
                spread[name] = np.hypot(spread[name], 0.5 * (above[name] - below[name]))
        seen = with_role(self.outcome.comparisons, ESTIMATE)
        noise = {e.channel: e.rms for e in channel_errors(seen)}
        return Prediction(middle.recording, spread, noise, level, middle.units)

    def _deviations(
        self, values: Mapping[str, float], recording: str | None
    ) -> Iterator[dict[str, float]]:
        """Values one deviation below and above the estimates, along each principal axis of their
        covariance; what the recordings leave free stays."""
        estimates = {
            e.label: e
            for e in self.parameters
            if e.name in values and e.recording in (None, recording) and np.isfinite(e.std)
        }
        table = self.covariance()
        labels = [label for label in estimates if label in table.index]
        sizes, axes = np.linalg.eigh(table.loc[labels, labels].to_numpy())
        for axis in (axes * np.sqrt(np.maximum(sizes, 0.0))).T:
            for sign in (-1.0, 1.0):
                yield {
                    e.name: float(np.clip(values[e.name] + sign * d, e.lower, e.upper))
                    for e, d in zip((estimates[x] for x in labels), axis, strict=True)
                }

    def _values_in(
        self, recording: str | None, stated: Mapping[str, float] | None
    ) -> dict[str, float]:
        """Of the model's own parameters: as stated, else as estimated for that recording."""
        known, stated = self.given.model.parameters, stated or {}
        fitted = [name for fit in self.outcome.fits for name in fit.recordings]
        estimated = self.values
        if recording is not None:
            looked_up(dict.fromkeys(fitted), recording, f"{recording!r} was not fitted")
            estimated = fitted_values(self.outcome, recording)
        missing = {e.name for e in self.parameters if e.name in known} - {*estimated, *stated}
        if missing:
            raise InputError(
                f"{listed(sorted(missing))} differs by recording; add recording= with one of "
                f"{few(fitted)}, or values= with a number for it."
            )
        return {**{n: x for n, x in estimated.items() if n in known}, **stated}

    def linear(self, *, recording: str | None = None, **where: Any) -> LinearModel:
        """Linearise the identified model.

        Args:
            recording: The one whose own values are taken; None: what all recordings share.
            **where: As for `Project.linear`: theta, theta2, output, values.

        Returns:
            The linear model with the estimated values.

        Raises:
            InputError: As for `simulate`.
        """
        values = self._values_in(recording, where.pop("values", None))
        return self.given.linear(values=values, **where)

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate the parameters: value, std, unit, bounds, identifiable."""
        from flexgui.export.tables import table

        return table(self.outcome, "parameters")

    def plot(self, view: str = "fit") -> go.Figure:
        """Draw the identification.

        Args:
            view: 'fit', 'convergence', 'valley' or 'correlation'.

        Raises:
            InputError: Where the view is not known or there is nothing to show.
        """
        fits = self.outcome.fits
        views: dict[str, Any] = {
            "fit": lambda: fit_dots(self.outcome.comparisons),
            "convergence": lambda: convergence(fits),
            "valley": lambda: valley(fits),
            "correlation": lambda: correlation(fits[0]),
        }
        return chosen(views, view)
