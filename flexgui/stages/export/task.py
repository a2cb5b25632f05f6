"""What is written in a worker to be taken away: report, model, motion, plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.read import scenario_toml
from flexgui.export.folder import check_writable
from flexgui.sentences.experiments import plan_paragraphs

if TYPE_CHECKING:
    from flexgui.core.progress import Progress
    from flexgui.core.recording.recording import Recording
    from flexgui.core.results import Outcome
    from flexgui.core.scenario.schema import Scenario
    from flexgui.scene.recorded_motion import RecordedMotion


def export(
    outcome: Outcome, scenario: Scenario, folder: str, out: str, *, progress: Progress
) -> str:
    """The folder `out`, with the report of what the page shows: nothing is identified again.

    `folder` holds the files that the scenario may read; its first motion is played in the report.
    """
    from flexgui.export.export_files import export_run
    from flexgui.export.saved_run import Source

    progress.stage("Writing the report")
    check_writable(Path(out))
    source = Source(scenario, scenario_toml(scenario), ConfinedFolder(Path(folder)))
    export_run(outcome, source, Path(out))
    return out


def model_files(outcome: Outcome, kind: str, *, progress: Progress) -> dict[str, bytes]:
    """Path -> content of the model in one format; for some of them a C compiler runs."""
    from flexgui.export.formats import model_formats

    progress.stage("Writing the model")
    return next(f for f in model_formats() if f.kind == kind).files(outcome)


def playback_page(shown: RecordedMotion, exaggeration: float, *, progress: Progress) -> str:
    """The motion, its bending `exaggeration` times as large, as a page, recorded by a viser server
    of this worker."""
    from flexgui.scene.motion_page import playback_html

    progress.stage("Recording the motion")
    return playback_html(shown.motion, shown.ghost, exaggeration)


class Planned(NamedTuple):
    """The next experiments."""

    words: tuple[str, ...] = ()
    """A paragraph each."""
    references: tuple[Recording, ...] = ()
    """To be played, one for each experiment."""


def plan_next(
    scenario: Scenario, seconds: float, folder: str, out: str, *, progress: Progress
) -> Planned:
    """The plan for `seconds`; its files lie in `out`. `folder` holds the files that the
    scenario, with the limits in it, may read: they are to lie beside those of the plan, under their
    names.
    """
    from flexgui.core.experiments.design import ExperimentRequest
    from flexgui.core.experiments.design_files import references
    from flexgui.core.experiments.plan import plan
    from flexgui.export.plan_files import write_plan

    request = ExperimentRequest(seconds, limits=scenario.limits)
    design = plan(scenario, request, folder=ConfinedFolder(Path(folder)), progress=progress)
    write_plan(scenario, design, Path(out))
    played = tuple(references(c, design) for c in design.chosen)
    return Planned(plan_paragraphs(design), played)
