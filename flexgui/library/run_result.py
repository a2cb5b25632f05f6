"""What every result of a run has: estimates, comparison, files, and the way on from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.diagnosed_scenario import diagnosed_scenario, identified_scenario
from flexgui.core.errors import InputError
from flexgui.core.results import (
    Estimate,
    InformationCriteria,
    Outcome,
)
from flexgui.core.sentences import few
from flexgui.library.comparison import Comparison
from flexgui.library.progress_callback import Callback, at_work
from flexgui.library.shown import looked_up, paragraphs
from flexgui.views.headline import (
    criteria,
    final_comparisons,
    final_estimates,
)
from flexgui.views.parameter_tables import final_parameters
from flexgui.views.summary import alarms, plain, result_lines, summary
from flexgui.views.table import html_table

if TYPE_CHECKING:
    import casadi

    from flexgui.library.predictions import Profile
    from flexgui.library.project import Project
    from flexgui.library.residuals import ResidualAnalysis


@dataclass(frozen=True, repr=False)
class RunResult:
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
        """Analyse what the model as it now stands leaves; `lags` in samples and `level`, a
        probability, as in `Comparison.residual_analysis`."""
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
