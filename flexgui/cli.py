"""The command line. Heavy imports stand inside the commands, so that `--help` is quick."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from flexgui import __version__
from flexgui.plain_words import BAD_INPUT, INTERRUPTED, plain_words, print_error
from flexgui.stages.study import command as study

if TYPE_CHECKING:
    from flexgui.core.check.finding import Finding
    from flexgui.core.progress import Progress
    from flexgui.core.recording.table import Table
    from flexgui.core.scenario.schema import Scenario


class _Commands(TyperGroup):
    """Prints every error of a command as one sentence."""

    def invoke(self, ctx: Any) -> Any:
        with plain_words(raw=ctx.params["traceback"]):
            return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
    help="Identify flexible robot arms.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

ScenarioArgument = Annotated[
    Path, typer.Argument(help="Scenario file (TOML), or the name of a supplied scenario.")
]
DataOption = Annotated[
    Path | None, typer.Option(help="Folder of the recordings; default: the scenario's folder.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress bars.")]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, help="Processors to use at most; default: all.", show_default=False),
]


def main() -> None:
    """The entry point of `flexgui`."""
    os.environ.setdefault("PYTHONWARNINGS", "ignore")  # of processes that a command starts
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the cores run simulations
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Runs one command and returns its exit code. Wrong usage is printed as one sentence.

    `--traceback` is allowed anywhere on the line.
    """
    ordered = sorted(arguments, key="--traceback".__ne__)
    try:
        code = app(ordered or ["--help"], prog_name="flexgui", standalone_mode=False)
    except typer.Abort:
        return INTERRUPTED
    except typer.TyperException as error:
        text = " ".join(error.format_message().split()).rstrip(".")
        print_error(f"{text}; flexgui --help lists the commands.")
        return BAD_INPUT
    return code if isinstance(code, int) else 0


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"flexgui {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
    traceback: Annotated[
        bool,
        typer.Option("--traceback", help="Print the traceback of an internal error."),
    ] = False,
) -> None:
    pass


@app.command()
def export(
    scenario: ScenarioArgument,
    out: Annotated[Path, typer.Option(help="Folder for the report; created if it is missing.")],
    data: DataOption = None,
    no_check: Annotated[
        bool, typer.Option("--no-check", help="Do not check the recordings for faults.")
    ] = False,
    workers: WorkersOption = None,
    quiet: QuietOption = False,
) -> None:
    """Run SCENARIO and write report.html, result.json, tables and the model into OUT.

    Of the folder of a saved result they are written again; nothing is computed.
    """
    if scenario.is_dir():
        from flexgui.export.export_files import export_again

        typer.echo("\n".join(export_again(scenario, out, data)))
        return
    path, _ = _read(scenario, data)
    from flexgui.core.processors import at_most
    from flexgui.export.export_files import export_scenario
    from flexgui.progress import shown_progress

    with at_most(workers), shown_progress(quiet) as progress:
        lines = export_scenario(path, out, data, progress, _print_note, not no_check)
    typer.echo("\n".join(lines))


@app.command()
def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on; default: this machine only.")
    ] = None,
    port: Annotated[int, typer.Option(help="Port; if it is busy, the next free one.")] = 8080,
    data: Annotated[Path | None, typer.Option(help="Folder of the recordings.")] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(help="Of a new session: a scenario, or the folder of a saved result."),
    ] = None,
    demo: Annotated[
        bool, typer.Option("--demo", help="Others follow the teacher's stage.")
    ] = False,
    lan: Annotated[
        bool, typer.Option("--lan", help="Open to the local network, with a join code.")
    ] = False,
    join_code: Annotated[
        str | None, typer.Option(help="Join code of the class (with --lan); default: generated.")
    ] = None,
    origin: Annotated[
        list[str] | None,
        typer.Option(help="Another address of the page, for example behind a proxy."),
    ] = None,
    workers: Annotated[int, typer.Option(help="Identifications that run at the same time.")] = 2,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser.")] = False,
) -> None:
    """Open the workbench in the browser, until Ctrl-C."""
    _require_page()
    from flexgui.library.shipped import scenario_path

    path = scenario and scenario_path(scenario)
    from flexgui.server.options import ServeOptions
    from flexgui.server.serve import serve as run_server

    options = ServeOptions(
        host, port, data, path, demo, lan, join_code, tuple(origin or ()), workers,
        browser=not no_browser,
    )  # fmt: skip
    run_server(options, typer.echo)


def _require_page() -> None:
    """InputError if FlexGUI was installed without its extra `page`."""
    missing = [name for name in ("viser", "websockets", "segno") if find_spec(name) is None]
    if missing:
        from flexgui.core.errors import InputError
        from flexgui.core.sentences import install_command

        raise InputError(f"The page needs {', '.join(missing)}; run {install_command('page')}.")


