"""The commands `challenge` and `reveal`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer, plain_words: Callable[[], AbstractContextManager[None]]) -> None:
    """Registers both; `plain_words` turns bad input into one sentence."""

    @app.command()
    def challenge(
        seed: Annotated[int, typer.Option(help="Which challenge; the same seed, the same data.")],
        out: Annotated[Path, typer.Option(help="Folder to write, or one file that ends in .zip.")],
        level: Annotated[str, typer.Option(help="easy: one hidden effect; hard: two.")] = "easy",
    ) -> None:
        """Write recordings with hidden effects, the truth sealed beside them."""
        with plain_words():
            from core.study.challenge import make_challenge, write_challenge
            from flexgui.export.folder import check_writable

            check_writable(out.parent if out.suffix.lower() == ".zip" else out)
            write_challenge(make_challenge(seed, level), out)
            typer.echo(
                f"The challenge is in {out}. Name what is missing, then: flexgui reveal {out}"
            )

    @app.command()
    def reveal(
        place: Annotated[Path, typer.Argument(help="Folder or zip of a challenge.")],
    ) -> None:
        """Open the seal: print what was hidden in a challenge."""
        with plain_words():
            from core.study.challenge import reveal as opened

            typer.echo(opened(place))
