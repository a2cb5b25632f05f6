"""The identification, in a worker."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.core.progress import Progress
    from flexgui.core.results import Fit, Outcome


def identify(
    scenario_toml: str,
    folder: str | None = None,
    *,
    progress: Progress,
) -> Outcome:
    """Everything that the scenario asks for; it may read the files of `folder` only."""
    from flexgui.core.scenario.data_folder import Within
    from flexgui.core.scenario.read import parse_scenario
    from flexgui.core.workbench import run_scenario

    outcome = run_scenario(
        parse_scenario(scenario_toml, "The scenario"),
        folder=Within(Path(folder or ".")),
        progress=progress,
    )
    return replace(outcome, fits=tuple(_light(fit) for fit in outcome.fits))


def _light(fit: Fit) -> Fit:
    """With the last population only, which is drawn: those of 10,000 generations of 300 members
    are 50 MB, which every session would keep in memory and on the disk."""
    before = (replace(generation, population=None) for generation in fit.convergence[:-1])
    return replace(fit, convergence=(*before, *fit.convergence[-1:]))