@app.command()
def scenarios() -> None:
    """List the scenarios that come with FlexGUI; every command takes their names."""
    from flexgui.library.shipped import scenarios as shipped
    from flexgui.library.shipped import shipped_folder

    titles = shipped()
    width = max(map(len, titles))
    for name, title in titles.items():
        typer.echo(f"{name:{width}}  {title}")
    typer.echo(f"Examples are in {shipped_folder('examples')}")
    typer.echo(f"Sheets for a class are in {shipped_folder('teaching')}")


@app.command()
def reference() -> None:
    """Print every key, preset, drive, sensor, output and effect with units and defaults."""
    from flexgui.reference import reference_text

    typer.echo(reference_text(), nl=False)


@app.command()
def check(
    what: Annotated[
        Path,
        typer.Argument(help="Scenario (TOML file or supplied name) or one recording."),
    ],
    data: DataOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Check the recordings of SCENARIO, or one FILE, for faults; exit code 1 if there are any."""
    from flexgui.progress import shown_progress

    with shown_progress(quiet) as bars:
        findings, listed, names = _checked(what, data, bars)
    if as_json:
        from flexgui.export.folder import dumps

        typer.echo(dumps({"findings": [finding.as_json() for finding in findings]}), nl=False)
    else:
        lines = [*listed, *_lines(findings, len(names) or 1), *_dismissal(findings, names)]
        typer.echo("\n".join(lines))
    raise typer.Exit(int(any(finding.is_fault for finding in findings)))


@app.command()
def plan(
    scenario: ScenarioArgument,
    out: Annotated[Path, typer.Option(help="Folder for the files; created if missing.")],
    seconds: Annotated[
        float, typer.Option(help="Total time available for all experiments, in s.")
    ] = 60.0,
    focus: Annotated[
        str, typer.Option("--for", help="Parameters to improve, with commas; default: all.")
    ] = "",
    between: Annotated[str, typer.Option(help="Two effects to distinguish: id,id.")] = "",
    data: DataOption = None,
    workers: WorkersOption = None,
    quiet: QuietOption = False,
) -> None:
    """Plan the next experiments for SCENARIO within its [limits]; write the references into OUT."""
    path, _ = _read(scenario, data)
    from flexgui.core.processors import at_most
    from flexgui.export.plan_files import plan_scenario
    from flexgui.progress import shown_progress

    with at_most(workers), shown_progress(quiet) as bars:
        sentences = plan_scenario(path, out, data, seconds, _names(focus), _names(between), bars)
    typer.echo("\n".join(sentences))


app.command("study")(study.study)


def _print_note(text: str) -> None:
    typer.echo(f"flexgui: {text}", err=True)


def _checked(
    what: Path, data: Path | None, progress: Progress
) -> tuple[Sequence[Finding], list[str], tuple[str, ...]]:
    """The findings, what a file contains, and the recordings of a scenario."""
    if what.suffix.lower() in ("", ".toml"):
        path, scenario = _read(what, data)
        from flexgui.core.check.run_checks import check_scenario

        findings = check_scenario(scenario, path.parent, data, progress)
        return findings, [], tuple(spec.name for spec in scenario.recordings)
    from flexgui.core.check.run_checks import check_file
    from flexgui.core.recording.read_table import read_table
    from flexgui.core.scenario.data_folder import refuse_special

    refuse_special(what)
    return check_file(what, progress), _contents(read_table(what)), ()


def _read(name: Path, data: Path | None) -> tuple[Path, Scenario]:
    """The scenario with checked names and files: errors come before slow imports."""
    from flexgui.core.identify.unknowns import check_names
    from flexgui.core.scenario.data_folder import outside
    from flexgui.core.scenario.read import read_scenario
    from flexgui.library.shipped import scenario_path

    path = scenario_path(name)
    scenario = read_scenario(path)
    check_names(scenario)
    outside(scenario, path.parent, data)
    return path, scenario


def _contents(table: Table) -> list[str]:
    """Topics and groups of the file with their rate and span, if there are several."""
    lines = []
    for group in table.groups:
        rate = "" if group.rate is None else f", {group.rate:.5g} Hz"
        span = "" if group.span is None else f" over {group.span:.5g} s"
        lines.append(
            f"{group.name}: {group.rows:,} samples{rate}{span}: {', '.join(group.columns)}"
        )
    return lines


def _lines(findings: Sequence[Finding], count: int) -> list[str]:
    lines = []
    if not any(finding.is_fault for finding in findings):
        lines.append(f"{count} recording{'s' * (count != 1)}, no faults")
    for finding in findings:
        lines.append(f"{finding.recording}, {finding.channel}: {finding.fault}. {finding.evidence}")
        if finding.fix:
            lines.append(f"    {finding.fix}")
    return lines


def _dismissal(findings: Sequence[Finding], names: Sequence[str]) -> list[str]:
    """How a finding of a scenario's recordings is dismissed; nothing where there is none."""
    keys = [finding.key for finding in findings if finding.is_fault and finding.recording in names]
    line = "A finding is dismissed by a line in its recording's table"
    return [f'{line}: dismissed = ["{keys[0]}"]'] if keys else []


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for part in text.split(",") if (name := part.strip()))
