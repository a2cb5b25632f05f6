"""The identification, in a worker."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.core.progress import Progress
    from flexgui.core.results import Fit, Outcome, Profile
    from flexgui.core.scenario.schema import Scenario


def identify(
    scenario: Scenario,
    folder: str | None = None,
    *,
    progress: Progress,
) -> Outcome:
    """All that the scenario states except a diagnosis; it reads only the files of `folder`."""
    from flexgui.core.scenario.data_folder import ConfinedFolder
    from flexgui.core.scenario.stated_effects import without_diagnosis
    from flexgui.core.workbench import run_scenario

    where = ConfinedFolder(Path(folder or "."))
    outcome = run_scenario(without_diagnosis(scenario), folder=where, progress=progress)
    return replace(outcome, fits=tuple(_light(fit) for fit in outcome.fits))


def profile(
    scenario: Scenario, name: str, recording: str | None, folder: str, *, progress: Progress
) -> Profile:
    """The profile likelihood of a parameter, from where the scenario's parameters start."""
    from flexgui.core.scenario.data_folder import ConfinedFolder
    from flexgui.core.workbench import profile_for

    where = ConfinedFolder(Path(folder))
    return profile_for(scenario, name, recording, folder=where, progress=progress)


def _light(fit: Fit) -> Fit:
    """With the last population only, which is drawn: those of 10,000 generations of 300 members
    are 50 MB, which every session would keep in memory and on the disk."""
    before = (replace(generation, population=None) for generation in fit.convergence[:-1])
    return replace(fit, convergence=(*before, *fit.convergence[-1:]))
