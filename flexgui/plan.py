"""`flexgui plan`: the experiments to make next, as files to play."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from core.progress import Progress


def add_to(
    app: typer.Typer,
    plain_words: Callable[[], AbstractContextManager[None]],
    progress: Callable[[bool], AbstractContextManager[Progress]],
) -> None:
    """Add the command."""

    @app.command()
    def plan(
        scenario: Annotated[
            Path, typer.Argument(help="Scenario file (TOML), or the name of a supplied scenario.")
        ],
        out: Annotated[Path, typer.Option(help="Folder for the files; created if missing.")],
        seconds: Annotated[
            float, typer.Option(help="Time that there is, all experiments together, in s.")
        ] = 60.0,
        known: Annotated[
            str, typer.Option("--for", help="Parameters to know better, by commas; all else.")
        ] = "",
        between: Annotated[
            str, typer.Option(help="Two effects to tell apart, by commas: id,id.")
        ] = "",
        data: Annotated[
            Path | None,
            typer.Option(help="Folder of the recordings, if not the scenario's own folder."),
        ] = None,
        quiet: Annotated[bool, typer.Option("--quiet", help="No progress bars.")] = False,
    ) -> None:
        """Plan the next experiments for SCENARIO within its [limits]: references to play in OUT."""
        with plain_words(), progress(quiet) as bars:
            from flexgui.export.planned import plan_scenario
            from flexgui.library.shipped import scenario_path

            path = scenario_path(scenario)
            said = plan_scenario(path, out, data, seconds, _names(known), _names(between), bars)
        typer.echo("\n".join(said))


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for each in text.split(",") if (name := each.strip()))
