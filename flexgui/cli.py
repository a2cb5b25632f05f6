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
from flexgui.classroom import commands as challenge
from flexgui.plain_words import BAD_INPUT, INTERRUPTED, plain_words, print_error
from flexgui.stages.study import command as study

if TYPE_CHECKING:
    from flexgui.core.check.finding import Finding
    from flexgui.core.progress import Progress
    from flexgui.core.recording.table import Table
    from flexgui.core.scenario.schema import Scenario


class _Commands(TyperGroup):
    """Whatever any command raises ends in plain words."""

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
    Path | None, typer.Option(help="Folder of the recordings, if not the scenario's own folder.")
]
QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress bars.")]


def main() -> None:
    """The entry point of `flexgui`."""
    os.environ.setdefault("PYTHONWARNINGS", "ignore")  # of processes that a command starts
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the cores have simulations to do
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """One command; its exit code. Wrong usage is one sentence, like all that is wrong.

    `--traceback` may stand anywhere, although it is no command's own.
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
    quiet: QuietOption = False,
) -> None:
    """Run SCENARIO and write report.html, result.json, tables and the model into OUT."""
    path, _ = _read(scenario, data)
    from flexgui.export.export_files import export_scenario
    from flexgui.progress import shown_progress

    with shown_progress(quiet) as progress:
        lines = export_scenario(path, out, data, progress, _print_note)
    typer.echo("\n".join(lines))


@app.command()
def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on; this machine only by default.")
    ] = None,
    port: Annotated[int, typer.Option(help="Port; the next free one if it is busy.")] = 8080,
    data: Annotated[Path | None, typer.Option(help="Folder of the recordings.")] = None,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario of a new session: a file, or a supplied one.")
    ] = None,
    demo: Annotated[
        bool, typer.Option("--demo", help="Others follow the teacher's stage.")
    ] = False,
    lan: Annotated[
        bool, typer.Option("--lan", help="Open to the local network, with a join code.")
    ] = False,
    join_code: Annotated[
        str | None, typer.Option(help="The class's code (with --lan); generated if not given.")
    ] = None,
    origin: Annotated[
        list[str] | None,
        typer.Option(help="Another address of the page, e.g. behind a proxy."),
    ] = None,
    workers: Annotated[int, typer.Option(help="Identifications at the same time.")] = 2,
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
    """InputError where FlexGUI was installed without its extra `page`."""
    missing = [name for name in ("viser", "websockets", "segno") if find_spec(name) is None]
    if missing:
        from flexgui.core.errors import InputError

        raise InputError(
            f"The page needs {', '.join(missing)}; install it with pip install 'flexgui[page]'."
        )


@app.command()
def scenarios() -> None:
    """List the scenarios that come with FlexGUI; every command takes their names."""
    from flexgui.library.shipped import scenarios as shipped
    from flexgui.library.shipped import shipped_folder

    found = shipped()
    width = max(map(len, found))
    for name, title in found.items():
        typer.echo(f"{name:{width}}  {title}")
    typer.echo(f"Examples are in {shipped_folder('examples')}")
    typer.echo(f"Sheets for a class are in {shipped_folder('teaching')}")


@app.command()
def reference() -> None:
    """Print every key, preset, drive, sensor, output and effect with units and defaults."""
    from flexgui.reference import reference_text

    typer.echo(reference_text(), nl=False)


app.command("challenge")(challenge.challenge)
app.command("reveal")(challenge.reveal)
app.command("hand-in")(challenge.hand_in)
app.command("grade")(challenge.grade)


@app.command()
def check(
    what: Annotated[
        Path,
        typer.Argument(help="Scenario (TOML or the name of a supplied one), or one recording."),
    ],
    data: DataOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Look for faults in the recordings of SCENARIO or in one FILE; exit code 1 with faults."""
    from flexgui.progress import shown_progress

    with shown_progress(quiet) as bars:
        found, listed, count = _checked(what, data, bars)
    if as_json:
        from flexgui.export.folder import dumps

        typer.echo(dumps({"findings": [one.as_json() for one in found]}), nl=False)
    else:
        typer.echo("\n".join([*listed, *_lines(found, count)]))
    raise typer.Exit(int(any(one.is_fault for one in found)))


@app.command()
def plan(
    scenario: ScenarioArgument,
    out: Annotated[Path, typer.Option(help="Folder for the files; created if missing.")],
    seconds: Annotated[
        float, typer.Option(help="Time that there is, all experiments together, in s.")
    ] = 60.0,
    known: Annotated[
        str, typer.Option("--for", help="Parameters to know better, by commas; all else.")
    ] = "",
    between: Annotated[str, typer.Option(help="Two effects to tell apart, by commas: id,id.")] = "",
    data: DataOption = None,
    quiet: QuietOption = False,
) -> None:
    """Plan the next experiments for SCENARIO within its [limits]: references to play in OUT."""
    path, _ = _read(scenario, data)
    from flexgui.export.plan_files import plan_scenario
    from flexgui.progress import shown_progress

    with shown_progress(quiet) as bars:
        sentences = plan_scenario(path, out, data, seconds, _names(known), _names(between), bars)
    typer.echo("\n".join(sentences))


app.command("study")(study.study)


def _print_note(text: str) -> None:
    typer.echo(f"flexgui: {text}", err=True)


def _checked(
    what: Path, data: Path | None, progress: Progress
) -> tuple[Sequence[Finding], list[str], int]:
    if what.suffix.lower() in ("", ".toml"):
        path, scenario = _read(what, data)
        from flexgui.core.check.run_checks import check_scenario

        found = check_scenario(scenario, path.parent, data, progress)
        return found, [], len(scenario.recordings)
    from flexgui.core.check.run_checks import check_file
    from flexgui.core.recording.read_table import read_table
    from flexgui.core.scenario.data_folder import refuse_special

    refuse_special(what)
    return check_file(what, progress), _contents(read_table(what)), 1


def _read(given: Path, data: Path | None) -> tuple[Path, Scenario]:
    """A scenario whose names and files are there: a slip is told before what is heavy is imported
    or compiled."""
    from flexgui.core.identify.unknowns import check_names
    from flexgui.core.scenario.data_folder import outside
    from flexgui.core.scenario.read import read_scenario
    from flexgui.library.shipped import scenario_path

    path = scenario_path(given)
    scenario = read_scenario(path)
    check_names(scenario)
    outside(scenario, path.parent, data)
    return path, scenario


def _contents(table: Table) -> list[str]:
    """Topics and groups with their rate and span, where the file has several."""
    lines = []
    for one in table.groups:
        rate = "" if one.rate is None else f", {one.rate:.5g} Hz"
        span = "" if one.span is None else f" over {one.span:.5g} s"
        lines.append(f"{one.name}: {one.rows:,} samples{rate}{span}: {', '.join(one.columns)}")
    return lines


def _lines(found: Sequence[Finding], count: int) -> list[str]:
    lines = []
    if not any(one.is_fault for one in found):
        lines.append(f"{count} recording{'s' * (count != 1)}, no faults")
    for one in found:
        lines.append(f"{one.recording}, {one.channel}: {one.fault}. {one.evidence}")
        if one.mend:
            lines.append(f"    {one.mend}")
    return lines


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for each in text.split(",") if (name := each.strip()))
