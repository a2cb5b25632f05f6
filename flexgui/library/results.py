"""What an identification and a diagnosis give: shown in notebooks, as tables and as figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgui.core.diagnosed_scenario import diagnosed_scenario, identified_scenario
from flexgui.core.errors import InputError
from flexgui.core.information_criteria import InformationCriteria
from flexgui.core.recording.channels import channel_kind
from flexgui.core.results import (
    Estimate,
    LadderStep,
    Outcome,
    Proposal,
    RankedEffect,
)
from flexgui.core.results.identification import labelled
from flexgui.core.sentences import few, listed
from flexgui.library.comparison import Comparison, Simulation
from flexgui.library.progress_callback import Callback, at_work
from flexgui.library.shown import chosen, looked_up, paragraphs
from flexgui.sentences.identifiability import sentences_of_fits
from flexgui.sentences.verdict import all_paragraphs
from flexgui.views.convergence import convergence
from flexgui.views.fit_table import fit_dots
from flexgui.views.headline import (
    comparisons_as_given,
    criteria,
    final_comparisons,
    final_estimates,
    fitted_values,
)
from flexgui.views.identifiability import correlation, valley
from flexgui.views.ladder import ladder, ladder_table
from flexgui.views.names import is_of_a_start
from flexgui.views.parameter_tables import final_parameters
from flexgui.views.pooled import ESTIMATE, channel_errors, with_role
from flexgui.views.ranking import ranking, ranking_table
from flexgui.views.summary import alarms, plain, result_lines, summary
from flexgui.views.table import html_table

if TYPE_CHECKING:
    import casadi
    import pandas as pd
    import plotly.graph_objects as go

    from flexgui.library.linear_model import LinearModel
    from flexgui.library.predictions import Prediction, Profile
    from flexgui.library.project import Project
    from flexgui.library.residuals import ResidualAnalysis


@dataclass(frozen=True, repr=False)
class _Found:
    """What every result of a run has."""

    given: Project
    """The project that was run."""
    outcome: Outcome
    """Everything that was computed, as the report shows it."""

    @property
    def parameters(self) -> tuple[Estimate, ...]:
        """Estimates of the model as it now stands; of local fits their means."""
        return final_estimates(self.outcome)

    @property
    def values(self) -> dict[str, float]:
        """Parameter -> value in its SI unit, of what all recordings share."""
        return {e.name: e.value for e in self.parameters if e.recording is None}

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a parameter: value, std, unit, identifiable.

        Args:
            name: Of the parameter; `name@recording` where each recording has its own.

        Raises:
            InputError: Where it was not estimated, or several recordings have one.
        """
        known = {e.label: e for e in self.parameters}
        if own := [label for label, e in known.items() if e.name == name != label]:
            raise InputError(f"{name!r} differs by recording; choose one of {few(own)}.")
        return looked_up(known, name, f"{name!r} was not estimated")

    @property
    def stopped(self) -> bool:
        """Whether it ended before it was complete, since somebody stopped it."""
        found = self.outcome.diagnosis
        fits = any(fit.stopped for fit in self.outcome.fits)
        return fits or (found is not None and found.stopped)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Say what was found, a sentence each."""
        return plain((*alarms(self.outcome), *summary(self.outcome)))

    def compare(self) -> Comparison:
        """Compare measurements and the model as it now stands."""
        found = self.outcome.diagnosis
        floors = None if found is None else found.floors
        return Comparison(final_comparisons(self.outcome), floors or None)

    @property
    def criteria(self) -> InformationCriteria | None:
        """AIC, BIC and FPE of the model as it now stands; None where nothing was compared."""
        return criteria(self.outcome)

    def profile(
        self,
        name: str,
        *,
        recording: str | None = None,
        level: float = 0.95,
        progress: Callback | None = None,
    ) -> Profile:
        """Compute the profile likelihood of a parameter: its interval where it is not symmetric,
        or has no end. It takes a fit for each of some ten values.

        Args:
            name: Of the parameter; `name@recording` where each recording has its own.
            recording: The one that was fitted; needed where each has a fit of its own.
            level: Probability of the interval.
            progress: Called after each fit; returning False stops with what there is.

        Returns:
            The deviance over the parameter, and how the others follow.

        Raises:
            InputError: Where it was not estimated.
        """
        with at_work(progress) as heard:
            from flexgui.core.workbench import profile_for
            from flexgui.library.predictions import Profile

            where = self.given._places
            scenario = self.project().scenario
            found = profile_for(scenario, name, recording, level=level, **where, progress=heard)
            return Profile(found)

    def residual_analysis(self, lags: int = 25, level: float = 0.99) -> ResidualAnalysis:
        """Analyse what the model as it now stands leaves; as `Comparison.residual_analysis`."""
        return self.compare().residual_analysis(lags, level)

    def export(self, folder: str | Path) -> Path:
        """Write report, tables and model; nothing is computed again.

        Args:
            folder: Made where it is missing.

        Returns:
            The path of report.html.

        Raises:
            InputError: Where nothing can be written there.
        """
        self.given._write(self.outcome, Path(folder))
        return Path(folder) / "report.html"

    def save(self, folder: str | Path) -> Path:
        """Write the result alone, without report and tables, for `open` in any later process.

        Args:
            folder: Made where it is missing. An export there is replaced.

        Returns:
            Its path. The recordings' files stay where they are; what came as a table lies in it.

        Raises:
            InputError: Where nothing can be written there.
        """
        self.given._write(self.outcome, Path(folder), whole=False)
        return Path(folder)

    def project(self) -> Project:
        """Make the project with what was found: every value where it ended, of local fits their
        means, and the effects that a diagnosis added.

        Returns:
            A new project, whose fit is a refinement alone.
        """
        diagnosis, scenario = self.outcome.diagnosis, self.given.scenario
        if diagnosis is None:
            return replace(self.given, scenario=identified_scenario(scenario, self.outcome))
        return replace(self.given, scenario=diagnosed_scenario(scenario, diagnosis))

    def to_casadi(self, *, free: Sequence[str] = ()) -> casadi.Function:
        """Convert the non-linear model, drive and forces included, into a CasADi function.

        Args:
            free: Parameters that stay symbols; of all others the value found is folded in.

        Returns:
            (x, r) -> (xdot, y) of states, inputs, rates and outputs, or (x, r, k) where some are
            free. `outcome.state_equations` has their names and units.

        Raises:
            InputError: Where CasADi is not installed, the model has no drive that moves every
                joint, or a parameter is not known or cannot be free.
        """
        from flexgui.export.model_format import no_equations
        from flexgui.library.casadi_function import casadi_function

        equations = self.outcome.state_equations
        if equations is None:
            raise InputError(no_equations(self.outcome))
        return casadi_function(equations, free)

    def __repr__(self) -> str:
        warnings = len(tuple(alarms(self.outcome)))
        noted = f" ({warnings} warnings, see `sentences`)" if warnings else ""
        head = f"{type(self).__name__}: {self.outcome.title}{noted}"
        return "\n".join((head, *result_lines(self.outcome)))

    def _repr_html_(self) -> str:
        above = paragraphs(alarms(self.outcome), "color:firebrick; font-weight:bold")
        below = html_table(final_parameters(self.outcome))
        return str(above + paragraphs(summary(self.outcome)) + below)


@dataclass(frozen=True, repr=False)
class Identification(_Found):
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


@dataclass(frozen=True, repr=False)
class Diagnosis(_Found):
    """The missing effects, the evidence for them, and the error after each step."""

    @property
    def verdict(self) -> str:
        """'missing', 'nothing_missing' or 'unlisted': of the model as given."""
        return self._diagnosis.verdict

    @property
    def final_verdict(self) -> str | None:
        """The same of what remains after the ladder; None where nothing was to be added."""
        return self._diagnosis.final_verdict

    @property
    def added(self) -> tuple[str, ...]:
        """Ids of the effects that were added, in their order."""
        return self._diagnosis.added

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """All candidates on the model as given, best first."""
        return self._diagnosis.ranking

    @property
    def steps(self) -> tuple[LadderStep, ...]:
        """The error ladder: the model as given, then after each effect."""
        return self._diagnosis.steps

    @property
    def words(self) -> tuple[str, ...]:
        """The verdict in words, a paragraph each."""
        return all_paragraphs(self._diagnosis)

    @property
    def _diagnosis(self) -> Any:
        assert self.outcome.diagnosis is not None
        return self.outcome.diagnosis

    def propose(self, progress: Callback | None = None) -> Proposal:
        """Propose laws for what the last model leaves.

        Args:
            progress: Called after each step; returning False stops.

        Returns:
            One to three laws, each with its formula, values and errors, or why there is none, and
            the variables that the rest depends on. `law.settings` is an effect for `with_effects`.

        Raises:
            InputError: Where the scenario or a recording is wrong.
        """
        if self._diagnosis.proposal is not None:
            found: Proposal = self._diagnosis.proposal
            return found
        return self.project().propose(progress)

    def compare_as_given(self) -> Comparison:
        """Compare measurements and the model as it was given."""
        before = comparisons_as_given(self.outcome)
        return Comparison(before or self.outcome.comparisons, self._diagnosis.floors or None)

    def to_dataframe(self, table: str = "ranking") -> pd.DataFrame:
        """Tabulate the diagnosis.

        Args:
            table: 'ranking', 'ladder', 'error_map' or 'parameters'.

        Raises:
            InputError: Where there is no such table.
        """
        from flexgui.export import tables

        names = {name: name for name in (*tables.OF_A_DIAGNOSIS, "parameters")}
        name = looked_up(names, table, f"to_dataframe: {table!r} is no table")
        return tables.table(self.outcome, name)

    def plot(self, view: str = "ladder") -> go.Figure:
        """Draw the diagnosis.

        Args:
            view: 'ladder' or 'ranking'.

        Raises:
            InputError: Where the view is not known or there is nothing to show.
        """
        views: dict[str, Any] = {
            "ladder": lambda: ladder(self.steps),
            "ranking": lambda: ranking(self.ranking, self._first_accepted),
        }
        return chosen(views, view)

    @property
    def _first_accepted(self) -> str | None:
        """The effect that the first round added."""
        return self._diagnosis.rounds[0].accepted if self._diagnosis.rounds else None

    def _repr_html_(self) -> str:
        steps = html_table(ladder_table(self._diagnosis))
        first = html_table(ranking_table(self.ranking, self._first_accepted))
        return str(paragraphs(self.words) + steps + first)


class StoppedError(RuntimeError):
    """A diagnosis was stopped before it began; `identification` is what there is."""

    def __init__(self, identification: Identification) -> None:
        super().__init__("The work was stopped before the diagnosis began.")
        self.identification = identification
