"""Tasks that are one call of what lies below: export, plan, check, play, hide, study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.jobs.task import Task

if TYPE_CHECKING:
    from flexgui.core.check.finding import Finding
    from flexgui.core.progress import Progress
    from flexgui.core.recording.recording import Recording
    from flexgui.core.results import Fit, Outcome
    from flexgui.core.scenario.schema import Scenario
    from flexgui.stage.recorded import Playback


def export(
    outcome: Outcome, scenario_toml: str, folder: str, out: str, *, progress: Progress
) -> str:
    """The folder `out`, with the report of what the page shows: nothing is identified again.

    `folder` holds the files that the scenario may read; its first motion is played in the report.
    """
    from flexgui.core.scenario.data_folder import Within
    from flexgui.core.scenario.read import parse_scenario
    from flexgui.export.export_files import diagnosed_plainly, export_outcome
    from flexgui.export.folder import check_writable
    from flexgui.export.report_motion import report_motion

    progress.stage("Writing the report")
    check_writable(Path(out))
    scenario = parse_scenario(scenario_toml, "scenario.toml")
    motion = report_motion(scenario, outcome, Within(Path(folder)))
    found = diagnosed_plainly(scenario, outcome)
    export_outcome(outcome, scenario_toml, Path(out), motion, found)
    return out


def model_files(outcome: Outcome, kind: str, *, progress: Progress) -> dict[str, bytes]:
    """Path -> content of the model in one format; for some of them a C compiler runs."""
    from flexgui.export.formats import model_formats

    progress.stage("Writing the model")
    return next(one for one in model_formats() if one.kind == kind).files(outcome)


def playback_page(shown: Playback, exaggeration: float, *, progress: Progress) -> str:
    """The motion as a page, recorded by a viser server of this worker."""
    from flexgui.stage.playback import playback_html

    progress.stage("Recording the motion")
    return playback_html(shown.motion, shown.ghost, exaggeration)


def plan_next(
    scenario_toml: str, seconds: float, folder: str, out: str, *, progress: Progress
) -> tuple[str, ...]:
    """What the plan says; its files lie in `out`. `folder` holds the files that the scenario, with
    the limits in it, may read: they are to lie beside those of the plan, under their names.
    """
    from flexgui.core.experiments.design import Wish
    from flexgui.core.experiments.plan import plan
    from flexgui.core.scenario.data_folder import Within
    from flexgui.core.scenario.read import parse_scenario
    from flexgui.export.plan_files import write_plan
    from flexgui.sentences.experiments import plan_paragraphs

    scenario = parse_scenario(scenario_toml, "The scenario")
    wish = Wish(seconds, limits=scenario.limits)
    found = plan(scenario, wish, folder=Within(Path(folder)), progress=progress)
    write_plan(scenario, found, Path(out))
    return plan_paragraphs(found)


def findings(folder: str, scenario: Scenario, *, progress: Progress) -> tuple[Finding, ...]:
    """In the order of the recordings; InputError where one is no table of measurements. Files are
    those of the folder and no others."""
    from flexgui.core.check.run import check_scenario
    from flexgui.core.scenario.data_folder import Within

    return tuple(check_scenario(scenario, Within(Path(folder)), None, progress))


def play(
    scenario: Scenario, recording: str, folder: str, values: Mapping[str, float], *,
    progress: Progress,
) -> tuple[Recording, Playback]:  # fmt: skip
    """A file of `folder` only; `values` are the fitted parameters, none where there is no fit."""
    from flexgui.core.scenario.data_folder import Within
    from flexgui.stage.recorded import played, read_one

    found = read_one(scenario, recording, Within(Path(folder)), progress=progress)
    return found, played(scenario, values, found)


def hide(seed: int, level: str, folder: str, *, progress: Progress) -> tuple[str, str]:
    """(scenario as TOML, obfuscated truth); the recordings lie in `folder` afterwards."""
    from flexgui.core.recording.save import save_recording
    from flexgui.core.scenario.read import scenario_toml
    from flexgui.core.study.challenge import make_challenge

    progress.stage("Hiding an effect in an arm, and recording it")
    made = make_challenge(seed, level)
    for r in made.recordings:
        save_recording(r, Path(folder) / f"{r.name}.csv")
    return scenario_toml(made.scenario), made.obfuscated


def study_case(work: str, order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states, both as text; `work` names who makes it."""
    found = Task(work).resolve()(order)
    assert isinstance(found, str)
    return found


JOURNAL = "results.jsonl"
"""Beside the report, as `flexgui study` has it: that command goes on in the same folder."""


def study_report(settings: str, folder: str, *, progress: Progress) -> str:
    """Page, tables and result into `folder`, from the journal in it; `settings` as JSON."""
    from flexgui.core.montecarlo.settings import settings_of
    from flexgui.core.montecarlo.summary import summarise
    from flexgui.core.resumable.journal import Journal
    from flexgui.export.study_report import write_study

    progress.stage("Writing the report of the study")
    known, out = settings_of(settings), Path(folder)
    write_study(summarise(known, Journal(out / JOURNAL, known.identity).records), out)
    return folder


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
