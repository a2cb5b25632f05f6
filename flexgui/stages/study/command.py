"""The command `study`."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexgui.core.processors import WORKERS
from flexgui.plain_words import INTERRUPTED

if TYPE_CHECKING:
    from flexgui.core.montecarlo.settings import StudySettings
    from flexgui.core.resumable.executor import Executor
    from flexgui.core.resumable.journal import Finished

JOURNAL = "results.jsonl"

PrintLine = Callable[[str], None]


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
    folder = out or Path("studies") / scenario.stem
    done = _go_on(settings, _executor(cluster, workers), folder, part or [], typer.echo)
    if not done:
        raise typer.Exit(INTERRUPTED)


def _go_on(
    settings: StudySettings, executor: Executor, out: Path, only: list[str], print_line: PrintLine
) -> bool:
    """Runs what is not finished yet and writes the report; False where it was stopped."""
    from flexgui.core.montecarlo.study import study
    from flexgui.export.folder import check_writable

    check_writable(out)
    steps = study(settings, executor=executor, path=out / JOURNAL, only=only)
    print_line(
        f"{settings.scenario.title}: {settings.runs} runs; results arrive in {out / JOURNAL}"
    )
    report, whole = _ProgressPrinter(print_line), True
    try:
        with closing(steps):
            for step in steps:
                report(step)
    except KeyboardInterrupt:
        whole = False
    report.end()
    _write(settings, out, print_line)
    if not whole:
        print_line(
            "Stopped. The same command continues from here and repeats nothing that is finished."
        )
    return whole


def _executor(cluster: str | None, workers: int) -> Executor:
    if cluster is not None:
        from flexgui.core.resumable.executor import Cluster

        return Cluster(cluster)
    from flexgui.core.resumable.executor import Processes

    return Processes(workers)


def _write(settings: StudySettings, out: Path, print_line: PrintLine) -> None:
    """The report of all that is known of the study, also of parts that were not asked for now."""
    from flexgui.core.montecarlo.summary import summarise
    from flexgui.core.resumable.journal import Journal
    from flexgui.stages.study.findings import findings
    from flexgui.stages.study.report import REPORT, write_study

    records = Journal(out / JOURNAL, settings.identity).records
    if not records:
        return
    summary = summarise(settings, records)
    write_study(summary, out)
    for heading, text in findings(summary):
        print_line(f"\n{heading}\n  {text}")
    print_line(f"\nThe report is in {out / REPORT}")


class _ProgressPrinter:
    """One line per finished case: how many, which, how long it may still take."""

    def __init__(self, print_line: PrintLine) -> None:
        self.print_line, self.begun, self.new, self.old = print_line, time.monotonic(), 0, 0

    def __call__(self, finished: Finished) -> None:
        if finished.before:
            self.old += 1
            return
        if self.old and not self.new:
            self.print_line(f"{self.old} of {finished.total} were finished before.")
        self.new += 1
        each = (time.monotonic() - self.begun) / self.new
        left = each * (finished.total - finished.done)
        rest = f", about {left:.0f} s left" if left >= 1.0 else ""
        self.print_line(f"{finished.done}/{finished.total} {finished.record['key']}{rest}")

    def end(self) -> None:
        """Says so where there was nothing to do."""
        if self.old and not self.new:
            self.print_line(f"All {self.old} were finished before.")
