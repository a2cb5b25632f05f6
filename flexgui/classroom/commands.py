"""The commands about challenges: `challenge`, `reveal`, `hand-in` and `grade`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

TABLE = "grades.csv"

Place = Annotated[Path, typer.Argument(help="Folder or zip of a challenge.")]


def challenge(
    seed: Annotated[
        int, typer.Option(help="Number of the challenge; the same seed gives the same data.")
    ],
    out: Annotated[Path, typer.Option(help="Folder to write, or one file that ends in .zip.")],
    level: Annotated[str, typer.Option(help="easy: one hidden effect; hard: two.")] = "easy",
) -> None:
    """Write recordings with hidden effects, the truth sealed beside them."""
    from flexgui.core.challenge.challenge import make_challenge, write_challenge
    from flexgui.export.folder import check_writable

    check_writable(out.parent if out.suffix.lower() == ".zip" else out)
    write_challenge(make_challenge(seed, level), out)
    typer.echo(f"The challenge is in {out}. Find the missing effect, then: flexgui reveal {out}")


def reveal(
    place: Place,
) -> None:
    """Open the seal: print what was hidden in a challenge."""
    from flexgui.stages.challenge.judging import truth_of

    typer.echo(truth_of(place))


def hand_in(
    place: Place,
    guess: Annotated[
        list[str],
        typer.Option(
            help="Id of an effect, with its size after a colon; give it twice for two "
            "hidden effects."
        ),
    ],
    name: Annotated[str, typer.Option(help="Whose guess it is.")] = "",
    out: Annotated[Path | None, typer.Option(help="File to write, here by default.")] = None,
) -> None:
    """Seal a guess at a challenge into one file, to be graded."""
    from flexgui.classroom.hand_in import HandIn, most_guesses, stated_guess
    from flexgui.core.challenge.challenge import obfuscated_truth
    from flexgui.core.errors import InputError
    from flexgui.core.files import replacing

    obfuscated = obfuscated_truth(place)
    if len(guess) > most_guesses(obfuscated):
        raise InputError(
            f"{len(guess)} guesses are too many: this challenge hides {most_guesses(obfuscated)}. "
            f"Give at most that many --guess."
        )
    answer = HandIn(name, tuple(stated_guess(text) for text in guess), obfuscated)
    target = out or Path(answer.filename)
    with replacing(target) as temporary:
        temporary.write_text(answer.text(), encoding="utf-8", newline="\n")
    typer.echo(f"The hand-in is {target}.")


def grade(
    folder: Annotated[Path, typer.Argument(help="Folder of hand-ins (*.handin).")],
    out: Annotated[Path | None, typer.Option(help=f"CSV table; FOLDER/{TABLE} by default.")] = None,
) -> None:
    """Check sealed hand-ins and write a table: who found what, and how near the sizes are."""
    from flexgui.classroom.hand_in import as_csv, grades
    from flexgui.core.files import replacing

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
