"""The commands about challenges: `challenge` and `reveal`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
