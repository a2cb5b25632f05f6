"""`flexgui check`: faults of recordings, found before anything is fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from core.check.finding import Finding
    from core.progress import Progress
    from core.recording.table import Table


def add_to(
    app: typer.Typer,
    plain_words: Callable[[], AbstractContextManager[None]],
    progress: Callable[[bool], AbstractContextManager[Progress]],
) -> None:
    """Add the command."""

    @app.command()
    def check(
        what: Annotated[Path, typer.Argument(help="Scenario (TOML), or one recording.")],
        data: Annotated[
            Path | None,
            typer.Option(help="Folder of the recordings, if not the scenario's own folder."),
        ] = None,
        as_json: Annotated[
            bool, typer.Option("--json", help="Print the findings as JSON.")
        ] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="No progress bars.")] = False,
    ) -> None:
        """Look for faults in the recordings of SCENARIO or in one FILE."""
        with plain_words(), progress(quiet) as bars:
            found, listed = _checked(what, data, bars)
        if as_json:
            from flexgui.export.folder import dumps

            typer.echo(dumps({"findings": [one.as_json() for one in found]}), nl=False)
        else:
            typer.echo("\n".join([*listed, *_lines(found)]))


def _checked(
    what: Path, data: Path | None, progress: Progress
) -> tuple[Sequence[Finding], list[str]]:
    from core.check.run import check_file, check_scenario
    from core.scenario.data_folder import refuse_special
    from core.scenario.read import read_scenario

    refuse_special(what)
    if what.suffix.lower() == ".toml":
        return check_scenario(read_scenario(what), what.parent, data, progress), []
    from core.recording.read_table import read_table

    return check_file(what, progress), _contents(read_table(what))


def _contents(table: Table) -> list[str]:
    """Topics and groups with their rate and span, where the file has several."""
    lines = []
    for one in table.groups:
        rate = "" if one.rate is None else f", {one.rate:.5g} Hz"
        span = "" if one.span is None else f" over {one.span:.5g} s"
        lines.append(f"{one.name}: {one.rows:,} samples{rate}{span}: {', '.join(one.columns)}")
    return lines


def _lines(found: Sequence[Finding]) -> list[str]:
    if not found:
        return ["Nothing was found."]
    lines = []
    for one in found:
        lines.append(f"{one.recording}, {one.channel}: {one.fault}. {one.evidence}")
        if one.mend:
            lines.append(f"    {one.mend}")
    return lines
