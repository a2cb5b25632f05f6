"""The command `study`."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexgui.core.processors import WORKERS
from flexgui.plain_words import INTERRUPTED

if TYPE_CHECKING:
    from flexgui.core.resumable.journal import Finished


def study(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario file (TOML) or a supplied name, simulated.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for results; studies/SCENARIO by default.")
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, tcp://host:8786.")
    ] = None,
    runs: Annotated[int, typer.Option(help="Monte Carlo runs.")] = 20,
    workers: Annotated[int, typer.Option(help="Processes, without a cluster.")] = WORKERS,
    part: Annotated[
        list[str] | None,
        typer.Option(help="Only this part: fits, sweeps, baselines, bias, advice, prior."),
    ] = None,
) -> None:
    """Monte Carlo study of SCENARIO: tables, figures and a page in OUT; goes on if stopped."""
    from flexgui.core.montecarlo.settings import make_settings
    from flexgui.core.scenario.read import read_scenario
    from flexgui.library.shipped import scenario_path

    settings = make_settings(read_scenario(scenario_path(scenario)), runs=runs)

    # What computes is slow to load, and a slip in the scenario is said before.
    from flexgui.core.montecarlo.study import study as steps_of
    from flexgui.core.resumable.executor import Cluster
    from flexgui.export.folder import check_writable
    from flexgui.jobs.executor import Processes
    from flexgui.stages.study.findings import findings
    from flexgui.stages.study.report import REPORT
    from flexgui.stages.study.task import JOURNAL, write_report

    # What the pool logs for a server is an error here, and said as one.
    logging.getLogger("flexgui.jobs").addHandler(logging.NullHandler())
    folder = out or Path("studies") / scenario.stem
    executor = Processes(workers) if cluster is None else Cluster(cluster)
    check_writable(folder)
    journal = folder / JOURNAL
    steps = steps_of(settings, executor=executor, path=journal, only=part or [])
    typer.echo(f"{settings.scenario.title}: {settings.runs} runs; results arrive in {journal}")
    whole = True
    try:
        with closing(steps):
            _print_progress(steps)
    except KeyboardInterrupt:
        whole = False
    summary = write_report(settings, folder)
    for heading, text in findings(summary) if summary else ():
        typer.echo(f"\n{heading}\n  {text}")
    if summary:
        typer.echo(f"\nThe report is in {folder / REPORT}")
    if not whole:
        typer.echo("Stopped. Repeat the command to continue; finished cases are kept.")
        raise typer.Exit(INTERRUPTED)


def _print_progress(steps: Iterator[Finished]) -> None:
    """One line per finished case: how many, which, how long it may still take."""
    started, new, old = time.monotonic(), 0, 0
    for step in steps:
        if step.before:
            old += 1
            continue
        if old and not new:
            typer.echo(f"{old} of {step.total} were finished before.")
        new += 1
        seconds_left = (time.monotonic() - started) / new * (step.total - step.done)
        remaining = f", about {seconds_left:.0f} s left" if seconds_left >= 1.0 else ""
        typer.echo(f"{step.done}/{step.total} {step.record['key']}{remaining}")
    if old and not new:
        typer.echo(f"All {old} were finished before.")
