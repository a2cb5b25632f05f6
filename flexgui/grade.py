"""The commands `hand-in` and `grade`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated

import typer

TABLE = "grades.csv"


def add_to(app: typer.Typer, plain_words: Callable[[], AbstractContextManager[None]]) -> None:
    """Registers both; `plain_words` turns bad input into one sentence."""

    @app.command("hand-in")
    def hand_in(
        place: Annotated[Path, typer.Argument(help="Folder or zip of a challenge.")],
        guess: Annotated[
            list[str],
            typer.Option(help="Id of an effect, with a size after a colon; twice where two hide."),
        ],
        name: Annotated[str, typer.Option(help="Whose guess it is.")] = "",
        out: Annotated[Path | None, typer.Option(help="File to write, here by default.")] = None,
    ) -> None:
        """Seal a guess at a challenge into one file, to be graded."""
        with plain_words():
            from core.errors import InputError
            from core.files import replacing
            from core.study.challenge import obfuscated_truth
            from flexgui.session.hand_in import HandIn, most_guesses, stated_guess

            sealed = obfuscated_truth(place)
            if len(guess) > most_guesses(sealed):
                raise InputError(
                    f"{len(guess)} guesses are too many: this challenge hides "
                    f"{most_guesses(sealed)}; give that many --guess."
                )
            given = HandIn(name, tuple(stated_guess(text) for text in guess), sealed)
            target = out or Path(given.filename)
            with replacing(target) as temporary:
                temporary.write_text(given.text(), encoding="utf-8", newline="\n")
            typer.echo(f"The hand-in is {target}.")

    @app.command()
    def grade(
        folder: Annotated[Path, typer.Argument(help="Folder of hand-ins (*.handin).")],
        out: Annotated[
            Path | None, typer.Option(help=f"CSV table; FOLDER/{TABLE} by default.")
        ] = None,
    ) -> None:
        """Check sealed hand-ins and write a table: who found what, and how near the sizes are."""
        with plain_words():
            from core.files import replacing
            from flexgui.session.grading import as_csv, grades

            rows = grades(folder)
            target = out or folder / TABLE
            with replacing(target) as temporary:
                temporary.write_text(as_csv(rows), encoding="utf-8", newline="\n")
            sound = [row for row in rows if not row.fault]
            complete = sum(bool(row.complete) for row in sound)
            typer.echo(
                f"{len(rows)} hand-ins, {complete} complete, {len(rows) - len(sound)} with a "
                f"fault: {target}"
            )
